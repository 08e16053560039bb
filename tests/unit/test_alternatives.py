"""Other explanations than the search's effects: a freed value, a longer delay, another place, one law for several."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from machines import CATALOGUE, SHORT, hopper, records, search_of
from rhythmid.diagnose import alternatives as module
from rhythmid.diagnose.alternatives import LONGEST_DELAY, alternatives, fixed_values
from rhythmid.diagnose.baseline import INPUT_DELAY
from rhythmid.diagnose.hypothesis import Kind
from rhythmid.diagnose.search.round import Round
from rhythmid.diagnose.search.score_tests import Score, changes_of, score, sizes_along, trajectories
from rhythmid.diagnose.search.trial import Proposal, Trial
from rhythmid.elements.candidates import candidates
from rhythmid.elements.catalogue import Catalogue
from rhythmid.identify.noise import NoiseModel
from rhythmid.identify.output_error import Fit, estimate
from rhythmid.identify.series import dominant_frequency, prepare
from rhythmid.model import INERTIA, Model
from rhythmid.value import Prior

NOISE = NoiseModel(np.empty(0), 0.5e-4)  # of averages of four samples
LAGS = ("actuator_lag", "command_lag", "sensor_lag")
LAG, DRIFT = {"time_constant": 0.03}, {"rate": 2e-3}


def fitted(begin: Model, truth: Model, delays: tuple[float, float] = (0.0203, 0.0151)) -> Fit:
    series = prepare(records(truth, SHORT[:2], delays=delays), 4)
    return estimate(begin, series, noise=NOISE, max_step=1e-3)


def rounds_of(fit: Fit) -> list[Round]:
    """A round of scores of the lags at a fit."""
    lags = Catalogue({name: CATALOGUE[name] for name in LAGS})
    known = trajectories(fit)
    scores = score(fit, changes_of(known, candidates(lags, fit.model.setting, sizes_along(known)).tried))
    return [Round(tuple(scores), 0.0)]


def others(
    nominal: Fit,
    chosen: Fit,
    catalogue: Catalogue = CATALOGUE,
    *labels: str,
    rounds: Sequence[Round] = (),
) -> list[tuple[Trial, Kind]]:
    """The alternatives to a search that chose the effects with these labels."""
    base, trial = search_of(nominal).best, replace(search_of(chosen, *labels).best, differences=None)
    series, known = list(chosen.run.series), trajectories(chosen)
    return alternatives(base, trial, series, catalogue, NOISE, 1e-3, known, rounds, [base, trial])


def proposed(monkeypatch: pytest.MonkeyPatch, *given, **options) -> list[Proposal]:
    """What is fitted, before it is."""
    kept: list[Proposal] = []

    def run_trials(proposals, *_, **__):
        kept.extend(proposals)
        return [], []

    monkeypatch.setattr(module, "run_trials", run_trials)
    others(*given, **options)
    return kept


def lagging(fit: Fit, *names: str) -> Fit:
    """A fit whose model has these lags, too, with a start that has their states."""
    model = fit.model
    for name in names:
        model = model.with_element(CATALOGUE[name], LAG)
    return replace(fit, model=model, starts=tuple(np.append(one, np.zeros(len(names))) for one in fit.starts))


@pytest.fixture(scope="module")
def plain() -> Fit:
    return fitted(hopper(), hopper())


def test_values_that_the_author_holds_fixed_can_be_freed_and_those_fixed_by_nature_or_zero_cannot():
    names = fixed_values(hopper())
    assert set(names) == {INERTIA, "gravity.acceleration"}  # the flight damping is given as nothing at all
    stiff = hopper().parameters["linear_spring.stiffness"]
    held = hopper().with_parameters({"linear_spring.stiffness": replace(stiff, fixed=True)})
    assert set(fixed_values(held)) == {*names, "linear_spring.stiffness"}
    assert "linear_spring.stiffness" not in fixed_values(held, ("linear_spring",))


@pytest.mark.parametrize("share", [0.93, 1.0])
def test_a_mass_that_is_held_at_a_wrong_value_is_freed_and_found(share):
    true = hopper().mass.value
    given = hopper().with_parameters({INERTIA: replace(hopper().mass, value=share * true, fixed=True)})
    nominal = fitted(given, hopper())
    freed = {trial.added: trial for trial, kind in others(nominal, nominal) if kind == "freed_value"}
    assert freed[INERTIA,].model.value(INERTIA) == pytest.approx(true, rel=0.01)
    better = nominal.chi2 - freed[INERTIA,].chi2
    assert (better > 1000.0) if share < 1.0 else (better < 30.0)


def test_values_are_freed_beside_the_other_effects_as_well(monkeypatch, plain):
    model = plain.model.with_element(CATALOGUE["coulomb_friction"], {"force": 0.05})
    model = model.with_element(CATALOGUE["cubic_stiffness"], {"coefficient": 10.0})
    chosen = replace(plain, model=model)
    kept = [
        one.added
        for one in proposed(monkeypatch, plain, chosen, CATALOGUE, "coulomb_friction", "cubic_stiffness")
    ]
    for effect in ("coulomb_friction", "cubic_stiffness"):
        assert (effect, INERTIA) in kept
    assert ("coulomb_friction", "cubic_stiffness", INERTIA) not in kept  # each takes a place


@pytest.mark.parametrize(
    ("true", "named", "values", "place"),
    [
        ("sensor_lag", "actuator_lag", LAG, "sensor"),
        ("command_lag", "actuator_lag", LAG, "command"),
        ("delay_drift", "input_delay_drift", DRIFT, "timing"),
        ("input_delay_drift", "delay_drift", DRIFT, "command"),
    ],
)
def test_what_is_in_another_place_than_the_catalogue_has_it_fits_better_there(
    plain, true, named, values, place
):
    kin = {"command_lag", "actuator_lag", "sensor_lag", "delay_drift", "input_delay_drift", "clock_skew"}
    known = CATALOGUE.without(*(kin - {named}))
    machine = hopper().with_element(CATALOGUE[true], values)
    chosen = fitted(hopper().with_element(CATALOGUE[named], values), machine)
    found = {trial.added: trial for trial, kind in others(plain, chosen, known, named) if kind == "location"}
    assert found[f"{named}_of_the_{place}",].chi2 < chosen.chi2 - 100.0


def test_kin_of_the_chosen_effect_are_fitted_in_its_place(plain):
    machine = hopper().with_element(CATALOGUE["sensor_lag"], LAG)
    nominal = fitted(hopper(), machine)
    chosen = fitted(hopper().with_element(CATALOGUE["actuator_lag"], LAG), machine)
    made = others(nominal, chosen, CATALOGUE, "actuator_lag", rounds=rounds_of(nominal))
    kin = {trial.added: trial for trial, kind in made if kind == "effects"}
    assert set(kin) == {("sensor_lag",), ("command_lag",)}
    assert kin["sensor_lag",].chi2 < chosen.chi2 - 100.0
    assert kin["sensor_lag",].model.value("sensor_lag.time_constant") == pytest.approx(0.03, rel=0.05)


def test_kin_begin_where_the_family_has_ended(monkeypatch, plain):
    chosen = lagging(plain, "actuator_lag")
    kept = proposed(monkeypatch, plain, chosen, CATALOGUE, "actuator_lag", rounds=rounds_of(plain))
    kin = next(one for one in kept if one.added == ("sensor_lag",))
    assert any(guess.get("sensor_lag.time_constant") == LAG["time_constant"] for guess in kin.guesses)


def test_kin_begin_where_they_have_ended_alone_with_the_values_that_the_model_had_there(monkeypatch, plain):
    kept: list[Proposal] = []

    def run_trials(proposals, *_, **__):
        kept.extend(proposals)
        return [], []

    monkeypatch.setattr(module, "run_trials", run_trials)
    base = search_of(plain).best
    alone = search_of(lagging(plain, "sensor_lag"), "sensor_lag").best
    values = {"sensor_lag.time_constant": 0.07, "linear_spring.stiffness": 12.0}
    weighed = [base, replace(alone, model=alone.model.with_values(values))]
    series, known = list(plain.run.series), trajectories(plain)
    friction = plain.model.with_element(CATALOGUE["coulomb_friction"], {"force": 0.01})
    both = lagging(replace(plain, model=friction), "actuator_lag")
    chosen = replace(search_of(both, "coulomb_friction", "actuator_lag").best, differences=None)
    alternatives(base, chosen, series, CATALOGUE, NOISE, 1e-3, known, rounds_of(plain), weighed)
    (made,) = (one for one in kept if set(one.added) == {"coulomb_friction", "sensor_lag"})
    assert any(values.items() <= guess.items() for guess in made.guesses)


def test_a_law_that_needs_the_effect_whose_place_it_would_take_is_not_proposed(monkeypatch, plain):
    play = Score(CATALOGUE["freeplay"], {"gap": 1e-3}, 50.0, 1.0)
    assert play.element.family == CATALOGUE["linear_spring"].family
    known = [Round((play,), 0.0)]
    kept = proposed(monkeypatch, plain, plain, CATALOGUE, "linear_spring", rounds=known)
    assert not any("freeplay" in one.added for one in kept)


def test_no_two_alternatives_have_the_same_effects(monkeypatch, plain):
    chosen = lagging(plain, "actuator_lag", "sensor_lag")
    kept = proposed(
        monkeypatch, plain, chosen, CATALOGUE, "actuator_lag", "sensor_lag", rounds=rounds_of(plain)
    )
    keys = [tuple(sorted(one.added)) for one in kept]
    assert len(set(keys)) == len(keys) > 2


def test_places_for_which_the_catalogue_has_something_have_been_searched(monkeypatch, plain):
    chosen = lagging(plain, "actuator_lag")
    kept = proposed(monkeypatch, plain, chosen, CATALOGUE, "actuator_lag")
    assert not any("_of_the_" in label for one in kept for label in one.added)


def test_what_has_a_size_in_the_unit_of_its_signal_is_not_moved(monkeypatch, plain):
    chosen = replace(plain, model=plain.model.with_element(CATALOGUE["actuator_saturation"], {"limit": 0.8}))
    kept = proposed(
        monkeypatch, plain, chosen, CATALOGUE.without("command_saturation"), "actuator_saturation"
    )
    assert not any("_of_the_" in label for one in kept for label in one.added)


def near(model: Model) -> Model:
    """The model whose input's delay is held near nothing, as a nuisance is."""
    delay = model.parameters[INPUT_DELAY]
    return model.with_parameters({INPUT_DELAY: replace(delay, value=0.0, prior=Prior(0.0, 1e-3))})


def test_a_longer_delay_is_tried_free_of_its_prior_and_not_beyond_a_part_of_the_period(monkeypatch, plain):
    chosen = replace(plain, model=near(plain.model))
    kept = [one for one in proposed(monkeypatch, chosen, chosen) if one.added == (INPUT_DELAY,)]
    (one,) = kept
    delay = one.model.parameters[INPUT_DELAY]
    assert delay.prior is None
    assert delay.bounds[1] == LONGEST_DELAY / max(dominant_frequency(s) for s in plain.run.series)
    assert all(0.0 < guess[INPUT_DELAY] < delay.bounds[1] for guess in one.guesses)


def test_a_delay_that_is_free_already_is_no_hypothesis(monkeypatch, plain):
    assert not [one for one in proposed(monkeypatch, plain, plain) if one.added == (INPUT_DELAY,)]


def test_a_delay_of_many_samples_that_a_prior_held_near_none_is_found():
    late = fitted(near(hopper()), hopper(), delays=(0.03, 0.0))
    found = {trial.added: trial for trial, kind in others(late, late) if kind == "delay"}
    assert found[INPUT_DELAY,].model.value(INPUT_DELAY) == pytest.approx(0.03, abs=1e-3)


def test_one_free_law_stands_for_three_effects_of_the_same_quantity_only(monkeypatch, plain):
    model = plain.model.with_element(CATALOGUE["cubic_stiffness"], {"coefficient": 100.0})
    model = model.with_element(CATALOGUE["quintic_stiffness"], {"coefficient": 1e4})
    model = model.with_element(CATALOGUE["quadratic_stiffness"], {"coefficient": 10.0})
    model = model.with_element(CATALOGUE["coulomb_friction"], {"force": 0.05})
    chosen = replace(plain, model=model)
    labels = ("cubic_stiffness", "quintic_stiffness", "quadratic_stiffness", "coulomb_friction")
    kept = proposed(monkeypatch, plain, chosen, CATALOGUE, *labels)
    laws = [one.added for one in kept if any(label.startswith("free_") for label in one.added)]
    assert laws == [("coulomb_friction", "free_force_of_position")]
    two = replace(plain, model=model.without("quintic_stiffness"))
    left = ("cubic_stiffness", "quadratic_stiffness", "coulomb_friction")
    kept = proposed(monkeypatch, plain, two, CATALOGUE, *left)
    assert not any(label.startswith("free_") for one in kept for label in one.added)


def test_a_law_of_another_family_that_is_declared_confusable_is_fitted_in_the_place_of_the_chosen_one(
    monkeypatch, plain
):
    contact, spring = CATALOGUE["ground_contact_loss"], CATALOGUE["bilinear_stiffness"]
    assert contact.family != spring.family
    assert spring.name in contact.confusable or contact.name in spring.confusable
    model = plain.model.with_element(spring, {"change": -10.0, "kink": 0.2})
    round_of_both = (Round((Score(contact, {"loss": 0.5}, 50.0, 1.0),), 0.0),)
    kept = proposed(
        monkeypatch, plain, replace(plain, model=model), CATALOGUE, spring.name, rounds=round_of_both
    )
    assert (contact.name,) in [one.added for one in kept]
