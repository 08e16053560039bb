"""Notes about the records of several joints: one for each cause, which names the joints."""

import numpy as np

from rhythmid.record.cleaning import cleaned_joints
from rhythmid.record.joint_notes import notes_of_joints
from rhythmid.record.joint_record import JointRecord
from rhythmid.record.record import Channel, Record


def test_equal_notes_are_one_that_names_the_joints():
    assert notes_of_joints({"hip": ["late", "coarse"], "knee": ["late"], "toe": []}) == [
        "hip, knee: late",
        "hip: coarse",
    ]


def test_notes_that_differ_in_their_numbers_alone_are_one_with_the_range_of_each():
    said = {
        "hip": ["5 of 90 are out, the first at t = 0.7 s"],
        "knee": ["12 of 90 are out, the first at t = 0.7 s"],
    }
    assert notes_of_joints(said) == ["hip, knee: 5 to 12 of 90 are out, the first at t = 0.7 s"]
    said = {"hip": ["column q_1 repeats", "tau[2] is late"], "knee": ["column q_2 repeats", "tau[3] is late"]}
    assert len(notes_of_joints(said)) == 4  # these are names


def test_samples_that_repeat_at_all_joints_are_told_once():
    time = np.arange(0.0, 4.0, 0.002)
    held = np.sin(3.0 * time)[3 * (np.arange(len(time)) // 3)]  # each value is logged three times
    joints = {joint: Record("run", Channel(time, held, "rad")) for joint in ("hip", "knee")}
    _, notes = cleaned_joints([JointRecord("run", joints)])
    (said,) = notes
    assert said.startswith("run, hip, knee: samples of the output that repeat")
