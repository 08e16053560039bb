"""A recorded effort that falls with the speed is told: no passive part of a joint gives power."""

from dataclasses import replace

import numpy as np
import pytest
from answers import diagnosed
from legged import fixed_leg, recorded, references

from rhythmid.body.body import BODY
from rhythmid.body.machine import Machine
from rhythmid.diagnose.answer.result import FitQuality
from rhythmid.diagnose.joints.misfit import misfits
from rhythmid.identify.joints.effort_power import BRAKES, braking_note
from rhythmid.identify.joints.joint_identification import identify_machine
from rhythmid.identify.joints.joint_motion import JointBalances
from rhythmid.record.joint_record import JointRecord

FALLS = -6.0  # N*m*s/rad


@pytest.fixture(scope="module")
def leg(tmp_path_factory: pytest.TempPathFactory) -> tuple[Machine, JointRecord]:
    """The leg, and a record in which the knee's effort lacks a part that grows with the speed."""
    machine = Machine.load(fixed_leg(tmp_path_factory.mktemp("leg")))
    time, rng = np.arange(0.0, 6.0, 0.002), np.random.default_rng(5)
    asked = references({"hip": (0.4, 0.3), "knee": (-1.2, 0.3)}, time, rng, (0.4, 3.0))
    record = recorded(machine, asked, time, rng)
    knee = record.joints["knee"]
    assert knee.effort is not None
    speed = np.gradient(knee.output.value, knee.output.time)
    speed = np.convolve(speed, np.ones(15) / 15.0, "same")
    lacking = knee.effort.value + FALLS * np.interp(knee.effort.time, knee.output.time, speed)
    falling = replace(knee, effort=replace(knee.effort, value=lacking))
    return machine, replace(record, joints={**record.joints, "knee": falling})


def test_an_effort_that_falls_with_the_speed_is_told_with_the_slope(leg: tuple[Machine, JointRecord]):
    machine, record = leg
    balances = JointBalances.of(machine, [record])
    told = {
        joint: braking_note(joint, balances.balance(joint), balances.models[joint], True)
        for joint in machine.joints
    }
    assert told["hip"] is None
    assert told["knee"] is not None and told["knee"].startswith(
        "knee: the recorded effort falls with the speed, by 5"
    )
    assert "lacks a part that grows with the speed" in told["knee"]


def test_identify_tells_it_and_that_the_damping_ends_at_its_bound(leg: tuple[Machine, JointRecord]):
    machine, record = leg
    found = identify_machine([record], machine, free=False)
    assert [note for note in found.notes if note.startswith("knee: the recorded effort falls")]
    damping = found.parameters["knee.viscous_damper.damping"]
    assert damping.at_bound and damping.interval[0] == 0.0
    assert [
        note for note in found.notes if "knee.viscous_damper.damping" in note and "ends at the bound" in note
    ]


def test_a_load_that_the_file_lacks_is_no_effort_that_falls_with_the_speed(leg: tuple[Machine, JointRecord]):
    """A weight returns what it takes only where the motion does: here rows are kept in which it brakes."""
    machine, record = leg
    balances = JointBalances.of(machine, [record])
    whole, model = balances.balance("knee"), balances.models["knee"]
    link = next(name for name in machine.body.ends if machine.body.joint_of(name) == "knee")
    weight = whole.rows(one.links[f"{BODY}.{link}.payload"][1] for one in whole.motions)
    moved = whole.rows(model.mass.value * one.acceleration + one.coupling for one in whole.motions)
    kept = weight * whole.mechanical[:, 1] < 0.0
    parts = np.split(kept, np.cumsum([len(one) for one in whole.places])[:-1])
    places = tuple(one[part] for one, part in zip(whole.places, parts, strict=True))
    carried = replace(whole, places=places, record=whole.record[kept], measured=(moved + 2.0 * weight)[kept])
    beyond, speed = 2.0 * weight[kept], carried.mechanical[:, 1]
    assert np.mean(beyond * speed) < BRAKES * np.sqrt(np.mean(beyond**2) * np.mean(speed**2))
    assert braking_note("knee", carried, model, True) is None


def test_a_diagnosis_says_it_instead_of_blaming_the_body():
    fit = {"refitted_nominal": FitQuality(1.0, 1.0), "augmented": FitQuality(1.0, 1.0)}
    answers = {"knee": replace(diagnosed("unknown_physics"), fit=fit), "hip": diagnosed("consistent")}
    assert list(misfits(answers, {"knee": "it falls", "hip": "it falls"})) == ["it falls"]
