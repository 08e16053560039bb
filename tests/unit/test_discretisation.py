"""The effect of discretisation on estimates: small where the integration is accurate, whatever the command looks like."""

from dataclasses import replace

import numpy as np
import pytest

import rhythmid as rh
from rhythmid.identify.discretisation import discretisation_error, with_discretisation_error
from rhythmid.identify.joint import fit_from
from rhythmid.identify.output_error import Fit

MACHINE = """
inertia: {mass: {value: 1.0, unit: kg, fixed: true}}
force:
  - linear_spring: {stiffness: {value: 185.0, unit: N/m}, rest_length: {value: 0.0, unit: m, fixed: true}}
  - viscous_damper: {damping: {value: 1.6, unit: N*s/m}}
"""


@pytest.fixture(scope="module")
def fit() -> Fit:
    """The fit to a record whose commands are held for a sample, and whose samples are averaged."""
    machine = rh.Model.from_text(MACHINE)
    run = {
        "excitation": {"type": "chirp", "amplitude": 1.5, "band": [0.5, 4.0], "sweep": 10.0},
        "forcing": {"amplitude": 0.0},
        "delays": {"input": 0.012, "measurement": 0.0},
        "noise": {"measurement_std": 2e-5},
        "time": {"rate": 200},
    }
    found = fit_from(machine, rh.simulate(machine, run).record)
    assert found.run.smooth and found.run.series[0].block > 1
    return found


def test_a_held_command_costs_no_accuracy_where_every_sample_is_simulated(fit):
    error = discretisation_error(fit)  # in units of the noise
    assert float(np.sqrt(np.mean(error**2))) < 0.1


def test_the_shift_of_an_estimate_does_not_depend_on_how_much_block_scores_widen_the_others(fit):
    factors = np.linspace(1.0, 3.0, len(fit.names))
    wide = replace(fit, covariance=fit.covariance * np.outer(factors, factors))
    added = [with_discretisation_error(one).covariance - one.covariance for one in (fit, wide)]
    np.testing.assert_allclose(np.diag(added[1]), np.diag(added[0]), rtol=1e-3)
