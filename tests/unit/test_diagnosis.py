"""Diagnosis on short records: names what is missing, keeps quiet when nothing is, and says so in the contract's words."""

import json
from dataclasses import replace

import numpy as np
import pytest
from axes import axis, axis_model
from json_schema import conforming

from machines import CATALOGUE, SHORT, hopper, only, records
from rhythmid.deadline import SPENT
from rhythmid.diagnose.case import Untried
from rhythmid.diagnose.constants import LEFT, PRACTICAL
from rhythmid.diagnose.diagnosis import BY_MOTION, Answer, diagnose, with_unit_warning
from rhythmid.diagnose.rejections import RULES
from rhythmid.diagnose.replay import redecide
from rhythmid.errors import InputError
from rhythmid.model import Model
from rhythmid.proof.noise import coloured
from rhythmid.record.record import Channel, Record

FRICTION = {"force": 0.02, "transition": 0.002}
FEW = ("coulomb_friction", "stribeck_friction", "cubic_stiffness", "actuator_lag", "periodic_disturbance")
SMALL = only(*FEW)


@pytest.fixture(scope="module")
def friction() -> Answer:
    """Friction missing from a model whose values are off, too."""
    machine = hopper().with_element(CATALOGUE["coulomb_friction"], FRICTION)
    wrong = hopper().with_values({"linear_spring.stiffness": 230.0, "switched_damper.stance": 1.5})
    return diagnose(records(machine, seed=3), wrong, catalogue=SMALL)


def test_hidden_friction_is_named_located_and_measured(friction):
    result = friction.diagnosis
    assert result.verdict == "missing_physics"
    assert [effect.element for effect in result.missing] == ["coulomb_friction"]
    assert result.location.slot == "force"
    assert result.missing[0].probability >= 0.8 and result.missing[0].share > 0.8
    force = result.missing[0].parameters["force"]
    assert abs(force.value - FRICTION["force"]) < 4 * force.std


def test_the_augmented_model_is_better_on_what_it_has_not_seen(friction):
    fit = friction.diagnosis
    assert fit.augmented.heldout_nrmse < 0.8 * fit.refitted_nominal.heldout_nrmse
    assert fit.augmented.train_nrmse < 1.05 * fit.detection.noise_floor_nrmse


def test_a_channel_seems_to_be_in_another_unit_only_where_the_values_stay_shifted(friction):
    def notes(stiffness: float, stance: float) -> tuple[str, ...]:
        given = hopper().with_values({"linear_spring.stiffness": stiffness, "switched_damper.stance": stance})
        return with_unit_warning(friction, given, "another unit").diagnosis.notes

    assert "another unit" not in notes(230.0, 1.5)
    assert "another unit" in notes(230.0 / 1000.0, 1.5 / 1000.0)


def test_delays_and_nominal_parameters_are_right_once_the_effect_is_modelled(friction):
    values = friction.diagnosis.parameters
    assert values["linear_spring.stiffness"].value == pytest.approx(200.0, abs=0.1)
    assert values["input_delay.delay"].value == pytest.approx(0.0203, abs=2e-4)
    assert any("linear_spring.stiffness" in line for line in friction.diagnosis.calibration)


def test_a_parameter_has_one_standard_deviation_wherever_it_is_told(friction):
    joint, told = friction.covariance, friction.diagnosis.parameters
    for name, std in zip(joint.names, joint.std):
        assert told[name].std == pytest.approx(std), name
    assert friction.diagnosis.delays["sum"]["std"] <= 1.001 * (
        told["input_delay.delay"].std + told["measurement_delay.delay"].std
    )


def test_the_result_keeps_to_the_schema(friction):
    conforming(friction.diagnosis)


def test_every_hypothesis_is_listed_the_best_first_with_its_difference_and_probability(friction):
    listed = friction.diagnosis.hypotheses
    assert {one.kind for one in listed} >= {"nominal", "effects", "freed_value"}
    assert listed[0].score_difference == 0.0
    assert all(one.score <= listed[0].score and one.score_difference >= 0.0 for one in listed)
    assert sum(one.probability for one in listed) == pytest.approx(1.0)


def test_every_rejection_is_a_row_of_the_table(friction):
    told = friction.diagnosis.rejections
    assert told and {row.name for row in told} <= {rule.name for rule in RULES}
    assert all(not row.statistic >= row.threshold for row in told)


def test_the_evidence_that_is_kept_gives_the_same_answer_again(friction):
    kept = json.loads(json.dumps(friction.ledger(), allow_nan=False))
    assert kept["practical"] == PRACTICAL and len(kept["hypotheses"]) == len(friction.diagnosis.hypotheses)
    answer = friction.diagnosis.to_dict()
    anew = redecide(answer | {"evidence": kept})
    assert anew["verdict"] == answer["verdict"]
    assert [one["element"] for one in anew["missing"]] == ["coulomb_friction"]
    assert anew["missing"][0]["parameters"] == answer["missing"][0]["parameters"]


@pytest.mark.parametrize("correlation", [0.0, 0.8])
def test_nothing_is_found_where_nothing_is_missing(correlation):
    wrong = hopper().with_values({"linear_spring.stiffness": 150.0, "switched_damper.stance": 3.0})
    given = records(hopper(), SHORT[:2], seed=5, correlation=correlation)
    result = conforming(diagnose(given, wrong, catalogue=CATALOGUE).diagnosis)
    assert (result.verdict, result.missing) == ("consistent", ())
    assert not result.remainder.significant or result.remainder.share < 1.0


def test_a_budget_that_is_spent_ends_the_search_and_the_answer_is_one_all_the_same():
    machine = hopper().with_element(CATALOGUE["coulomb_friction"], FRICTION)
    result = conforming(
        diagnose(records(machine, SHORT[:2]), hopper(), catalogue=SMALL, budget=0.0).diagnosis
    )
    assert result.verdict != "missing_physics"
    assert "coulomb_friction" in {one.name for one in result.excluded if one.reason == SPENT}


def test_no_other_way_to_score_begins_once_the_budget_is_spent_and_the_answer_says_so():
    told: list[str] = []
    answer = diagnose([axis()], axis_model(), catalogue=SMALL, tell=told.append, budget=0.0)
    found = conforming(answer.diagnosis)
    assert found.scoring.kind == "effort" and found.refitted_nominal.train_nrmse > LEFT
    assert not any("windows" in one for one in told)
    assert Untried(BY_MOTION, SPENT) in found.excluded


def test_without_an_answer_in_hand_a_spent_budget_still_leads_to_one():
    unknown = replace(axis(), input=None)  # no effort: the motion is all that can be scored
    held = axis_model().with_element(CATALOGUE["linear_spring"], {"stiffness": 400.0, "rest_length": 0.0})
    found = diagnose([unknown], held, catalogue=SMALL, budget=0.0).diagnosis
    assert found.scoring.kind in ("free_run", "windows")


def test_all_parameters_fixed_is_refused_with_the_mend():
    model = hopper()
    fixed = model.with_parameters({n: replace(v, fixed=True) for n, v in model.parameters.items()})
    with pytest.raises(InputError, match="fixed"):
        diagnose(records(hopper())[:1], fixed, catalogue=CATALOGUE)


@pytest.mark.long
def test_a_drift_beside_a_strong_effect_does_not_pass_for_the_colour_of_the_noise():
    damped = hopper().with_element(CATALOGUE["flight_damping"], {"damping": 5.0})
    machine = damped.with_element(CATALOGUE["sensor_drift"], {"rate": 1e-4})
    found = conforming(diagnose(records(machine), hopper(), catalogue=CATALOGUE).diagnosis)
    assert found.verdict == "missing_physics"
    assert {effect.element for effect in found.missing} == {"flight_damping", "sensor_drift"}
    drift = next(effect for effect in found.missing if effect.element == "sensor_drift").parameters["rate"]
    assert drift.std is not None and abs(drift.value - 1e-4) < 4.0 * drift.std < 5e-5


@pytest.mark.parametrize(("shaken", "verdict"), [(0.0, "consistent"), (6.0, "undecided")])
def test_what_shakes_a_machine_unrecorded_is_no_noise_where_windows_are_scored_either(shaken, verdict):
    """A force that nobody recorded makes errors of the windows that follow from their own past, although free starts take up most."""
    text = """
units: {force: "m/s^2", position: m, mass: "1"}
inertia: {mass: {value: 1, unit: "1", fixed: true}}
force:
  - linear_spring: {stiffness: {value: 9.0, unit: "1/s^2"}}
  - viscous_damper: {damping: {value: 0.02, unit: "1/s"}}
"""
    model, rng = Model.from_text(text, catalogue=CATALOGUE), np.random.default_rng(5)
    time, step = np.arange(0.0, 30.0, 0.02), 0.02
    force = shaken * coloured(rng.standard_normal(len(time)), 0.9)
    value, x, v = np.empty(len(time)), 0.5, 0.0
    for k, pushed in enumerate(force):
        value[k] = x
        v += step * (pushed - 9.0 * x - 0.02 * v)
        x += step * v
    value += 0.003 * rng.standard_normal(len(time))
    answer = diagnose([Record("ball", Channel(time, value, "m"))], model, catalogue=only("coulomb_friction"))
    assert answer.diagnosis.verdict == verdict
