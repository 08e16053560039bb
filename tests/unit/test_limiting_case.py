"""An effect that does as well however small it is is but the limit that its other parameters take."""

from dataclasses import replace

import numpy as np
import pytest

from machines import CATALOGUE, SHORT, hopper, records, search_of
from rhythmid.diagnose import limiting_case
from rhythmid.diagnose.gate import faint, needed
from rhythmid.diagnose.limiting_case import limiting_cases
from rhythmid.diagnose.search.forward import WORTH, Search
from rhythmid.identify.noise import NoiseModel
from rhythmid.identify.output_error import estimate
from rhythmid.identify.series import prepare

NOISE = NoiseModel(np.empty(0), 0.5e-4)  # of averages of four samples


def search_for(true: str, true_values: dict[str, float], named: str, values: dict[str, float]) -> Search:
    """A search that named one effect in records of a machine with another."""
    machine = hopper().with_element(CATALOGUE[true], true_values)
    series = prepare(records(machine, SHORT), 4)
    begin = hopper().with_element(CATALOGUE[named], values)
    fit = estimate(begin, series, noise=NOISE, max_step=1e-3)
    return search_of(fit, named)


def test_a_damper_that_depends_on_a_position_far_away_is_a_plain_one_and_no_name():
    far = {"coefficient": 0.6, "reference": -1.0, "exponent": 2.0}
    said = limiting_cases(search_for("viscous_damper", {"damping": 0.8}, "position_dependent_damping", far))
    assert (
        len(said) == 1 and "position dependent damping does as well with a hundredth of its size" in said[0]
    )


def test_a_damper_that_does_depend_on_position_keeps_its_name():
    values = {"coefficient": 200.0, "reference": 0.12, "exponent": 2.0}
    found = search_for("position_dependent_damping", values, "position_dependent_damping", values)
    assert limiting_cases(found) == []


def test_a_stop_touched_once_is_a_stop_however_uncertain_its_stiffness():
    values = {"stiffness": 300.0, "damping_ratio": 0.05, "position": 0.1665}
    found = search_for("end_stop_contact", values, "end_stop_contact", values)
    fit = found.fit
    assert float(np.max([one.value.max() for one in fit.run.series])) > 0.1665
    assert limiting_cases(found) == []


def test_a_stop_that_does_as_well_with_a_tenth_of_its_stiffness_but_no_less_keeps_its_name():
    free = prepare(records(hopper(), SHORT), 4)
    hit = max(float(one.value.max()) for one in free) - 8e-4
    values = {"stiffness": 3000.0, "damping_ratio": 0.1, "position": hit}
    machine = hopper().with_element(CATALOGUE["end_stop_contact"], values)
    known = machine.with_values({"input_delay.delay": 0.0203, "measurement_delay.delay": 0.0151})
    fit = estimate(known, prepare(records(machine, SHORT), 4), noise=NOISE, max_step=1e-3)
    name = "end_stop_contact.stiffness"
    softer = replace(fit.model.parameters[name], value=0.1 * fit.model.value(name), fixed=True)
    again = estimate(fit.model.with_parameters({name: softer}), fit.run.series, noise=NOISE, max_step=1e-3)
    assert again.chi2 < fit.chi2 + WORTH
    assert limiting_cases(search_of(fit, "end_stop_contact")) == []


@pytest.mark.parametrize(
    ("true", "values", "named", "begin", "told"),
    [
        (
            "viscous_damper", {"damping": 0.8},
            "position_dependent_damping", {"coefficient": 0.6, "reference": -1.0, "exponent": 2.0}, True,
        ),
        (
            "position_dependent_damping", {"coefficient": 200.0, "reference": 0.12, "exponent": 2.0},
            "position_dependent_damping", {"coefficient": 200.0, "reference": 0.12, "exponent": 2.0}, False,
        ),
    ],
)  # fmt: skip
def test_beside_another_effect_only_the_sum_is_determined_where_a_hundredth_of_the_size_does_as_well(
    true, values, named, begin, told
):
    dry = CATALOGUE["coulomb_friction"], {"force": 0.05}
    series = prepare(records(hopper().with_element(CATALOGUE[true], values).with_element(*dry), SHORT), 4)
    model = hopper().with_element(CATALOGUE[named], begin).with_element(*dry)
    fit = estimate(model, series, noise=NOISE, max_step=1e-3)
    said = limiting_cases(search_of(fit, named, "coulomb_friction"))
    sum_only = (
        "only what position dependent damping and coulomb friction do together is determined, not the size of"
    )
    assert [sentence.startswith(sum_only) for sentence in said] == [True] * told


def test_a_stop_of_hardly_determined_stiffness_keeps_its_name_beside_friction():
    dry = CATALOGUE["coulomb_friction"], {"force": 0.05}
    free = prepare(records(hopper().with_element(*dry), SHORT), 4)
    hit = max(float(one.value.max()) for one in free) - 8e-4
    values = {"stiffness": 3000.0, "damping_ratio": 0.1, "position": hit}
    machine = hopper().with_element(CATALOGUE["end_stop_contact"], values).with_element(*dry)
    known = machine.with_values({"input_delay.delay": 0.0203, "measurement_delay.delay": 0.0151})
    fit = estimate(known, prepare(records(machine, SHORT), 4), noise=NOISE, max_step=1e-3)
    found = search_of(fit, "end_stop_contact", "coulomb_friction")
    assert faint(found, "end_stop_contact", needed(found.best))
    assert limiting_cases(found) == []


@pytest.mark.parametrize(
    ("std", "converged", "told"), [(0.02, False, True), (0.02, True, False), (0.001, False, False)]
)
def test_a_descent_that_does_not_come_to_its_end_leaves_a_faint_size_undetermined(
    monkeypatch, std, converged, told
):
    values = {"coulomb_friction": {"force": 0.05}, "cubic_stiffness": {"coefficient": 500.0}}
    machine = hopper()
    for name, given in values.items():
        machine = machine.with_element(CATALOGUE[name], given)
    fit = estimate(machine, prepare(records(machine, SHORT[:1]), 4), noise=NOISE, max_step=1e-3)
    variances = np.full(len(fit.names), 1e-12)
    variances[fit.names.index("coulomb_friction.force")] = std**2
    found = search_of(replace(fit, covariance=np.diag(variances)), *values)
    worse = replace(found.best, chi2=fit.chi2 + 1000.0, converged=converged)
    monkeypatch.setattr(limiting_case, "run_trials", lambda *_: ([worse], []))
    said = limiting_cases(found)
    assert [sentence.endswith("not the size of coulomb friction") for sentence in said] == [True] * told
