"""A start far off is led to the machine by all samples alike, however much less those weigh whose stamps jitter."""

import numpy as np
import pytest

from rhythmid.excitation.sequence import build
from rhythmid.identify.multiple_shooting import windows
from rhythmid.identify.output_error import estimate
from rhythmid.identify.series import prepare
from rhythmid.model import Model
from rhythmid.record.record import Channel, Record
from rhythmid.simulation.signal import zero_order_hold
from rhythmid.simulation.simulate import simulate

TRUE = {"pendulum_gravity.moment": 1.0, "viscous_damper.damping": 0.05}
GIVEN = Model.from_text(
    """
inertia: {mass: {value: 0.05, unit: kg*m^2, fixed: true}}
force:
  - pendulum_gravity: {moment: {value: 1.1, unit: N*m}}
  - viscous_damper: {damping: {value: 0.06, unit: N*m*s/rad}}
"""
)
NOISE, JITTER, PERIOD = 2e-4, 1.5e-3, 5e-3


def turning_over(seed: int, jitter: float) -> Record:
    """A pendulum that is driven over the top, with stamps that are out by `jitter` [s] (standard deviation)."""
    rng = np.random.default_rng(seed)
    time = PERIOD * np.arange(6400)
    command = build(
        {"type": "multisine", "rms": 0.6, "period": 20.0, "periods": 2, "band": [0.1, 2.0], "seed": seed}
    )(time)
    run = simulate(GIVEN.with_values(TRUE), time, zero_order_hold(time, command))
    late = np.clip(jitter * rng.standard_normal(len(time)), -PERIOD, PERIOD)
    output = np.interp(time + late, time, run.output) + rng.normal(0.0, NOISE, len(time))
    return Record("run", Channel(time, output, "rad"), Channel(time, command, "N*m"), hold="zero")


@pytest.mark.parametrize("seed", [4, 5, 7, 10])
def test_a_start_far_off_comes_to_the_machine_with_jitter_of_the_stamps_as_without(seed):
    for jitter, followed in ((0.0, 1e-4), (JITTER, 2e-3)):
        cut = windows(prepare([turning_over(seed, jitter)]), 8.0)
        assert all((one.spread is None) == (jitter == 0.0) for one in cut)
        fit = estimate(GIVEN, cut)
        assert fit.nrmse() < followed
        for name, value in TRUE.items():
            assert fit.model.value(name) == pytest.approx(value, abs=4.0 * fit.std[name])


def test_a_machine_that_is_found_late_is_weighed_by_the_noise_that_is_left_then():
    fit = estimate(GIVEN, windows(prepare([turning_over(27, 0.0)]), 8.0))
    assert fit.nrmse() < 1e-4
    assert fit.chi2 / fit.samples == pytest.approx(1.0, abs=0.2)
    assert fit.std["viscous_damper.damping"] < 1e-5
