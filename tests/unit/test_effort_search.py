"""The search by the recorded effort: what it names, what it leaves alone, and what it cannot be deceived by."""

import math
from dataclasses import replace

import numpy as np
import pytest
from axes import CATALOGUE, arm_model, axis, axis_model, frame, frame_model

from rhythmid.diagnose.constants import PRACTICAL_EFFORT
from rhythmid.diagnose.diagnosis import diagnose
from rhythmid.diagnose.effort import search as module
from rhythmid.diagnose.effort.fitted import Fitted
from rhythmid.diagnose.effort.kin import contained
from rhythmid.diagnose.effort.reference import Mapped, reference_of, residual_with_map
from rhythmid.diagnose.effort.remainder import remainder_of
from rhythmid.diagnose.effort.run import small_effects
from rhythmid.diagnose.effort.search import EffortSearch, search_effort
from rhythmid.diagnose.evidence import predict
from rhythmid.diagnose.rejections import RULES, SHAPES, Claim, Rejection, rejections_of
from rhythmid.identify.inverse_dynamics.balance import Balance
from rhythmid.identify.inverse_dynamics.estimate import variation_of
from rhythmid.model import Model

KEPT = ("coulomb_friction", "quadratic_drag", "cubic_stiffness")
FEW = CATALOGUE.without(*(name for name in CATALOGUE if name not in (*KEPT, "viscous_damper")))


def errors_of(found: EffortSearch, *hypotheses: Fitted) -> list[float]:
    """Mean squared errors with which these, and last a free map beside the nominal model, predict what their fits did not see."""
    fits = [*(one.linearised for one in hypotheses), reference(found).linearised]
    return [one.mean_square for one in predict(fits, found.blocks, found.balance.record)]


def reference(found: EffortSearch) -> Mapped:
    """The nominal model with free curves over the motion."""
    return reference_of(found.balance, found.nominal, found.blocks)


def left_of(balance: Balance, fitted: Fitted) -> np.ndarray:
    """Predicted less recorded effort (n,)."""
    return balance.predicted(fitted.fit.model, fitted.fit.alignment) - balance.measured


@pytest.fixture(scope="module")
def friction() -> EffortSearch:
    return search_effort([axis()], axis_model(), CATALOGUE)


def test_coulomb_friction_of_an_axis_is_named_alone(friction):
    assert friction.chosen.elements == ("coulomb_friction",)
    model = friction.chosen.model
    assert model.value("coulomb_friction.force") == pytest.approx(0.8, abs=0.03)
    assert model.value("inertia.mass") == pytest.approx(1.0, abs=0.01)


def test_a_hysteresis_that_hardly_yields_within_the_travel_is_not_named_in_the_place_of_a_spring():
    only = CATALOGUE.without(*(name for name in CATALOGUE if name != "elastoplastic_hysteresis"))
    found = search_effort([axis(friction=0.0, gravity=20.0, amplitude=0.5)], axis_model(), only)
    assert "elastoplastic_hysteresis" not in found.chosen.elements
    (out,) = [one for one in found.ruled_out if one.elements == ("elastoplastic_hysteresis",)]
    assert out.shape["within_bounds"] < SHAPES["within_bounds"]
    both = CATALOGUE.without(
        *(name for name in CATALOGUE if name not in ("elastoplastic_hysteresis", "linear_spring"))
    )
    spring = search_effort([axis(friction=0.0, gravity=20.0, amplitude=0.5)], axis_model(), both)
    assert spring.chosen.elements == ("linear_spring",)


def test_a_gap_is_named_beside_the_spring_whose_gap_it_is_where_the_nominal_model_has_neither():
    record = axis(friction=0.0, length=12.0)
    position = np.interp(record.input.time, record.output.time, record.output.value)
    effort = record.input.value + 60.0 * (position - np.clip(position, -0.1, 0.1))
    record = replace(record, input=replace(record.input, value=effort))
    only = CATALOGUE.without(*(name for name in CATALOGUE if name not in ("linear_spring", "freeplay")))
    found = search_effort([record], axis_model(), only, most=2)
    assert found.chosen.elements == ("linear_spring", "freeplay")
    assert found.chosen.model.value("linear_spring.stiffness") == pytest.approx(60.0, rel=0.02)
    assert found.chosen.model.value("freeplay.gap") == pytest.approx(0.2, rel=0.02)


def test_a_weight_beside_friction_is_no_friction_that_acts_in_one_direction_only():
    record = axis(friction=0.3)
    assert record.input is not None
    loaded = replace(record, input=replace(record.input, value=record.input.value + 2.0))
    three = ("asymmetric_coulomb_friction", "coulomb_friction", "constant_force")
    only = CATALOGUE.without(*(name for name in CATALOGUE if name not in three))
    found = search_effort([loaded], axis_model(), only)
    assert set(found.chosen.elements) == {"coulomb_friction", "constant_force"}
    (out,) = [one for one in found.ruled_out if one.elements == ("asymmetric_coulomb_friction",)]
    assert out.shape["within_bounds"] < SHAPES["within_bounds"]
    assert found.chosen.model.value("constant_force.force") == pytest.approx(-2.0, abs=0.05)


def test_a_name_predicts_no_worse_than_unknown_physics(friction):
    chosen, nominal, unknown = errors_of(friction, friction.chosen, friction.nominal)
    assert chosen < 1.1 * unknown and nominal > 10.0 * unknown


def test_a_law_that_the_catalogue_lacks_widens_the_standard_deviations_of_what_takes_it_up(friction):
    nothing = CATALOGUE.without(*CATALOGUE)
    place = 1 + friction.nominal.fit.names.index("viscous_damper.damping")  # the alignment is first
    lacking, whole = (
        small_effects(friction.balance, one, nothing)[place] / one.fit.std[place]
        for one in (friction.nominal, friction.chosen)
    )
    assert lacking > 3.0 and whole < 0.5


def test_what_is_left_by_the_nominal_model_goes_with_the_speed(friction):
    before = remainder_of(friction.balance, friction.nominal)
    after = remainder_of(friction.balance, friction.chosen)
    assert before[0].quantity == "velocity" and before[0].share > 0.5
    assert np.std(friction.chosen.fit.residual) < 0.3 * np.std(friction.nominal.fit.residual)
    assert after[0].share < 0.1


def test_all_hypotheses_predict_the_same_rows(friction):
    count = len(friction.balance.measured)
    assert all(len(one.linearised.residual) == count for one in friction.hypotheses)
    assert len(reference(friction).linearised.residual) == count


def test_of_laws_of_which_one_contains_the_other_one_stands_alone(friction):
    for one in friction.hypotheses:
        elements = [term.element for label in one.elements if (term := one.fit.model.term(label)) is not None]
        assert not any(contained(a, b) for i, a in enumerate(elements) for b in elements[i + 1 :])


def test_a_friction_that_grows_with_the_load_is_found_beside_one_that_does_not():
    record = axis(gravity=4.0, amplitude=4.0, load=0.3, length=10.0)
    weight = "force: [{pendulum_gravity: {moment: {value: 3.0, unit: N*m}}}, "
    model = Model.from_text(
        "inertia: {mass: {value: 1.3, unit: kg*m^2}}\n"
        + weight
        + "{viscous_damper: {damping: {value: 3.0, unit: N*m*s/rad}}}]\n",
        catalogue=CATALOGUE,
    )
    found = search_effort([record], model, CATALOGUE)
    assert set(found.chosen.elements) == {"coulomb_friction", "load_dependent_friction"}
    assert found.chosen.model.value("load_dependent_friction.coefficient") == pytest.approx(0.3, abs=0.05)


def test_what_the_effort_cannot_show_is_told(friction):
    assert "sensor" in friction.not_tried["sensor_lag"] and "timing" in friction.not_tried["clock_skew"]
    assert "angle" in friction.not_tried["pendulum_gravity"]
    assert "coulomb_friction" not in friction.not_tried


@pytest.mark.parametrize("seeds", [range(3), pytest.param(range(3, 8), marks=pytest.mark.long)])
def test_nothing_is_found_where_nothing_is_missing(seeds):
    found = [
        search_effort(
            [axis(seed, friction=0.0, jitter=0.3, length=10.0)], axis_model(), CATALOGUE
        ).chosen.elements
        for seed in seeds
    ]
    assert found == [()] * len(seeds)


def test_gravity_and_effort_do_not_extinguish_each_other():
    found = search_effort([axis(gravity=4.0, amplitude=4.0, length=10.0)], arm_model(), CATALOGUE)
    assert set(found.chosen.elements) == {"pendulum_gravity", "coulomb_friction"}
    assert found.chosen.model.value("pendulum_gravity.moment") == pytest.approx(4.0, rel=0.03)
    predicted = found.balance.predicted(found.chosen.fit.model, found.chosen.fit.alignment)
    assert np.std(predicted) > 0.9 * np.std(found.balance.measured)


def test_no_model_sees_the_effort_that_it_predicts():
    record = axis()
    assert record.input is not None
    another = replace(record, input=replace(record.input, value=record.input.value[::-1]))
    balance = Balance.of([record], axis_model())
    other = Balance.of([another], axis_model(), balance.bandwidth)
    for name, values in (
        ("load_dependent_friction", {"coefficient": 0.1, "transition": 0.02}),
        ("actuator_deadband", {"threshold": 0.1}),
        ("actuator_lag", {"time_constant": 0.01}),
    ):
        model = axis_model().with_element(CATALOGUE[name], values)
        assert np.array_equal(balance.predicted(model), other.predicted(model))


def test_a_delay_beyond_two_samples_is_a_hypothesis_of_its_own():
    record = axis(friction=0.0)
    assert record.input is not None
    late = replace(record, input=replace(record.input, time=record.input.time - 0.06))
    found = search_effort([late], axis_model(), CATALOGUE)
    assert found.chosen.elements == ("input_delay.delay",) and found.chosen.kind == "delay"
    assert found.chosen.fit.alignment == pytest.approx(0.06, abs=0.004)


def test_a_value_that_is_held_wrongly_is_a_hypothesis():
    model = axis_model(mass="{value: 1.3, unit: kg, fixed: true}")
    found = search_effort([axis(friction=0.0)], model, CATALOGUE)
    freed = [one for one in found.hypotheses if one.elements == ("inertia.mass",)]
    assert [one.kind for one in freed] == ["freed_value"]
    assert freed[0].model.value("inertia.mass") == pytest.approx(1.0, abs=0.01)
    chosen, free, _ = errors_of(found, found.chosen, freed[0])
    assert free <= 1.1 * chosen


def test_dry_friction_of_a_frame_on_a_moving_base_is_named():
    found = search_effort([frame(friction=0.6)], frame_model(), CATALOGUE)
    assert found.chosen.elements == ("coulomb_friction",)
    assert found.chosen.model.value("coulomb_friction.force") == pytest.approx(0.6, rel=0.05)
    assert found.chosen.model.value("linear_spring.stiffness") == pytest.approx(150.0, rel=0.01)


def test_a_law_that_the_catalogue_lacks_is_predicted_by_the_map():
    short = CATALOGUE.without(*(name for name, one in CATALOGUE.items() if one.family == "friction"))
    found = search_effort([axis(length=10.0)], axis_model(), short)
    best, unknown = np.sqrt(errors_of(found, found.chosen))
    assert best > 2.0 * unknown and unknown < 0.03 * variation_of(found.balance)


def test_effort_of_a_record_that_no_fit_has_seen_is_predicted(friction):
    unseen = Balance.of([axis(7, amplitude=0.5)], axis_model(), friction.balance.bandwidth)
    chosen, nominal = (np.std(left_of(unseen, one)) for one in (friction.chosen, friction.nominal))
    assert chosen < 0.06 * variation_of(unseen)  # the noise is a twentieth of the effort
    assert nominal > 2.0 * chosen


def test_a_free_map_predicts_held_out_records_as_it_predicts_its_own(friction):
    found = friction
    seen = found.balance
    free = reference(found)
    again = residual_with_map(seen, found.nominal, free)
    np.testing.assert_allclose(again, free.linearised.residual, atol=0.05 * variation_of(seen))
    unseen = Balance.of([axis(7)], axis_model(), seen.bandwidth)
    mapped = residual_with_map(unseen, found.nominal, free)
    plain = left_of(unseen, found.nominal)
    assert np.sqrt(np.mean(mapped**2)) < 0.5 * np.sqrt(np.mean(plain**2))


def searched(monkeypatch: pytest.MonkeyPatch, rules: tuple) -> tuple[EffortSearch, list[Claim]]:
    """A search for friction among three effects by these rules, and what was claimed in it."""
    claims: list[Claim] = []

    def rejecting(claim: Claim) -> list[Rejection]:
        claims.append(claim)
        return rejections_of(claim, rules)

    monkeypatch.setattr(module, "rejections_of", rejecting)
    return search_effort([axis(length=10.0)], axis_model(), FEW, most=2), claims


@pytest.mark.parametrize("rule", RULES, ids=lambda rule: rule.name)
def test_any_row_of_the_table_ends_the_search(monkeypatch, rule):
    unmet = replace(rule, threshold=lambda _: math.nan)
    found, claims = searched(monkeypatch, (unmet,))
    assert found.chosen.elements == () and len(claims) == 1
    assert all(len(one.elements) <= 1 for one in found.hypotheses)


def test_a_search_that_no_row_ends_goes_on_to_the_last_place(monkeypatch):
    found, claims = searched(monkeypatch, ())
    assert len(found.chosen.elements) == 2 and len(claims) == 2


def test_a_further_effect_has_to_be_better_than_what_it_is_put_to_by_the_measures_of_the_effort(monkeypatch):
    found, (first, second) = searched(monkeypatch, ())
    assert first.hypothesis.elements == ("coulomb_friction",) and second.without.elements == (
        "coulomb_friction",
    )
    for claim in (first, second):
        assert claim.nominal.elements == () and claim.nominal.kind == "nominal"
        assert claim.size == variation_of(found.balance) and claim.practical == PRACTICAL_EFFORT
    assert (first.candidates, second.candidates) == (found.candidates, found.candidates - 1)
    assert first.without.elements == () and first.without.prediction.mean_square > 2.0 * first.floor > 0.0


@pytest.mark.parametrize(("friction", "named"), [(0.004, ()), (0.06, ("coulomb_friction",))])
def test_friction_of_a_share_of_the_effort_that_matters_is_named_and_of_less_is_not(friction, named):
    answer = diagnose(
        [axis(friction=friction, noise=0.002, length=10.0)], axis_model(), catalogue=FEW
    ).diagnosis
    assert tuple(effect.element for effect in answer.missing) == named
    assert answer.verdict == ("missing_physics" if named else "consistent")
    if not named:
        assert "practical_size" in {row.name for row in answer.rejections}


def test_friction_that_matters_for_the_motion_is_named_whatever_weight_the_effort_holds():
    light = axis(friction=0.06, noise=0.002, length=10.0)
    assert light.input is not None
    heavy = replace(light, input=replace(light.input, value=light.input.value + 100.0))
    model = axis_model().with_element(CATALOGUE["constant_force"], {"force": -100.0})
    answer = diagnose([heavy], model, catalogue=FEW).diagnosis
    assert [effect.element for effect in answer.missing] == ["coulomb_friction"]
    assert answer.augmented.train_nrmse > 1e-3  # of what varies, not of the weight


@pytest.mark.parametrize(("least", "named"), [(0.5, True), (0.9, False)])
def test_an_actuators_effect_that_takes_more_of_the_effort_than_it_may_is_kept_and_rejected(
    monkeypatch, least, named
):
    assert SHAPES["moves_the_machine"] == 0.5
    monkeypatch.setitem(SHAPES, "moves_the_machine", least)
    one = ("actuator_deadband",)  # which has to take a fourth of the effort for dry friction
    only = CATALOGUE.without(*(name for name in CATALOGUE if name not in (*one, "viscous_damper")))
    found = diagnose([axis(friction=3.0, amplitude=0.2, length=10.0)], axis_model(), catalogue=only).diagnosis
    rejected = {row.hypothesis for row in found.rejections if row.name == "moves_the_machine"}
    assert rejected == (set() if named else {one})
    assert one in {hypothesis.elements for hypothesis in found.hypotheses}
    assert (one[0] in {effect.element for effect in found.missing}) is named
