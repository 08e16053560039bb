"""The gate of free-run error: an effect whose size may as well be nothing is dropped, whatever it predicts."""

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from machines import CATALOGUE, hopper
from rhythmid.diagnose.gate import NEEDED, admitted, faint
from rhythmid.diagnose.search.forward import Search
from rhythmid.diagnose.search.refit import Trial
from rhythmid.identify.noise import NoiseModel
from rhythmid.identify.output_error import Fit

QUIET = NoiseModel(np.empty(0), 1.0)


def found(name: str, values: dict[str, float], size: str, std: float, gain: float = 10.0) -> Search:
    """A search that chose one effect, the size of which has this standard deviation; chi2 falls by `gain` with it."""
    model = hopper().with_element(CATALOGUE[name], values)
    best = Trial((name,), model, (), 100.0, 1000, len(model.free), True, QUIET)
    none = Trial((), hopper(), (), 110.0, 1000, len(hopper().free), True, QUIET)
    fit = SimpleNamespace(
        model=model, std={f"{name}.{size}": std}, chi2=100.0, nrmse=lambda hidden=False: math.nan
    )
    nominal = SimpleNamespace(model=hopper(), std={}, chi2=100.0 + gain)
    return Search(cast(Fit, nominal), best, cast(Fit, fit), QUIET, (best, none), (), ())


@pytest.mark.parametrize(("std", "near"), [(0.011, True), (0.2, True), (0.009, False), (1e-4, False)])
def test_a_size_within_three_standard_deviations_of_absence_is_faint(std, near):
    assert (
        faint(
            found("coulomb_friction", {"force": 0.03, "transition": 0.01}, "force", std), "coulomb_friction"
        )
        is near
    )


@pytest.mark.parametrize(("std", "near"), [(0.011, True), (0.009, False)])
def test_a_gain_is_measured_from_the_one_that_it_has_where_it_is_absent(std, near):
    gain = CATALOGUE["actuator_gain"]
    assert gain.absent == 1.0
    assert faint(found("actuator_gain", {gain.size: 0.97}, gain.size, std), "actuator_gain") is near


@pytest.mark.parametrize("std", [100.0, math.inf])
def test_a_limit_that_is_absent_at_infinity_is_not_judged_by_its_distance(std):
    assert not faint(found("actuator_saturation", {"limit": 2.0}, "limit", std), "actuator_saturation")


FRICTION = {"force": 0.03, "transition": 0.01}


def test_a_faint_effect_alone_leaves_the_nominal_model_and_is_told():
    friction = found("coulomb_friction", FRICTION, "force", 0.02)
    left, told = admitted(friction, None)
    assert left.best.added == () and left.fit is friction.nominal
    assert len(told) == 1 and told[0].startswith("coulomb_friction: its size is within 3 standard deviations")


def test_an_effect_that_is_needed_stays_however_uncertain_its_size():
    friction = found("coulomb_friction", FRICTION, "force", 0.02, gain=10.0 * NEEDED)
    left, told = admitted(friction, None)
    assert left is friction and told == ()


def test_an_effect_stays_where_the_model_cannot_follow_the_records_without_it(monkeypatch):
    model = hopper().with_element(CATALOGUE["coulomb_friction"], FRICTION)
    both = model.with_element(CATALOGUE["quadratic_drag"], {"coefficient": 0.5})
    friction = found("coulomb_friction", FRICTION, "force", 0.02)
    best = replace(friction.best, added=("coulomb_friction", "quadratic_drag"), model=both)
    std = {"coulomb_friction.force": 0.02, "quadratic_drag.coefficient": 1e-3}
    fit = SimpleNamespace(
        **vars(friction.fit) | {"model": both, "std": std, "run": SimpleNamespace(series=(), max_step=1e-3)}
    )
    two = replace(friction, best=best, fit=cast(Fit, fit))
    monkeypatch.setattr("rhythmid.diagnose.gate.run_trials", lambda *_: ([], ["coulomb_friction diverged"]))
    left, told = admitted(two, None)
    assert left is two and told == ()
