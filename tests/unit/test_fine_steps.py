"""Estimates of the chosen model owe nothing to the length of the integration steps with which it was found."""

from dataclasses import replace

import numpy as np

from machines import CATALOGUE, SHORT, hopper, records
from rhythmid.diagnose.intervals import finely_stepped
from rhythmid.diagnose.search.forward import Search
from rhythmid.diagnose.search.trial import Trial
from rhythmid.identify.noise import NoiseModel
from rhythmid.identify.output_error import estimate
from rhythmid.identify.series import prepare

QUIET = 1e-6  # [m]


def test_what_long_steps_moved_comes_back_within_its_interval():
    machine = hopper().with_element(CATALOGUE["cubic_stiffness"], {"coefficient": 5e3})
    series = prepare(records(machine, SHORT[:2], delays=(0.0, 0.0), std=QUIET), 7)
    noise = NoiseModel(np.empty(0), QUIET / np.sqrt(7.0))
    fit = estimate(machine, series, noise=noise, max_step=7e-3)
    trial = Trial(
        ("cubic_stiffness",), fit.model, fit.starts, fit.chi2, fit.samples, len(fit.names), True, noise,
        fit.differences,
    )  # fmt: skip
    coarse = Search(fit, trial, fit, noise, (trial,), (), ())

    def worst(found: Search) -> float:
        true = {
            "linear_spring.stiffness": 200.0,
            "linear_spring.rest_length": 0.2,
            "switched_damper.stance": 2.0,
        }
        return max(abs(found.fit.model.value(n) - v) / found.fit.std[n] for n, v in true.items())

    assert worst(coarse) > 5.0
    assert worst(finely_stepped(coarse)) < 3.0
    nothing = replace(coarse, best=replace(trial, added=()))
    assert finely_stepped(nothing) is nothing
