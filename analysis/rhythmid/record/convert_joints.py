"""Writes a record of several joints as a bag: joint states of all joints in one topic, with a signals.yaml that reads
them back."""

import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rhythmid.errors import InputError
from rhythmid.output import write_text
from rhythmid.record.bag_writer import Storage
from rhythmid.record.convert import STATES, TOPICS, field_of, shift_of
from rhythmid.record.joint_messages import Columns, write_joint_bag
from rhythmid.record.joint_record import JointRecord
from rhythmid.record.record import Channel, Record

Stream = tuple[NDArray[np.int64], list[str], Columns]
BASE = "base"  # name of the base's joint in the messages
STATE = ("output", "velocity", "effort")  # roles of the states' topic; the others are commands


def write_joint_record(record: JointRecord, path: str | Path, storage: Storage = "mcap") -> Path:
    """Write a record of several joints as a new bag of sensor_msgs/JointState, with a signals.yaml inside.

    Values are those of the record, after scaling; a joint without a value at a time has NaN there. Times are kept to
    a nanosecond, shifted as by `write_record`. Raises InputError where the bag exists or cannot be written, or where
    the record has an acceleration or a forcing by formula, which joint states of several joints cannot hold.
    """
    every = {**record.joints, **({} if record.base is None else {BASE: record.base})}
    for joint, one in every.items():
        if one.forcing_law is not None:
            raise InputError(
                f"{record.name}: {joint}: a forcing by formula is no joint state; keep the table"
            )
    shift = min(shift_of(one) for one in every.values())
    roles = [
        role
        for role in ("output", "velocity", "effort", "input", "forcing", "reference")
        if _has(every, role)
    ]
    topics: dict[str, Stream] = {}
    for topic in dict.fromkeys(_topic(role) for role in roles):
        own = [role for role in roles if _topic(role) == topic]
        topics[f"/{topic}"] = _stream(every, own, shift)
    made = write_joint_bag(path, topics, storage)
    write_text(made / "signals.yaml", _signals(record, roles))
    return made


def _has(joints: Mapping[str, Record], role: str) -> bool:
    return any(role in one.channels for one in joints.values())


def _topic(role: str) -> str:
    return STATES if role in STATE else TOPICS[role]


def _stream(joints: Mapping[str, Record], roles: list[str], shift: float) -> Stream:
    """Stamps [ns], joints and columns of a topic with these roles, at the times of any of them."""
    found = {
        (joint, role): channel
        for joint, one in joints.items()
        for role in roles
        if (channel := one.channels.get(role)) is not None
    }
    names = [joint for joint in joints if any((joint, role) in found for role in roles)]
    stamps = np.unique(np.concatenate([_stamps(one, shift) for one in found.values()]))
    columns: dict[str, NDArray[np.float64]] = {}
    for (joint, role), channel in found.items():
        field = field_of(role, joints[joint])
        column = columns.setdefault(field, np.full((len(stamps), len(names)), np.nan))
        column[np.searchsorted(stamps, _stamps(channel, shift)), names.index(joint)] = channel.value
    return stamps, names, columns


def _stamps(channel: Channel, shift: float) -> NDArray[np.int64]:
    return np.rint((channel.time - shift) * 1e9).astype(np.int64)


def _signals(record: JointRecord, roles: list[str]) -> str:
    """The text of the signals.yaml."""
    lines = ["time: header", f"joints: [{', '.join(map(json.dumps, record.joints))}]"]
    for role in roles:
        one = next(each for each in record.joints.values() if role in each.channels)
        more = ""
        if role == "input":
            more = f", kind: {one.input_kind}, hold: {one.hold}"
        elif role == "output":
            more = f", kind: {one.output_kind}"
        elif role == "effort":
            more = f", taken: {record.taken}" + (f", sampled: {record.sampled}" if record.sampled else "")
        lines.append(
            f'{role}: {{topic: /{_topic(role)}, field: "{field_of(role, one)}[*]", unit: "{one.channels[role].unit}"{more}}}'
        )
    if record.base is not None:
        field = field_of("output", record.base)
        lines.append(
            f'base: {{topic: /{STATES}, field: "{field}[{BASE}]", unit: "{record.base.output.unit}", '
            f"kind: {record.base.output_kind}}}"
        )
    given = {name: value for one in record.joints.values() for name, value in one.parameters.items()}
    if given:
        lines += ["parameters:", *(f"  {name}: {value!r}" for name, value in given.items())]
    return "\n".join(lines) + "\n"
