"""The descent's steps in the states where a record begins."""

from dataclasses import replace

import numpy as np
import pytest

from machines import CATALOGUE, hopper
from rhythmid.identify import descent
from rhythmid.identify.descent import descend
from rhythmid.identify.free_run import prepare_run
from rhythmid.identify.noise import NoiseModel
from rhythmid.identify.series import Series

TIME = 2e-3 * np.arange(2000)
SWING = Series("made", TIME, 0.02 * np.sin(10.0 * TIME), None, None, 1, np.ones(2000, bool), 2e-3)
RATE = 2.0 * np.pi * 1.5  # of the nearest line to 10 rad/s, roughly


@pytest.mark.parametrize(("measured", "order"), [("position", 0), ("velocity", 1), ("acceleration", 2)])
def test_no_step_moves_a_start_by_more_than_ten_times_the_motion(measured, order):
    model = hopper().with_element(CATALOGUE["actuator_lag"], {"time_constant": 0.01})
    run = prepare_run(model, [replace(SWING, measured=measured)], 1e-3)
    leap = descent._leap(run, 0.02)
    assert leap[:2] == pytest.approx([0.2 * RATE**-order, 0.2 * RATE ** (1 - order)], rel=0.3)
    assert np.isinf(leap[2:]).all() and len(leap) == 3


def test_a_position_that_hardly_anything_pins_down_stays_near():
    """Of a speed that was recorded, only a faint ripple tells where it began."""
    model = hopper().with_element(
        CATALOGUE["position_ripple"], {"amplitude": 1e-9, "wavelength": 0.01, "phase": 0.3}
    )
    model = model.with_values({"linear_spring.stiffness": 0.0, "gravity.acceleration": 0.0})
    rng = np.random.default_rng(0)
    series = replace(SWING, value=SWING.value + 0.01 * rng.normal(size=2000), measured="velocity")
    run = prepare_run(model, [series], 1e-3)
    names = ("switched_damper.stance",)
    end = descend(model, run, names, NoiseModel(np.empty(0), 0.01), [np.array([0.1, 0.0])], 5)
    assert abs(end.starts[0][0] - 0.1) <= 5 * descent._leap(run, float(np.std(series.value)))[0]
