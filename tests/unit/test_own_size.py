"""A stated effect whose size its own fit determines says so, where other explanations make its standard deviation large."""

from types import SimpleNamespace
from typing import Any, cast

import pytest

from machines import CATALOGUE, hopper
from rhythmid.diagnose.answer.effect_notes import own_sizes
from rhythmid.diagnose.verdict import Decision
from rhythmid.identify.output_error import Fit

MODEL = hopper().with_element(CATALOGUE["coulomb_friction"], {"force": 0.5, "transition": 1e-3})


@pytest.mark.parametrize(
    ("verdict", "own", "std", "told"),
    [
        ("missing_physics", 0.04, 0.9, True),
        ("missing_physics", 0.04, 0.03, False),
        ("missing_physics", 0.5, 0.9, False),
        ("undecided", 0.04, 0.9, False),
    ],
)
def test_what_a_fit_alone_tells_of_a_size_is_told(verdict: str, own: float, std: float, told: bool):
    decision: Any = SimpleNamespace(verdict=verdict, named=("coulomb_friction",))
    fit: Any = SimpleNamespace(model=MODEL, std={"coulomb_friction.force": std})
    notes = own_sizes(cast(Decision, decision), cast(Fit, fit), {"coulomb_friction": own})
    assert len(notes) == told
    assert all(
        one.startswith("coulomb_friction.force: 0.500 ± 0.020 N beside the other effects") for one in notes
    )
