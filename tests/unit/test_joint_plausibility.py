"""Joints that were recorded under each other's names, in another unit, or with their sign turned round."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from legged import MODELS, fixed_leg, recorded, references
from typer.testing import CliRunner

from rhythmid.body.machine import Machine
from rhythmid.cli import app
from rhythmid.elements.catalogue import load_catalogue
from rhythmid.errors import InputError
from rhythmid.identify.joints.joint_identification import identify_machine
from rhythmid.identify.joints.joint_plausibility import likely_joint_mend
from rhythmid.record.joint_record import JointRecord, load_joint_records

DEGREES = 180.0 / np.pi
LEG = {"hip": (0.6, 0.3), "knee": (-1.2, 0.3)}


def played(
    machine: Machine,
    asked: dict[str, tuple[float, float]],
    seconds: float,
    effort: bool = True,
    band: tuple[float, float] = (0.5, 4.0),
) -> JointRecord:
    rng = np.random.default_rng(7)
    time = np.arange(0.0, seconds, 0.002)
    return recorded(machine, references(asked, time, rng, band), time, rng, with_effort=effort)


def exchanged(record: JointRecord, **names: str) -> JointRecord:
    """The record with joints under other names."""
    return replace(record, joints={joint: record.joints[names.get(joint, joint)] for joint in record.joints})


def scaled(record: JointRecord, *joints: str, position: float = 1.0, effort: float = 1.0) -> JointRecord:
    """The record with channels of some joints times factors, their references with their positions."""
    made = dict(record.joints)
    for joint in joints:
        one = made[joint]
        assert one.input is not None
        made[joint] = replace(
            one,
            output=replace(one.output, value=position * one.output.value),
            input=replace(one.input, value=position * one.input.value),
            effort=None if one.effort is None else replace(one.effort, value=effort * one.effort.value),
        )
    return replace(record, joints=made)


@pytest.fixture(scope="module")
def leg(tmp_path_factory: pytest.TempPathFactory) -> tuple[Machine, JointRecord]:
    machine = Machine.load(fixed_leg(tmp_path_factory.mktemp("leg")))
    return machine, played(machine, LEG, 6.0)


@cache
def arm() -> tuple[Machine, JointRecord]:
    machine = Machine.load(MODELS / "arm.yaml")
    asked = {joint: (float(machine.body.reference[k]), 0.2) for k, joint in enumerate(machine.joints)}
    return machine, played(machine, asked, 3.0)


def test_exchanged_joints_are_named_and_the_right_order_is_not_refused(leg):
    machine, record = leg
    with pytest.raises(InputError, match="hip is recorded as knee, knee is recorded as hip") as caught:
        identify_machine([exchanged(record, hip="knee", knee="hip")], machine)
    assert "\n" not in str(caught.value)
    assert likely_joint_mend(machine, [record]) is None
    for effect, values in (
        ("coulomb_friction", {"force": 0.5, "transition": 0.02}),
        ("linear_spring", {"stiffness": 3.0, "rest_length": 0.5}),
        ("actuator_gain", {"gain": 0.5}),
    ):
        other = machine.with_element("knee", load_catalogue()[effect], values)
        assert likely_joint_mend(machine, [played(other, LEG, 6.0)]) is None
    heavy = machine.with_inertial({"shank.mass": 3.0 * machine.body.parameters["shank.mass"]})
    assert likely_joint_mend(machine, [played(heavy, LEG, 6.0)]) is None


def test_of_an_arms_six_joints_the_order_is_found():
    machine, record = arm()
    wrong = exchanged(record, joint2="joint3", joint3="joint5", joint5="joint2")
    said = likely_joint_mend(machine, [wrong])
    assert said is not None and "joint2 is recorded as joint5, joint3 is recorded as joint2" in said


@pytest.mark.parametrize(("role", "said"), [("output", "positions"), ("effort", "efforts")])
def test_an_order_that_is_wrong_in_one_channel_alone_is_told_with_the_channel(role: str, said: str):
    machine, record = arm()
    one, other = record.joints["joint2"], record.joints["joint3"]
    joints = {
        "joint2": replace(one, **{role: getattr(other, role)}),
        "joint3": replace(other, **{role: getattr(one, role)}),
    }
    found = likely_joint_mend(machine, [replace(record, joints=record.joints | joints)])
    assert found is not None and "\n" not in found
    assert (
        f"the {said} alone seem to be recorded in another order: joint2 is recorded as joint3, joint3 is recorded as joint2"
        in found
    )
    assert f"in the order of 'joints:' under '{role}:' in signals.yaml" in found


@pytest.mark.parametrize(
    ("position", "effort", "joints", "said"),
    [
        (DEGREES, 1.0, ("hip", "knee"), "position of every joint looks like degrees"),
        (DEGREES, 1.0, ("knee",), "position of knee looks like degrees, where rad is declared; write  scale: {knee: 0.0174533}"),
        (-1.0, 1.0, ("knee",), "position of knee seems to have its sign turned round; write  scale: {knee: -1}  under 'output:'"),
        (1.0, -1.0, ("hip",), "effort of hip seems to have its sign turned round; write  scale: {hip: -1}  under 'effort:'"),
        (1.0, -1.0, ("hip", "knee"), "effort of every joint seems to have its sign turned round; write  scale: -1"),
        (-1.0, -1.0, ("knee",), "the same for the other joints: the mirrored machine moves alike"),
        (1.0, 0.1, ("knee",), "effort of knee seems to be in units about 10 times too small, such as a motor's current in A"),
        (1.0, 1e3, ("hip", "knee"), "effort of every joint looks like millinewton metres"),
    ],
)  # fmt: skip
def test_units_and_signs_are_told_by_joint_with_what_to_write(leg, position, effort, joints, said: str):
    machine, record = leg
    found = likely_joint_mend(machine, [scaled(record, *joints, position=position, effort=effort)])
    assert found is not None and said in found
    assert "\n" not in found


def test_one_joint_of_six_in_degrees_or_in_amperes_is_named():
    machine, record = arm()
    for changes, said in (
        ({"position": DEGREES}, "position of joint3 looks like degrees"),
        ({"effort": -0.1}, "effort of joint3 seems to be in units about 10 times too small with its sign"),
    ):
        found = likely_joint_mend(machine, [scaled(record, "joint3", **changes)])
        assert found is not None and said in found


def test_joints_without_recorded_efforts_are_judged_by_their_controllers(leg):
    machine, _ = leg
    record = played(machine, LEG, 6.0, effort=False)
    assert likely_joint_mend(machine, [record]) is None
    found = likely_joint_mend(machine, [scaled(record, "hip", "knee", position=DEGREES)])
    assert found is not None and "degrees" in found and "under 'output:' and 'input:'" in found


@pytest.mark.parametrize(
    ("role", "said"), [("input", "reference of knee is 5"), ("output", "position of knee is 5")]
)
def test_a_reference_in_another_unit_than_the_position_that_follows_it_is_told(leg, role: str, said: str):
    machine, _ = leg
    record = played(machine, {"hip": (0.6, 0.3), "knee": (-1.2, 0.3)}, 3.0, effort=False)
    one = record.joints["knee"]
    channel = getattr(one, role)
    wrong = replace(one, **{role: replace(channel, value=DEGREES * channel.value)})
    found = likely_joint_mend(machine, [replace(record, joints={**record.joints, "knee": wrong})])
    assert found is not None and said in found
    assert f"scale: {{knee: 0.0174533}}  under '{role}:'" in found


def test_references_of_all_joints_in_another_unit_are_told_in_one_line(leg):
    machine, _ = leg
    record = played(machine, {"hip": (0.6, 0.3), "knee": (-1.2, 0.3)}, 3.0, effort=False)
    joints = {
        joint: replace(one, input=replace(one.input, value=DEGREES * one.input.value))
        for joint, one in record.joints.items()
        if one.input is not None
    }
    found = likely_joint_mend(machine, [replace(record, joints=joints)])
    assert found is not None and "the reference of hip, knee is 5" in found
    assert "scale: {hip: 0.0174533, knee: 0.0174533}  under 'input:'" in found


def test_a_slide_in_millimetres_is_told(tmp_path: Path):
    (tmp_path / "crane.xml").write_text(
        '<mujoco><worldbody><body name="cart"><joint name="slide" type="slide" axis="1 0 0"/>'
        '<geom type="box" size="0.1 0.1 0.1" mass="3"/><body name="arm"><joint name="swing" axis="0 1 0"/>'
        '<geom type="capsule" fromto="0 0 0 0 0 -0.5" size="0.02" mass="1"/></body></body></worldbody></mujoco>'
    )
    control = "{position_control: {proportional: 200, derivative: 8}}"
    (tmp_path / "crane.yaml").write_text(
        "body: {mjcf: crane.xml, step: 0.001, contacts: false}\njoints:\n"
        f"  slide: {{command: [{control}]}}\n  swing: {{command: [{control}]}}\n"
    )
    machine = Machine.load(tmp_path / "crane.yaml")
    record = played(machine, {"slide": (0.0, 0.1), "swing": (0.3, 0.3)}, 6.0)
    assert likely_joint_mend(machine, [record]) is None
    found = likely_joint_mend(machine, [scaled(record, "slide", position=1e3)])
    assert found is not None and "position of slide looks like millimetres, where m is declared" in found


def test_identify_diagnose_and_check_tell_the_mend_and_the_mended_signals_are_taken(leg, tmp_path: Path):
    machine, record = leg
    machine.save(tmp_path / "leg.yaml")
    time = np.arange(0.0, 5.9, 0.002)
    columns = {"t": time}
    for joint, one in scaled(record, "knee", position=DEGREES).joints.items():
        assert one.input is not None and one.effort is not None
        for name, channel in (("q", one.output), ("u", one.input), ("tau", one.effort)):
            columns[f"{name}_{joint}"] = np.interp(time, channel.time, channel.value)
    table = np.column_stack(list(columns.values()))
    np.savetxt(tmp_path / "run.csv", table, delimiter=",", header=",".join(columns), comments="")
    text = (
        "time: {column: t}\njoints: [hip, knee]\ninput: {column: 'u_*', kind: reference, unit: rad}\n"
        "output: {column: 'q_*', unit: rad}\neffort: {column: 'tau_*', unit: N*m}\n"
    )
    (tmp_path / "signals.yaml").write_text(text)
    options = [str(tmp_path / "run.csv"), "--signals", str(tmp_path / "signals.yaml"), "--model", str(tmp_path / "leg.yaml")]  # fmt: skip
    for command in ("identify", "diagnose", "check"):
        with pytest.raises(InputError, match="position of knee looks like degrees") as caught:
            CliRunner().invoke(app, [command, *options], catch_exceptions=False)
        assert "scale: {knee: 0.0174533}" in str(caught.value)
    (tmp_path / "signals.yaml").write_text(text.replace("unit: rad}", "unit: rad, scale: {knee: 0.0174533}}"))
    (read,) = load_joint_records([tmp_path / "run.csv"], tmp_path / "signals.yaml")
    assert likely_joint_mend(machine, [read]) is None
    assert read.joints["hip"].output.value[0] == pytest.approx(0.6, abs=0.05)
    assert CliRunner().invoke(app, ["check", *options], catch_exceptions=False).exit_code == 0
    (tmp_path / "signals.yaml").write_text(text.replace("unit: rad}", "unit: rad, scale: {ankle: -1}}"))
    with pytest.raises(InputError, match="scale.ankle: is no joint; those are hip, knee"):
        load_joint_records([tmp_path / "run.csv"], tmp_path / "signals.yaml")


def unlike(machine: Machine) -> Machine:
    """The machine with heavier links, and with dry friction that is more than the weight at joints that hardly carry any."""
    plant = machine.with_inertial({name: 1.4 * value for name, value in machine.body.parameters.items() if name.endswith(".mass")})  # fmt: skip
    for joint in machine.joints:
        plant = plant.with_element(
            joint, load_catalogue()["coulomb_friction"], {"force": 2.0, "transition": 0.05}
        )
    return plant


def test_all_efforts_with_their_sign_turned_are_told_though_some_joints_move_by_friction_alone():
    machine, _ = arm()
    asked = {joint: (float(machine.body.reference[k]), 0.3) for k, joint in enumerate(machine.joints)}
    record = played(unlike(machine), asked, 3.0)
    assert likely_joint_mend(machine, [record]) is None
    found = likely_joint_mend(machine, [scaled(record, *machine.joints, effort=-1.0)])
    assert found is not None and "effort of every joint seems to have its sign turned round" in found


def test_a_base_on_a_wall_and_efforts_without_weight_are_told_with_the_vector_to_write(leg):
    machine, _ = leg

    def said(truth: list[float], file: list[float]) -> str | None:
        plant, known = (replace(machine, body=machine.body.with_gravity(one)) for one in (truth, file))
        return likely_joint_mend(known, [played(plant, LEG, 4.0, band=(0.2, 1.0))])

    down, wall, none = [0.0, 0.0, -9.81], [9.81, 0.0, 0.0], [0.0, 0.0, 0.0]
    found = said(truth=wall, file=down)
    assert found is not None and "mounted otherwise" in found and "\n" not in found
    assert "write  gravity: [9.81, 0, 0]  under 'body:' in the model's file" in found
    assert said(truth=wall, file=wall) is None
    found = said(truth=down, file=wall)
    assert found is not None and "gravity: [0, 0, -9.81]" in found
    found = said(truth=none, file=down)
    assert found is not None and "without the weight of the links" in found and "gravity: [0, 0, 0]" in found


def test_unit_and_sign_joint_by_joint_are_one_line_with_one_scale(leg):
    machine, record = leg
    found = likely_joint_mend(machine, [scaled(scaled(record, "hip", effort=0.05), "knee", effort=-0.1)])
    assert found is not None and found.count("scale:") == 1
    assert "scale: {hip: 2" in found and "knee: -" in found


def test_efforts_that_no_reading_explains_are_not_mended(leg):
    machine, record = leg
    rng = np.random.default_rng(3)
    noise = {
        joint: replace(one, effort=replace(one.effort, value=rng.normal(size=len(one.effort.value))))
        for joint, one in record.joints.items()
        if one.effort is not None
    }
    assert likely_joint_mend(machine, [replace(record, joints=noise)]) is None


def with_unknown_load(record: JointRecord, joint: str, share: float) -> JointRecord:
    """The record with a load at one joint that the body does not have, as a share of the size of its effort."""
    one = record.joints[joint]
    assert one.effort is not None
    load = share * np.std(one.effort.value) * np.sign(np.sin(9.0 * one.effort.time))
    made = replace(one, effort=replace(one.effort, value=one.effort.value + load))
    return replace(record, joints={**record.joints, joint: made})


def test_a_joint_that_lacks_a_part_hides_no_sign_at_another_and_its_own_sign_is_told(leg):
    machine, record = leg
    record = with_unknown_load(record, "knee", 0.35)
    assert likely_joint_mend(machine, [record]) is None
    for turned in (("hip",), ("knee",)):
        found = likely_joint_mend(machine, [scaled(record, *turned, effort=-1.0)])
        assert found is not None and f"effort of {turned[0]} seems to have its sign turned round" in found
    found = likely_joint_mend(machine, [scaled(record, "hip", "knee", effort=-1.0)])
    assert found is not None and "scale: -1 " in found


def test_the_scale_to_write_takes_the_place_of_the_one_that_is_there(leg):
    machine, record = leg
    declared = replace(scaled(record, "knee", effort=-1.0), scales={"effort": {"hip": 2.0, "knee": -1.0}})
    found = likely_joint_mend(machine, [declared])
    assert found is not None
    assert "write  scale: {hip: 2, knee: 1}  under 'effort:' in place of the scale that is there" in found
