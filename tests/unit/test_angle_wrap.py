"""An output that jumps where an angle is read within a turn is unwrapped, and `check` says so; motions that are merely fast are not."""

import numpy as np
import pytest
from legged import MODELS

from rhythmid.body.machine import Machine
from rhythmid.diagnose.admission import admitted
from rhythmid.model import Model
from rhythmid.record.angle_wrap import unwrapped, wrap_notes
from rhythmid.record.bag_report import quality_report
from rhythmid.record.cleaning import cleaned, cleaned_joints
from rhythmid.record.joint_record import JointRecord
from rhythmid.record.read import read_record
from rhythmid.record.record import Channel, Record
from rhythmid.start.start import guess, start

TIME = 0.01 * np.arange(2000)
TURNING = 3.0 * np.sin(0.4 * TIME) + 1.3 * TIME  # rad


def noted(value: np.ndarray, unit: str = "rad") -> tuple[str, ...]:
    return wrap_notes(Record("run", Channel(TIME, value, unit)))


@pytest.mark.parametrize(("turn", "name"), [(2.0 * np.pi, "2π"), (np.pi, "π")])
@pytest.mark.parametrize("begin", [0.0, -np.pi])
def test_an_angle_within_a_turn_or_half_of_one_is_noted_with_its_jumps(turn, name, begin):
    value = (TURNING - begin) % turn + begin
    (note,) = noted(value)
    count = int((np.abs(np.diff(value)) > 0.5 * turn).sum())
    assert note.startswith(f"output: it jumps by {name} rad {count} times")
    held = value[4 * (np.arange(len(value)) // 4)]  # a reading stands for several rows
    assert noted(held)


@pytest.mark.parametrize(
    "value",
    [
        TURNING,
        np.where(np.sin(TIME) > 0.0, 2.0 * np.pi, 0.0) + 0.01 * np.sin(7.0 * TIME),
        np.sin(TIME) + 2.0 * np.pi * (np.arange(2000) == 700),
        np.pi * np.sin(150.0 * TIME),
    ],
    ids=["unwrapped", "two positions", "outlier", "coarsely sampled"],
)
def test_what_does_not_go_on_against_its_jumps_by_a_turn_is_no_wrapped_angle(value):
    assert noted(value) == ()


def test_an_angle_within_a_turn_is_unwrapped_on_either_side_of_a_gap_in_which_any_motion_may_be():
    value = (TURNING + np.pi) % (2.0 * np.pi) - np.pi
    jump = int(np.flatnonzero(np.abs(np.diff(value)) > np.pi)[1])
    for begin, lost in ((jump - 20, 60), (jump + 300, 400)):  # across a jump, and more than half a turn
        kept = np.delete(np.arange(len(TIME)), np.s_[begin : begin + lost])
        channel = Channel(TIME[kept], value[kept], "rad")
        assert wrap_notes(Record("run", channel))
        off = unwrapped(Record("run", channel)).output.value - TURNING[kept]
        for side in (off[:begin], off[begin:]):
            np.testing.assert_allclose(side, side[0], atol=1e-9)
        assert (off[begin] - off[0]) / (2.0 * np.pi) == pytest.approx(
            round((off[begin] - off[0]) / (2.0 * np.pi))
        )


def test_a_length_has_no_turn():
    assert noted(TURNING % (2.0 * np.pi), "m") == ()


def test_check_says_it(tmp_path):
    rows = (f"{t:.2f},{y:.6f}" for t, y in zip(TIME, TURNING % (2.0 * np.pi)))
    (tmp_path / "run.csv").write_text("\n".join(["t,angle", *rows]) + "\n")
    (tmp_path / "signals.yaml").write_text(
        "time: {column: t}\ninput: none\noutput: {column: angle, unit: rad}\n"
    )
    lines = quality_report(tmp_path / "run.csv", tmp_path / "signals.yaml").lines()
    assert any("jumps by 2π rad" in line for line in lines)


def test_a_joint_that_turns_is_unwrapped_without_a_stated_unit_and_one_that_slides_is_not():
    machine = Machine.load(MODELS / "leg.yaml")
    within = Channel(
        TIME, TURNING % (2.0 * np.pi), "m"
    )  # the unit that signals of a joint have if they state none
    joints = {name: Record("run", within, reference=within) for name in machine.joints}
    (record,), notes = cleaned_joints([JointRecord("run", joints, joints["knee"])], machine.turning)
    for one in record.joints.values():
        for channel in (one.output, one.reference):
            np.testing.assert_allclose(channel.value - TURNING, channel.value[0] - TURNING[0], atol=1e-9)
    assert record.base is not None and not np.any(record.base.output.value - within.value)  # a rail
    assert sum("jumps by 2π rad" in note for note in notes) == 1


SERVO = """
units: {force: "rad/s^2", position: rad, mass: "1"}
inertia: {mass: {value: 1, unit: "1", fixed: true}}
command: [{velocity_control: {gain: {value: GAIN, unit: "1/s"}}}]
"""


def test_the_analyses_take_the_jumps_out_and_say_so():
    asked = Channel(TIME, np.gradient(TURNING, TIME), "rad/s")
    model = Model.from_text(SERVO.replace("GAIN", "30.0"))
    told = []
    for angle in (TURNING, TURNING % (2.0 * np.pi)):
        given = admitted(
            [Record("wheel", Channel(TIME, angle, "rad"), input=asked, input_kind="reference")], (), model
        )
        (record,) = given.records
        np.testing.assert_allclose(
            record.output.value - TURNING, record.output.value[0] - TURNING[0], atol=1e-9
        )
        told.append("wheel: output: it jumps by 2π rad" in " ".join(given.notes))
    assert told == [False, True]


@pytest.mark.parametrize("role", ["input", "reference"])
def test_a_reference_that_jumps_like_the_output_goes_on_in_the_same_turn(role):
    asked = Channel(TIME, (TURNING + 0.2) % (2.0 * np.pi), "rad")
    given = {"input_kind": "reference"} if role == "input" else {}
    record = unwrapped(
        Record("wheel", Channel(TIME, TURNING % (2.0 * np.pi), "rad"), **{role: asked}, **given)
    )
    turns = record.output.value - TURNING
    np.testing.assert_allclose(turns, turns[0], atol=1e-9)
    np.testing.assert_allclose(getattr(record, role).value - record.output.value, 0.2, atol=1e-9)


def test_init_says_it_and_makes_the_same_of_an_angle_within_a_turn(tmp_path):
    asked, gains = np.degrees(np.gradient(TURNING, TIME)), []
    for name, angle in (("read", TURNING % (2.0 * np.pi)), ("unwrapped", TURNING)):
        rows = (f"{t:.2f},{r:.6f},{y:.6f}" for t, r, y in zip(TIME, asked, np.degrees(angle)))
        path = tmp_path / f"{name}.csv"
        path.write_text("\n".join(["time_s,commanded_deg_s,angle_deg", *rows]) + "\n")
        begun = start([path])
        checks = " ".join(line for line in begun.lines() if line.startswith("CHECK"))
        assert ("CHECK output: it jumps by 2π rad" in checks) is (name == "read")
        gains.append(begun.nominal.model.value("velocity_control.gain"))
    assert gains[0] == pytest.approx(gains[1], rel=0.01)


def test_init_takes_counts_that_begin_again_after_a_turn_in_rad(tmp_path):
    counts = np.floor(TURNING * 4096 / (2.0 * np.pi)) % 4096
    torque = np.gradient(np.gradient(TURNING, TIME), TIME)
    rows = [f"{t:.2f},{y:.0f},{u:.6f},{k % 256}" for k, (t, y, u) in enumerate(zip(TIME, counts, torque))]
    (tmp_path / "run.csv").write_text("\n".join(["time,encoder,torque,sequence", *rows]) + "\n")
    found = guess(tmp_path / "run.csv")
    output = found.roles.choices["output"].recorded
    assert (output.column, output.unit) == ("encoder", "rad") and output.scale == pytest.approx(
        2.0 * np.pi / 4096
    )
    told = [line for line in found.lines() if "begins again" in line]
    assert len(told) == 1 and "encoder: begins again after 4096" in told[0]  # a number of rows is no turn
    (tmp_path / "signals.yaml").write_text(found.signals)
    report = quality_report(tmp_path / "run.csv", tmp_path / "signals.yaml")
    assert any("it is unwrapped" in note for note in report.notes) and not any(
        "jumps" in one for one in report.matters
    )
    turns = (
        cleaned(read_record(tmp_path / "run.csv", tmp_path / "signals.yaml")).record.output.value - TURNING
    )
    assert float(np.ptp(turns)) < 2.0 * 2.0 * np.pi / 4096


@pytest.mark.parametrize("turn", [np.inf, 2.0 * np.pi], ids=["on and on", "within a turn"])
def test_init_finds_inertia_and_damping_of_a_motor_that_never_comes_back(turn, tmp_path):
    """Up to 100 rad/s, 2 ms apart, an encoder of 16384 counts a turn."""
    time = 0.002 * np.arange(3000)
    speed = 70.0 + 20.0 * np.sin(4.0 * time) + 8.0 * np.sin(11.0 * time)
    torque = 2e-3 * (80.0 * np.cos(4.0 * time) + 88.0 * np.cos(11.0 * time)) + 1e-3 * speed
    angle = 70.0 * time - 5.0 * np.cos(4.0 * time) - 8.0 / 11.0 * np.cos(11.0 * time)
    count = 2.0 * np.pi / 16384
    angle = np.floor(angle / count) * count
    angle = angle if np.isinf(turn) else (angle + np.pi) % turn - np.pi
    table = np.column_stack([time, angle, torque])
    np.savetxt(
        tmp_path / "run.csv",
        table,
        delimiter=",",
        header="time,position [rad],torque [Nm]",
        comments="",
        fmt="%.8f",
    )
    model = start([tmp_path / "run.csv"]).nominal.model
    assert model.value("inertia.mass") == pytest.approx(2e-3, rel=0.01)
    assert model.value("viscous_damper.damping") == pytest.approx(1e-3, rel=0.01)
    assert [term.label for term in model.terms] == ["viscous_damper"]
