"""Field paths: identify one number of a message, such as `effort[leg]`, `data[3]` or `wrench.force.z`."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Any

from rosbags.interfaces import Nodetype

from rhythmid.errors import InputError
from rhythmid.record.orientation import ANGLES, PARTS, is_orientation

_STEP = re.compile(r"\.?([A-Za-z_]\w*)|\[\s*([^\[\]]+?)\s*\]")
LONGEST_POSITION = 10  # digits of an index into a list; the length of a list is a 32-bit number
NAMES = ("name", "names", "joint_names")  # lists that name the entries of the lists beside or below them
# texts that name the list entry that contains them, as in a tree of frames
OWN_NAMES = ("child_frame_id",)

TypeFields = Mapping[
    str, Any
]  # message type -> (constants, [(field, description)]), as rosbags parses definitions


@dataclass(frozen=True)
class Field:
    """A path to one number. `steps` are field names (str), indices (int) and names of entries ((name,))."""

    text: str
    steps: tuple[Any, ...]

    @classmethod
    def parse(cls, text: str) -> "Field":
        """The path in `text`: names joined by dots, each followed by [index] or [joint name] where it is a list."""
        steps: list[Any] = []
        at = 0
        while at < len(text):
            match = _STEP.match(text, at)
            if match is None or (not steps and match.group(1) is None) or (at == 0 and text[0] == "."):
                raise InputError(
                    f"field {text!r} is not a path such as effort[leg], data[3] or wrench.force.z"
                )
            name, entry = match.groups()
            if name:
                steps.append(name)
            else:
                position = entry.isdecimal() and len(entry) <= LONGEST_POSITION
                steps.append(int(entry) if position else (entry,))
            at = match.end()
        if not steps:
            raise InputError(
                "field is empty; a path such as effort[leg], data[3] or wrench.force.z is expected"
            )
        return cls(text, tuple(steps))

    def check(self, msgtype: str, types: TypeFields) -> None:
        """Raise InputError unless messages of `msgtype` have such a number."""
        kind: Any = (Nodetype.NAME, msgtype)
        named = False  # whether a message on the path names its entries
        done = ""
        for number, step in enumerate(self.steps, start=1):
            if isinstance(step, str):
                if kind[0] != Nodetype.NAME:
                    raise InputError(f"field {self.text!r}: {done or msgtype} has no parts{_hint(kind)}")
                fields = dict(types[kind[1]][1])
                if number == len(self.steps) and step in ANGLES and is_orientation(fields):
                    return
                if step not in fields:
                    near = get_close_matches(step, fields, 1)
                    mend = f"did you mean {near[0]!r}?" if near else f"it has {', '.join(fields)}"
                    raise InputError(f"field {self.text!r}: {kind[1]} has no field {step!r}; {mend}")
                named = named or any(name in fields and _is_list_of_text(fields[name]) for name in NAMES)
                kind = fields[step]
                done = f"{done}.{step}" if done else step
                continue
            if kind[0] not in (Nodetype.ARRAY, Nodetype.SEQUENCE):
                raise InputError(f"field {self.text!r}: {done} is not a list")
            if isinstance(step, tuple) and not (named or _name_themselves(kind[1][0], types)):
                raise InputError(
                    f"field {self.text!r}: entries of {done} have no names; give a position such as {done}[0]"
                )
            if kind[0] == Nodetype.ARRAY and isinstance(step, int) and step >= kind[1][1]:
                raise InputError(f"field {self.text!r}: {done} has {kind[1][1]} entries, counted from 0")
            kind = kind[1][0]
            done += f"[{step if isinstance(step, int) else step[0]}]"
        if kind[0] != Nodetype.BASE or kind[1][0] in ("string", "wstring"):
            raise InputError(f"field {self.text!r}: {done} is not one number{_hint(kind)}")

    def components(self, msgtype: str, types: TypeFields) -> tuple["Field", ...]:
        """The numbers from which it is computed: x, y, z and w of a quaternion for an angle of it, else itself. Its path must be one of
        `msgtype`."""
        kind: Any = (Nodetype.NAME, msgtype)
        for step in self.steps[:-1]:
            kind = dict(types[kind[1]][1])[step] if isinstance(step, str) else kind[1][0]
        of_angle = self.steps[-1] in ANGLES and kind[0] == Nodetype.NAME
        if not of_angle or not is_orientation(dict(types[kind[1]][1])):
            return (self,)
        before = self.text.rpartition(".")[0]
        return tuple(Field(f"{before}.{part}", (*self.steps[:-1], part)) for part in PARTS)


def _name_themselves(kind: Any, types: TypeFields) -> bool:
    """Whether the entries of a list are messages that contain their names."""
    return kind[0] == Nodetype.NAME and any(name in dict(types[kind[1]][1]) for name in OWN_NAMES)


def _is_list_of_text(kind: Any) -> bool:
    return kind[0] in (Nodetype.ARRAY, Nodetype.SEQUENCE) and kind[1][0][0] == Nodetype.BASE and (
        kind[1][0][1][0] == "string"
    )  # fmt: skip


def _hint(kind: Any) -> str:
    if kind[0] in (Nodetype.ARRAY, Nodetype.SEQUENCE):
        return "; it is a list: add an index such as [0] or a joint's name such as [leg]"
    if kind[0] == Nodetype.NAME:
        return f"; it is a {kind[1]}: name one of its fields"
    return ""
