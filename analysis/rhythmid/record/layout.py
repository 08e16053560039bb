"""Byte positions of the numbers in a serialised message (CDR, the encoding of ROS 2 messages).

The positions depend only on the lengths of the strings and lists in the message. So they are computed for one
message. Every other message with the same length words has the same layout, and its numbers can be read by array.
That is about ten times faster than deserialising messages one by one.
"""

import struct
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rosbags.interfaces import Nodetype
from rosbags.typesys.base import normalize_fieldname

from rhythmid.record.block import Block, gather
from rhythmid.record.field import NAMES, OWN_NAMES, Field, TypeFields

HEAD = 4  # bytes of encapsulation before every message; alignment is relative to their end
LITTLE_ENDIAN = 0x0100  # the first two of them, plain CDR in little-endian byte order, as a number
_PARTS_AT_MOST = 1000  # a message with more sub-messages and strings in its lists gets no layout
NUMBERS = {
    "bool": "?", "byte": "u1", "char": "u1", "octet": "u1", "int8": "i1", "uint8": "u1", "int16": "<i2", "uint16": "<u2",
    "int32": "<i4", "uint32": "<u4", "int64": "<i8", "uint64": "<u8", "float32": "<f4", "float64": "<f8",
}  # fmt: skip


class Unsupported(Exception):
    """No layout can be computed for this message; it may still be deserialised."""


@dataclass(frozen=True)
class Number:
    """A number of type `dtype` at byte `at`."""

    dtype: str
    at: int


@dataclass(frozen=True)
class Numbers:
    """A list of `count` numbers of type `dtype` from byte `at`."""

    dtype: str
    at: int
    count: int


@dataclass(frozen=True)
class Text:
    """A string whose `size` bytes (without the closing zero) start at byte `at`."""

    at: int
    size: int
    value: str


class Layout:
    """Layout of one little-endian CDR message. `root` maps field names to their contents, nested as the message is."""

    def __init__(self, message: bytes, msgtype: str, types: TypeFields) -> None:
        if len(message) < HEAD or int.from_bytes(message[:2], "little") != LITTLE_ENDIAN:
            raise Unsupported("byte order")
        self._message = message
        self._types = types
        self._at = HEAD
        self._parts = 0
        self.words: list[tuple[int, int]] = []  # position and value of every length word
        try:
            self.root: dict[str, Any] = self._part(msgtype)
        except (struct.error, KeyError, UnicodeDecodeError) as error:
            raise Unsupported(str(error)) from None
        if self._at > len(message):
            raise Unsupported("the message is too short")

    def _align(self, size: int) -> None:
        self._at += -(self._at - HEAD) % size

    def _length(self) -> int:
        self._align(4)
        (length,) = struct.unpack_from("<I", self._message, self._at)
        self.words.append((self._at, length))
        self._at += 4
        return length

    def _part(self, msgtype: str) -> dict[str, Any]:
        if self._at > len(self._message):
            raise Unsupported("the message is too short")
        return {name: self._walk(kind) for name, kind in self._types[msgtype][1]}

    def _walk(self, kind: Any) -> Any:
        if kind[0] == Nodetype.NAME:
            return self._part(kind[1])
        if kind[0] == Nodetype.BASE:
            return self._text() if kind[1][0] == "string" else self._numbers(kind[1][0], None)
        element, count = kind[1][0], kind[1][1] if kind[0] == Nodetype.ARRAY else self._length()
        if element[0] == Nodetype.BASE and element[1][0] != "string":
            return self._numbers(element[1][0], count)
        self._parts += count
        if self._parts > _PARTS_AT_MOST:
            raise Unsupported("long lists of sub-messages")
        return [self._walk(element) for _ in range(count)]

    def _numbers(self, base: str, count: int | None) -> Number | Numbers:
        dtype = NUMBERS[base]
        size = np.dtype(dtype).itemsize
        if count != 0:
            self._align(size)
        at = self._at
        self._at += size * (1 if count is None else count)
        return Number(dtype, at) if count is None else Numbers(dtype, at, count)

    def _text(self) -> Text:
        length = self._length()
        text = Text(self._at, max(0, length - 1), self._message[self._at : self._at + length - 1].decode())
        self._at += length
        return text

    def locate(self, field: Field) -> tuple[Number, list[Text]]:
        """The number at the path `field`, and the names of list entries on which its position depends.

        Raises LookupError when this message has no such entry.
        """
        here: Any = self.root
        above: list[dict[str, Any]] = []
        names: list[Text] = []
        for step in field.steps:
            if isinstance(step, tuple):
                step, used = _position(step[0], above, here)
                names += used
            if isinstance(here, dict):
                above.append(here)
                here = here[step]
            elif isinstance(here, Numbers):
                if step >= here.count:
                    raise IndexError(step)
                here = Number(here.dtype, here.at + step * np.dtype(here.dtype).itemsize)
            else:
                here = here[step]
        return here, names

    def fits(self, block: Block, numbers: list[Number], names: list[Text]) -> bool:
        """Whether `numbers` are at the same positions in all messages of the block, with the same `names`.

        Only the length words before the last number matter; anything after it may vary.
        """
        end = max((number.at + np.dtype(number.dtype).itemsize for number in numbers), default=HEAD)
        if int(block.size.min()) < end:
            return False
        constant = [(0, "<u2", LITTLE_ENDIAN)] + [(at, "<u4", value) for at, value in self.words if at < end]
        for name in dict.fromkeys(names):
            constant += [(name.at + i, "u1", self._message[name.at + i]) for i in range(name.size)]
        return all(
            (gather(block.buffer, block.start + at, kind) == value).all() for at, kind, value in constant
        )

    @staticmethod
    def read(block: Block, number: Number) -> NDArray[np.float64]:
        """The number in all messages of the block, float64[n]."""
        with np.errstate(invalid="ignore"):  # a signalling NaN is read like any other
            return gather(block.buffer, block.start + number.at, number.dtype).astype(np.float64)


def _position(name: str, above: list[dict[str, Any]], entries: Any) -> tuple[int, list[Text]]:
    """Position of the entry called `name`, from names within the entries or from the nearest list of names, and the
    names that decide it."""
    own = (
        [entry[key] for entry in entries for key in OWN_NAMES if key in entry]
        if isinstance(entries, list)
        else []
    )
    if own:
        position = next((number for number, text in enumerate(own) if text.value == name), None)
        if position is None:
            raise LookupError(name)
        return position, own[: position + 1]
    for part in reversed(above):
        for key in NAMES:
            listed = part.get(key)
            if isinstance(listed, list) and all(isinstance(text, Text) for text in listed):
                for position, text in enumerate(listed):
                    if text.value == name:
                        return position, listed[: position + 1]
                raise LookupError(name)
    raise LookupError(name)


def value_of(message: Any, field: Field) -> float:
    """The number at the path `field` in a deserialised message. Raises LookupError with the reason if there is none."""
    here = message
    above: list[Any] = []
    done = ""
    for step in field.steps:
        if isinstance(step, tuple):
            step = _index_of(step[0], above, here)
        if isinstance(step, str):
            above.append(here)
            here = getattr(here, normalize_fieldname(step))
            done = step
        elif step >= len(here):
            raise LookupError(f"{done} has {len(here)} entries")
        else:
            here = here[step]
    return float(here)


def _index_of(name: str, above: list[Any], entries: Any) -> int:
    own = [str(getattr(entry, key)) for entry in entries for key in OWN_NAMES if hasattr(entry, key)]
    if own:
        if name not in own:
            raise LookupError(f"it names {', '.join(own)}, but not {name}")
        return own.index(name)
    for part in reversed(above):
        for key in NAMES:
            listed = getattr(part, key, None)
            if isinstance(listed, list):
                if name not in listed:
                    raise LookupError(f"it names {', '.join(map(str, listed)) or 'nothing'}, but not {name}")
                return listed.index(name)
    raise LookupError(f"it has no entry called {name}")
