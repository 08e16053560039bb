"""All joints of a table as one record, each guessed as `rhythmid init --joint` would."""

from pathlib import Path

from rhythmid.errors import InputError
from rhythmid.record.joint_record import JointRecord
from rhythmid.record.read import read_record
from rhythmid.record.record import Record
from rhythmid.record.signals import Signals
from rhythmid.start.start import Guess, guess


def guessed_joints(table: str | Path, first: Guess, rate: float | None) -> tuple[JointRecord, list[str]]:
    """The joints of a table, of which `first` is the guess for one, in the order of their names; and the guesses and
    the joints that cannot be used, one line each."""
    joints: dict[str, Record] = {}
    lines: list[str] = []
    for name in sorted((first.roles.joint.name, *first.roles.joint.others)):
        try:
            found = first if name == first.roles.joint.name else guess(table, name, rate)
            record = read_record(table, Signals.from_text(found.signals))
        except InputError as error:
            lines.append(f"{name}: left out: {error}")
            continue
        # a number would be the place of a joint in a message
        joints[f"joint_{name}" if name.isdigit() else name] = record
        chosen = (f"{role} {choice.recorded}" for role, choice in found.roles.choices.items())
        lines.append(f"{name}: {', '.join(chosen)}")
    return JointRecord(next(iter(joints.values())).name, joints), lines
