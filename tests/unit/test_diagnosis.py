"""Diagnosis on short records: names what is missing, keeps quiet when nothing is, and says so in the contract's words."""

import json

import pytest

from json_schema import violations
from machines import CATALOGUE, hopper, records
from rhythmid.diagnose.answer.result import schema
from rhythmid.diagnose.diagnosis import diagnose
from rhythmid.errors import InputError

FRICTION = {"force": 0.02, "transition": 0.002}


@pytest.fixture(scope="module")
def friction():
    machine = hopper().with_element(CATALOGUE["coulomb_friction"], FRICTION)
    wrong = hopper().with_values({"linear_spring.stiffness": 230.0, "switched_damper.stance": 1.5})
    return diagnose(records(machine, seed=3), wrong, catalogue=CATALOGUE)


def test_hidden_friction_is_named_located_and_measured(friction):
    result = friction.diagnosis
    assert result.verdict == "missing_physics"
    assert [effect.element for effect in result.missing] == ["coulomb_friction"]
    assert result.location.slot == "force"
    force = result.missing[0].parameters["force"]
    assert abs(force.value - FRICTION["force"]) < 4 * force.std


def test_the_augmented_model_is_better_on_what_it_has_not_seen(friction):
    fit = friction.diagnosis
    assert fit.augmented.heldout_nrmse < 0.8 * fit.refitted_nominal.heldout_nrmse
    assert fit.augmented.train_nrmse < 1.05 * fit.detection.noise_floor_nrmse


def test_delays_and_nominal_parameters_are_right_once_the_effect_is_modelled(friction):
    values = friction.diagnosis.parameters
    assert values["linear_spring.stiffness"].value == pytest.approx(200.0, abs=0.1)
    assert values["input_delay.delay"].value == pytest.approx(0.0203, abs=2e-4)
    assert any("linear_spring.stiffness" in line for line in friction.diagnosis.calibration)


def test_the_result_is_plain_json_with_the_contract_s_keys(friction):
    content = json.loads(json.dumps(friction.diagnosis.to_dict()))
    assert {"verdict", "detection", "location", "missing", "indistinguishable", "alternatives", "fit", "parameters",
            "delays", "next_experiment"} <= set(content)  # fmt: skip
    assert set(content["fit"]) == {"refitted_nominal", "augmented"}
    assert set(content["detection"]) == {
        "p_value", "nominal_nrmse", "refitted_nominal_nrmse", "noise_floor_nrmse",
    }  # fmt: skip


def test_the_result_keeps_to_the_schema(friction):
    assert violations(friction.diagnosis.to_dict(), schema(), schema()) == []


@pytest.mark.parametrize("correlation", [0.0, 0.8])
def test_nothing_is_found_where_nothing_is_missing(correlation):
    wrong = hopper().with_values({"linear_spring.stiffness": 150.0, "switched_damper.stance": 3.0})
    result = diagnose(
        records(hopper(), seed=5, correlation=correlation), wrong, catalogue=CATALOGUE
    ).diagnosis
    assert result.verdict == "consistent"
    assert result.missing == ()


def test_all_parameters_fixed_is_refused_with_the_mend():
    from dataclasses import replace

    model = hopper()
    fixed = model.with_parameters({n: replace(v, fixed=True) for n, v in model.parameters.items()})
    with pytest.raises(InputError, match="fixed"):
        diagnose(records(hopper())[:1], fixed, catalogue=CATALOGUE)


def test_a_drift_beside_a_strong_effect_does_not_pass_for_the_colour_of_the_noise():
    damped = hopper().with_element(CATALOGUE["flight_damping"], {"damping": 5.0})
    machine = damped.with_element(CATALOGUE["sensor_drift"], {"rate": 2e-5})
    found = diagnose(records(machine), hopper()).diagnosis
    assert found.verdict == "missing_physics"
    assert {effect.element for effect in found.missing} == {"flight_damping", "sensor_drift"}
    drift = next(effect for effect in found.missing if effect.element == "sensor_drift").parameters["rate"]
    assert drift.std is not None and abs(drift.value - 2e-5) < 4.0 * drift.std < 1e-5
