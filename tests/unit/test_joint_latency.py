"""The latency file and the controller that uses it."""

import importlib.util
import math
from pathlib import Path

import pytest

from machines import hopper, record
from rhythmid.errors import InputError
from rhythmid.identify.identify import identify
from rhythmid.identify.latency import Latency, save_latency

EXAMPLE = Path(__file__).parents[2] / "docs" / "examples" / "delay_compensator.py"
SPEC = {"type": "chirp", "amplitude": 0.1, "band": [0, 7], "sweep": 12.0}


@pytest.fixture(scope="module")
def found():
    return identify(record(hopper(), SPEC, delays=(0.03, 0.02), std=5e-6), hopper())


def test_a_latency_file_gives_back_delays_and_model(found, tmp_path):
    save_latency(found, tmp_path / "latency.yaml")
    latency = Latency.load(tmp_path / "latency.yaml")
    assert latency.input == pytest.approx(0.03, abs=2e-4)
    assert latency.sum == pytest.approx(0.05, abs=2e-4)
    assert latency.model.value("linear_spring.stiffness") == pytest.approx(200.0, rel=1e-3)


def test_a_file_without_delays_is_refused_with_one_line(tmp_path):
    path = tmp_path / "other.yaml"
    path.write_text("model: {}\n")
    with pytest.raises(InputError, match="not a latency file"):
        Latency.load(path)


def test_the_example_controller_is_stable_with_the_latency_and_not_without(found, tmp_path):
    save_latency(found, tmp_path / "latency.yaml")
    spec = importlib.util.spec_from_file_location("delay_compensator", EXAMPLE)
    assert spec is not None and spec.loader is not None
    example = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(example)
    without, compensated = example.main(tmp_path / "latency.yaml")
    assert math.isinf(without) and compensated < 0.1
