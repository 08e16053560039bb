"""What a refusal says, and what the tests of refusals share."""

from collections.abc import Callable
from importlib.metadata import entry_points

import pytest

from rhythmid.cli import COMMAND_GROUP
from rhythmid.errors import InputError

EXPERIMENT = "model: hopper.yaml\nexcitation: {type: chirp, amplitude: 0.3, sweep: 2.0}\n"


def refusal(read: Callable[[], object]) -> str:
    with pytest.raises(InputError) as caught:
        read()
    return str(caught.value)


def needs_run() -> None:
    """Skip where the packages of the graph, which bring the command `run`, are not installed."""
    if "run" not in entry_points(group=COMMAND_GROUP).names:
        pytest.skip("rhythmid_bringup is not installed")
