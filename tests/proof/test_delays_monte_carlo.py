"""A small Monte Carlo of the joint estimator; `benchmarks/delays_monte_carlo.py` is the large one."""

import numpy as np
import pytest

from machines import hopper, record
from rhythmid.identify.bound import cramer_rao
from rhythmid.identify.joint import fit_from
from rhythmid.identify.monte_carlo import Drawn, noisy, scatter

TRUTH = {
    "input_delay.delay": 0.04,
    "measurement_delay.delay": 0.055,
    "linear_spring.stiffness": 200.0,
    "switched_damper.stance": 2.0,
}
SPEC = {"type": "chirp", "amplitude": 0.02, "band": [0, 7], "sweep": 8.0}
NOISE = 2e-5
RUNS = 40


@pytest.mark.parametrize("cycle", [True, False])
def test_scatter_is_the_bound_and_intervals_cover(cycle):
    quiet = record(hopper(), SPEC, delays=(0.04, 0.055), std=0.0)
    machine = hopper().with_values(TRUTH)
    bound = cramer_rao(machine, quiet, NOISE, cycle=cycle)
    fits = [
        Drawn.of(fit_from(machine, noisy(quiet, NOISE, seed), cycle=cycle), tuple(TRUTH))
        for seed in range(RUNS)
    ]
    found = {name: scatter(fits, name, truth) for name, truth in TRUTH.items()}
    ratios = [found[name].std / bound.std[name] for name in TRUTH]
    assert max(ratios) < 1.4 and min(ratios) > 0.65  # 3.5 standard deviations of a scatter of 40
    assert np.mean([f.coverage for f in found.values()]) > 0.87
    assert max(abs(f.bias) / f.std for f in found.values()) < 0.6
