"""Numbers without names that show a motion once more, filtered, scaled and shifted: they are no effort."""

from pathlib import Path

import foreign
import numpy as np
import pytest
from foreign import moved, roles_of, servo, tones
from scipy.signal import lfilter

from rhythmid.start.start import guess

COUNT = 8000
TIME = np.arange(COUNT) * foreign.STEP
REFERENCE = tones(2, TIME, 0.3, 0.2, 1.5)
X, V, EFFORT = servo(REFERENCE)
NOISE = 0.03 * np.random.default_rng(3).standard_normal(COUNT)


def table(folder: Path, *columns: np.ndarray) -> Path:
    np.savetxt(folder / "run.dat", np.column_stack([TIME, *columns]), fmt="%.8g")
    return folder / "run.dat"


def filtered(value: np.ndarray, lag: float = 0.004) -> np.ndarray:
    """A first-order low-pass filter's output, `lag` [s] behind."""
    share = foreign.STEP / lag
    return np.asarray(lfilter([share], [1.0, share - 1.0], value))


@pytest.mark.parametrize("scale", [1.0, 0.05, 30.0])
def test_a_filtered_copy_of_a_noisy_angle_is_no_effort_whatever_its_scale_and_offset(tmp_path, scale):
    path = table(tmp_path, V, X + NOISE, REFERENCE, scale * filtered(X + NOISE) + 0.42)
    assert roles_of(path) == {"output": "2", "velocity": "1", "input": "3"}
    found = guess(path)
    assert found.roles.input_kind == "reference"
    assert any(line.startswith("CHECK 4 is taken for another sensor or a filter") for line in found.lines())


def test_a_second_sensor_of_the_speed_is_no_effort(tmp_path):
    force = tones(1, TIME)
    x, v = moved(force, 0.05, 0.3, 6.0)
    path = table(tmp_path, v, x, force, v + 0.01 * NOISE / NOISE.std())
    assert roles_of(path) == {"output": "2", "velocity": "1", "input": "3"}


def test_a_force_that_moves_a_slow_spring_is_an_effort(tmp_path):
    force = tones(1, TIME, 1.0, 0.1, 0.5)
    x, v = moved(force, 0.01, 0.4, 8.0)
    assert roles_of(table(tmp_path, v, x + 0.1 * NOISE, force)) == {
        "output": "2",
        "velocity": "1",
        "input": "3",
    }


def test_a_multiple_of_the_output_without_a_name_is_doubted_as_an_effort(tmp_path):
    x, v = moved(tones(1, TIME), 0.05, 0.3, 6.0)
    rng = np.random.default_rng(4)
    path = table(tmp_path, v, x, -0.1 * x + 1e-4 * x.std() * rng.standard_normal(COUNT))
    (doubt,) = guess(path).roles.choices["input"].doubts
    assert "no name says that it drives" in doubt and "copy of the output" in doubt
