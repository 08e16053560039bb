"""Efforts that are computed from references: delays of these, of each joint and shared, and what the command path lacks."""

from dataclasses import replace

import numpy as np
import pytest
from legged import MODELS, fixed_leg, recorded, references

from rhythmid.body.machine import Machine
from rhythmid.diagnose.joints.joint_diagnosis import diagnose_machine
from rhythmid.elements.catalogue import load_catalogue
from rhythmid.identify.inverse_dynamics.estimate import ROUGH
from rhythmid.identify.joints.joint_motion import JointBalances
from rhythmid.identify.joints.reference_delay import Delay, fit_with_delay, reference_delay, shared
from rhythmid.record.joint_record import JointRecord

TIME = np.arange(0.0, 6.0, 0.002)
SAMPLE = 0.002  # s
FRICTION = 10.0  # N*m, as large as the efforts that move the wrist


def asked_of(machine: Machine, hold: str = "zero", delays: dict[str, float] | None = None) -> JointRecord:
    """A record of references and positions alone, the references of these joints late by these delays [s]."""
    rng = np.random.default_rng(3)
    plant = machine.with_values(
        {f"{joint}.input_delay.delay": late for joint, late in (delays or {}).items()}
    )
    middles = {joint: (-1.2 if joint == "knee" else 0.3, 0.3) for joint in machine.joints}
    asked = references(middles, TIME, rng, (0.4, 3.0))
    made = recorded(plant, asked, TIME, rng, jitter=0.0, lost=0.0, with_effort=False, held=hold == "zero")
    return replace(made, joints={name: replace(one, hold=hold) for name, one in made.joints.items()})


def found_in(machine: Machine, record: JointRecord):
    balances = JointBalances.of(machine, [record])
    return reference_delay(balances, balances.computed)


@pytest.mark.parametrize("hold", ["zero", "linear"])
def test_held_references_and_controllers_steps_are_allowed_for(tmp_path, hold):
    machine = Machine.load(fixed_leg(tmp_path))
    found = found_in(machine, asked_of(machine, hold))
    assert found.shared.value == pytest.approx(0.0, abs=0.05 * SAMPLE)
    assert found.equal and found.agree == ("hip", "knee")


def test_joints_of_one_bus_share_a_delay_and_an_interval_holds_it():
    machine = Machine.load(MODELS / "arm.yaml")
    found = found_in(machine, asked_of(machine, delays=dict.fromkeys(machine.joints, 0.0063)))
    low, high = found.shared.interval
    assert low < 0.0063 < high and found.shared.std < 0.1 * SAMPLE
    assert found.equal and found.chance is not None and "at all joints alike" in found.told


def test_a_joint_with_another_delay_is_told_from_the_shared_one():
    machine = Machine.load(MODELS / "arm.yaml")
    late = dict.fromkeys(machine.joints, 0.004) | {"joint3": 0.0125}
    found = found_in(machine, asked_of(machine, delays=late))
    assert not found.equal and "joint3" not in found.agree and len(found.agree) == len(machine.joints) - 1
    assert found.shared.value == pytest.approx(0.004, abs=0.1 * SAMPLE)
    low, high = found.joints["joint3"].interval
    assert low < 0.0125 < high


def test_of_two_joints_that_differ_the_earlier_one_has_the_shared_delay():
    found = shared({"hip": Delay(0.009, 1e-5), "knee": Delay(0.001, 1e-4)}, SAMPLE)
    assert found.agree == ("knee",) and not found.equal


@pytest.mark.parametrize(("apart", "equal"), [(0.4, True), (3.0, False)])
def test_a_missing_effect_may_shift_the_delay_of_joints_that_share_one_by_a_part_of_a_sample(
    apart: float, equal: bool
):
    delays = {
        f"joint{n}": Delay(0.004 + shift * apart * SAMPLE, 1e-5) for n, shift in enumerate((-1, 0, 1, 0))
    }
    assert shared(delays, SAMPLE).equal is equal


def test_joints_that_share_a_delay_have_it_and_its_uncertainty_in_their_fits():
    machine = Machine.load(MODELS / "arm.yaml")
    plant = machine.with_element(
        "joint3", load_catalogue()["coulomb_friction"], {"force": FRICTION, "transition": 0.02}
    )
    record = asked_of(plant, delays=dict.fromkeys(machine.joints, 0.0063))
    balances = JointBalances.of(machine, [record])
    common = reference_delay(balances, balances.computed)
    assert common.equal
    for joint in machine.joints:
        fit = fit_with_delay(
            balances.balance(joint, common.shared.value), balances.models[joint], joint, common
        )
        assert abs(fit.alignment) < 3.0 * ROUGH * SAMPLE
        assert 0.0 < fit.std[0] <= common.shared.std


def test_a_reference_that_is_late_at_one_joint_is_named_there_as_a_delay_of_its_command(tmp_path):
    machine = Machine.load(fixed_leg(tmp_path))
    found = diagnose_machine([asked_of(machine, delays={"knee": 0.012})], machine)
    (one,) = found.diagnosis.missing
    assert (one.joint, one.element, one.slot) == ("knee", "input_delay", "command")
    assert one.parameters["delay"].value == pytest.approx(0.012, abs=0.2 * SAMPLE)
    assert found.machine.value("knee.input_delay.delay") == pytest.approx(0.012, abs=0.2 * SAMPLE)
    assert found.machine.value("hip.input_delay.delay") == pytest.approx(0.0, abs=0.2 * SAMPLE)
    assert found.diagnosis.to_dict()["reference_delay"]["agree"] == ["hip"]


def test_a_lag_of_a_joints_command_is_named_in_the_command_path(tmp_path):
    machine = Machine.load(fixed_leg(tmp_path))
    plant = machine.with_element("knee", load_catalogue()["command_lag"], {"time_constant": 0.03})
    (one,) = diagnose_machine([asked_of(plant)], machine).diagnosis.missing
    assert (one.joint, one.element, one.slot) == ("knee", "command_lag", "command")
    assert one.parameters["time_constant"].value == pytest.approx(0.03, rel=0.05)


def test_a_friction_that_the_paths_lack_is_not_taken_for_a_late_reference():
    plant = machine = Machine.load(MODELS / "arm.yaml")
    dry = load_catalogue()["coulomb_friction"]
    for joint in machine.joints:
        plant = plant.with_element(joint, dry, {"force": FRICTION, "transition": 0.02})
    found = found_in(machine, asked_of(plant))
    assert max(abs(one.value) for one in found.joints.values()) < 2.0 * SAMPLE
