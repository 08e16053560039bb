"""Message types: those defined in the bag itself, else those of ROS 2 Jazzy."""

from functools import lru_cache
from typing import Any

from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, TypesysError, get_types_from_idl, get_types_from_msg, get_typestore

from rhythmid.errors import InputError
from rhythmid.record.block import Topic
from rhythmid.record.field import TypeFields

STANDARD_DISTRO = "jazzy"  # ROS distribution of the standard types
TIME_PARTS = (("sec", "int32"), ("nanosec", "uint32"))
LENGTH_WORD = 4  # bytes before a string or list
LEAST_TEXT = LENGTH_WORD + 1  # with the closing zero
LARGEST_FIXED = 1 << 28  # largest fixed size [bytes] of a type; larger messages are not sent
# largest number of strings or messages in a fixed array: each becomes lines of code
MOST_FIXED_PARTS = 10_000
_SEPARATOR = "=" * 80 + "\n"


@lru_cache(maxsize=1)
def standard_types() -> Any:
    """rosbags' store of the standard types of ROS 2 Jazzy; a tenth of a second to load."""
    return get_typestore(Stores.ROS2_JAZZY)


@lru_cache(maxsize=64)
def type_fields(topic: Topic) -> TypeFields:
    """Fields of the topic's type and of all types within it. Raises InputError when they are unknown."""
    if topic.encoding != "cdr":
        raise InputError(
            f"{topic.name}: its messages are encoded as {topic.encoding!r}; only 'cdr' can be read"
        )
    own = _own_types(topic)
    types = own
    if topic.type not in own or not _parts(own) <= own.keys():
        types = {**standard_types().fielddefs, **own}
    if topic.type not in types or not _parts(own) <= types.keys():
        raise InputError(
            f"{topic.name}: the bag does not define its type {topic.type!r}, which is not a standard type"
        )
    try:
        _check_size(types, topic.type, {})
    except (InputError, RecursionError) as error:
        raise InputError(f"{topic.name}: its type {topic.type!r} cannot be read: {error}") from None
    return types


def _check_size(types: TypeFields, name: str, sizes: dict[str, int | None]) -> int:
    """Least size [bytes] of a message, without padding. `sizes` collects those of its parts, None while one is
    being computed.

    Raises InputError for impossible types: those that contain themselves, that need more bytes than any message, or
    that need none, so that a few bytes would claim billions of them.
    """
    if name in sizes:
        if (known := sizes[name]) is None:
            raise InputError(f"{name} holds itself")
        return known
    sizes[name] = None
    size = sum(_least(types, kind, sizes) for _, kind in types[name][1])
    if not 0 < size <= LARGEST_FIXED:
        raise InputError(f"every {name} would take {size} bytes")
    sizes[name] = size
    return size


def _least(types: TypeFields, kind: Any, sizes: dict[str, int | None]) -> int:
    if kind[0] == Nodetype.NAME:
        return _check_size(types, kind[1], sizes)
    if kind[0] == Nodetype.BASE:
        return LEAST_TEXT if "string" in kind[1][0] else 1
    element, count = kind[1]
    each = _least(types, element, sizes)
    if kind[0] == Nodetype.SEQUENCE:
        return LENGTH_WORD
    single = element[0] == Nodetype.BASE and "string" not in element[1][0]
    if not single and count > MOST_FIXED_PARTS:
        raise InputError(f"it holds a fixed array of {count} parts")
    return count * each


def _own_types(topic: Topic) -> dict[str, Any]:
    """Types that the bag defines for the topic; one that cannot be parsed counts as missing."""
    try:
        if topic.definition_format == "ros2msg":
            return get_types_from_msg(topic.definition, topic.type)
        if topic.definition_format in ("ros2idl", "omgidl"):
            parts = topic.definition.split(_SEPARATOR)
            texts = [part.split("\n", 1)[1] for part in parts if part.startswith("IDL: ")] or [
                topic.definition
            ]
            return {name: fields for text in texts for name, fields in get_types_from_idl(text).items()}
    except (TypesysError, LookupError, ValueError, RecursionError):
        pass
    return {}


def _parts(types: TypeFields) -> set[str]:
    """Names of the message types that occur as fields of `types`."""
    found: set[str] = set()
    for _, fields in types.values():
        for _, kind in fields:
            while kind[0] in (Nodetype.ARRAY, Nodetype.SEQUENCE):
                kind = kind[1][0]
            if kind[0] == Nodetype.NAME:
                found.add(kind[1])
    return found


@lru_cache(maxsize=64)
def typestore(topic: Topic) -> Any:
    """A rosbags Typestore that deserialises the topic's messages."""
    store = get_typestore(Stores.EMPTY)
    try:
        store.register(dict(type_fields(topic)))
    except (TypesysError, SyntaxError, NameError) as error:  # NameError: for an infinite constant
        raise InputError(f"{topic.name}: its type {topic.type!r} cannot be read: {error}") from None
    return store


def stamp_path(topic: Topic) -> str | None:
    """Path of the timestamp in the topic's messages: in the header, else in the message itself; None if there is none."""
    types = type_fields(topic)
    time = (Nodetype.NAME, "builtin_interfaces/msg/Time")
    fields = dict(types[topic.type][1])
    path = "stamp"
    if fields.get("header") == (Nodetype.NAME, "std_msgs/msg/Header"):
        path, fields = "header.stamp", dict(types["std_msgs/msg/Header"][1])
    if fields.get("stamp") != time:
        return None
    kinds = dict(types["builtin_interfaces/msg/Time"][1])
    whole = all(kinds.get(part) == (Nodetype.BASE, (base, 0)) for part, base in TIME_PARTS)
    return path if whole else None  # a bag may define its own types under standard names
