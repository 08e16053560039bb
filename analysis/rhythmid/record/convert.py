"""Writes a record as a bag: its channels as joint states, with a signals.yaml that reads them back."""

import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rhythmid.errors import InputError
from rhythmid.output import write_text
from rhythmid.record.bag_writer import Storage, write_bag
from rhythmid.record.messages import Messages
from rhythmid.record.record import Channel, Record

ROOT = "/"  # namespace of the topics: the same in every bag, so that one signals.yaml reads several
STATES = "joint_states"
TOPICS = {
    "input": "joint_commands",
    "forcing": "forcing",
    "reference": "reference",
}  # roles that are no state
# [s] earlier first times are kept: a bag's reader takes such a clock for one that started with the run
RUN_CLOCK = 9.0


def write_record(record: Record, path: str | Path, joint: str = "joint", storage: Storage = "mcap") -> Path:
    """Write a record as a new bag of sensor_msgs/JointState, with a signals.yaml inside that reads it back.

    Values are those of the record, after scaling. Times are kept to a nanosecond; they are shifted to start at 0
    where the record's times are negative or start late. Raises InputError where the bag exists or cannot be
    written, or where the record has an acceleration, which no joint state can hold.
    """
    channels = {
        role: one for role, one in record.channels.items() if role != "forcing" or record.forcing_law is None
    }
    fields = {role: field_of(role, record) for role in channels}
    shift = shift_of(record)
    placed = {role: (_topic(role, one, record), fields[role]) for role, one in channels.items()}
    topics: dict[str, Messages] = {}
    for name in dict.fromkeys(topic for topic, _ in placed.values()):
        roles = [role for role in channels if placed[role][0] == name]
        stamps = _stamps(channels[roles[0]], shift)
        values = {fields[role]: channels[role].value for role in roles}
        topics[name] = Messages(stamps, values.get("position"), values.get("velocity"), values.get("effort"))
    text = _signals(record, placed, joint, shift)
    made = write_bag(path, topics, storage, joint=joint, namespace=ROOT)
    write_text(made / "signals.yaml", text)
    return made


def field_of(role: str, record: Record) -> str:
    """The field of a joint state for the channel of a role. Raises InputError for an acceleration."""
    kind = {"input": record.input_kind, "output": record.output_kind}.get(role, role)
    field = {
        "force": "effort", "forcing": "effort", "effort": "effort", "velocity": "velocity", "position": "position",
        "base_displacement": "position",
    }.get(kind)  # fmt: skip
    if kind == "reference":
        one = record.reference if role == "reference" else record.input
        assert one is not None
        return "velocity" if one.unit.endswith("/s") else "position"
    if field is None:
        raise InputError(
            f"{record.name}: {role} is an acceleration, which a JointState does not hold; keep the table"
        )
    return field


def _topic(role: str, channel: Channel, record: Record) -> str:
    """Topic of a channel: states with the same times share a topic."""
    if role in TOPICS:
        return TOPICS[role]
    if role == "output" or np.array_equal(channel.time, record.output.time):
        if role == "output" or field_of(role, record) != field_of("output", record):
            return STATES
    return f"{STATES}_{role}"


def shift_of(record: Record) -> float:
    """Time [s] that is subtracted from the record's times for the bag's stamps."""
    first = min(float(channel.time[0]) for channel in record.channels.values())
    return 0.0 if 0.0 <= first < RUN_CLOCK else first


def _stamps(channel: Channel, shift: float) -> NDArray[np.int64]:
    return np.rint((channel.time - shift) * 1e9).astype(np.int64)


def _signals(record: Record, placed: Mapping[str, tuple[str, str]], joint: str, shift: float) -> str:
    lines = ["time: header"]
    if "input" not in placed:
        lines.append("input: none")
    for role, (topic, field) in placed.items():
        channel = record.channels[role]
        more = ""
        if role == "input":
            more = f", kind: {record.input_kind}, hold: {record.hold}"
        elif role == "output":
            more = f", kind: {record.output_kind}"
        lines.append(f'{role}: {{topic: /{topic}, field: "{field}[{joint}]", unit: "{channel.unit}"{more}}}')
    law = record.forcing_law
    if law is not None:
        phase = law.phase + 2.0 * math.pi * law.frequency * shift
        lines.append(
            f"forcing: {{amplitude: {law.amplitude!r}, frequency: {law.frequency!r}, phase: {phase!r}}}"
        )
    if record.parameters:
        lines += ["parameters:", *(f"  {name}: {value!r}" for name, value in record.parameters.items())]
    return "\n".join(lines) + "\n"
