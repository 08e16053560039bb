"""A gear that yields behind a motor's encoder is one cause of all joints, found from the efforts of the other joints together."""

from pathlib import Path

import numpy as np
import pytest
from legged import TWO_LINKS, multisine
from scipy.interpolate import CubicSpline

from rhythmid.body.machine import Machine
from rhythmid.diagnose.joints.gear_compliance import GearCompliance
from rhythmid.diagnose.joints.joint_diagnosis import MachineAnswer, diagnose_machine
from rhythmid.elements.catalogue import Catalogue, load_catalogue
from rhythmid.identify.inverse_dynamics.estimate import fit_effort, variation_of
from rhythmid.identify.joints.elastic_gear import ElasticGear
from rhythmid.identify.joints.joint_motion import JointBalances
from rhythmid.record.joint_record import JointRecord
from rhythmid.record.record import Channel, Record

LAWS = ("viscous_damper", "coulomb_friction", "linear_spring")
STIFFNESS, ROTOR, DAMPING = 250.0, 0.05, 0.4


@pytest.fixture(scope="module")
def arm(tmp_path_factory: pytest.TempPathFactory) -> Machine:
    folder: Path = tmp_path_factory.mktemp("arm")
    (folder / "two.urdf").write_text(TWO_LINKS)
    path = f"{{force: [{{viscous_damper: {{damping: {DAMPING}}}}}]}}"
    (folder / "two.yaml").write_text(
        f"body: {{urdf: two.urdf, contacts: false}}\njoints:\n  one: {path}\n  two: {path}\n"
    )
    return Machine.load(folder / "two.yaml").with_inertial({"one.armature": ROTOR, "two.armature": ROTOR})


def recorded(arm: Machine, stiffness: float, lag: float = 0.0) -> JointRecord:
    """A run of the arm whose first gear has this stiffness [N m/rad] and follows its torque with this lag [s]: the links' motion is given, the efforts and the encoder follow from it."""
    rng, time = np.random.default_rng(7), np.arange(0.0, 6.0, 0.004)
    link = np.column_stack(
        [0.5 + 0.4 * multisine(time, rng, 0.3, 2.0), 0.7 + 0.4 * multisine(time, rng, 0.3, 2.0)]
    )
    curve = CubicSpline(time, link)
    rate, acceleration = curve(time, 1), curve(time, 2)
    torque = arm.body.inverse(link, rate, acceleration) - ROTOR * acceleration
    angle = ElasticGear(1.0 / stiffness, arm.paths["one"], 0.0, lag).turned(torque[:, 0], 0.004)
    encoder = link + np.column_stack([angle, 0.0 * time])
    motor = CubicSpline(time, encoder)
    effort = torque + ROTOR * motor(time, 2) + DAMPING * motor(time, 1)
    effort += 0.01 * np.std(effort, axis=0) * rng.normal(size=effort.shape)
    made = {
        joint: Record(
            "run",
            Channel(time, encoder[:, place] + 1e-5 * rng.normal(size=len(time)), "rad"),
            effort=Channel(time, effort[:, place], "N*m"),
        )
        for place, joint in enumerate(("one", "two"))
    }
    return JointRecord("run", made, sampled="instant")


def diagnosed(arm: Machine, stiffness: float, lag: float = 0.0) -> MachineAnswer:
    known = load_catalogue()
    few = Catalogue({name: known[name] for name in LAWS})
    return diagnose_machine([recorded(arm, stiffness, lag)], arm, catalogue=few)


def test_a_gear_that_yields_is_named_once_at_its_joint_with_its_stiffness(arm: Machine):
    found = diagnosed(arm, STIFFNESS).diagnosis
    (gear,) = found.missing
    assert (gear.joint, gear.element) == ("one", "gear_compliance")
    assert found.verdict == "missing_physics" and gear.probability > 0.9
    stiffness = gear.parameters["stiffness"]
    assert stiffness.std is not None and stiffness.std < 0.02 * STIFFNESS
    assert stiffness.value == pytest.approx(STIFFNESS, abs=3.0 * stiffness.std)
    assert found.summary == "The model is wrong at one: gear compliance."
    assert any("one: the gear yields between encoder and link" in note for note in found.notes)
    # all joints are judged again with it in place
    assert {joint: one.verdict for joint, one in found.joints.items()} == {
        "one": "missing_physics",
        "two": "consistent",
    }
    for one in found.joints.values():
        before, after = (one.fit[name].heldout_nrmse for name in ("refitted_nominal", "augmented"))
        assert before is not None and after is not None and after < 0.5 * before


def test_the_stiffness_of_a_gear_with_damping_is_within_its_interval(arm: Machine):
    (gear,) = diagnosed(arm, STIFFNESS, 0.02).diagnosis.missing
    stiffness = gear.parameters["stiffness"]
    assert gear.element == "gear_compliance" and stiffness.std is not None
    assert stiffness.value == pytest.approx(STIFFNESS, abs=3.0 * stiffness.std)


def test_a_gear_with_damping_follows_its_torque_later(arm: Machine):
    time = np.arange(0.0, 10.0, 0.002)
    gear = ElasticGear(0.01, arm.paths["one"], 0.0, 0.02)
    turned = gear.turned(np.sin(2.0 * np.pi * time), 0.002)[1000:]
    whole = 0.01 / (1.0 + 2j * np.pi * 0.02) * np.exp(2j * np.pi * time[1000:])
    np.testing.assert_allclose(turned, whole.imag, atol=1e-6)


def test_a_rigid_gear_is_not_named(arm: Machine):
    assert not diagnosed(arm, np.inf).diagnosis.missing


def test_the_link_behind_a_gear_is_where_the_torque_puts_it(arm: Machine):
    rigid = JointBalances.of(arm, [recorded(arm, STIFFNESS)])
    gear = ElasticGear(1.0 / STIFFNESS, rigid.models["one"], 0.0)
    elastic = rigid.with_gears({"one": gear})

    def errors(balances: JointBalances) -> list[float]:
        return [
            fit_effort(one, balances.models[joint], []).error / variation_of(one)
            for joint in balances.models
            for one in [balances.balance(joint)]
        ]

    assert max(errors(elastic)) < 0.02 < min(errors(rigid))
    # another value replaces it, and none of them is the rigid machine again
    back = elastic.with_gears({})
    assert errors(back) == pytest.approx(errors(rigid))


def test_a_gear_is_told_with_the_units_of_its_joint():
    gear = GearCompliance("lift", ElasticGear(1e-3, None, 0.0), 1e-5, False, 50.0, 0.95)  # type: ignore[arg-type]
    assert gear.values["stiffness"].value == pytest.approx(1000.0)
    assert gear.values["stiffness"].std == pytest.approx(10.0)
    assert gear.values["stiffness"].unit == "N/m"
    assert "stiffness of 1000 ± 10 N/m" in gear.words
