"""Message types: those that a bag defines itself, else those of ROS 2 Jazzy."""

from functools import lru_cache
from typing import Any

from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, TypesysError, get_types_from_idl, get_types_from_msg, get_typestore

from rhythmid.errors import InputError
from rhythmid.record.block import Topic
from rhythmid.record.field import TypeFields

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
    if topic.type in own and _parts(own) <= own.keys():
        return own
    types = {**standard_types().fielddefs, **own}
    if topic.type not in types or not _parts(own) <= types.keys():
        raise InputError(
            f"{topic.name}: the bag does not define its type {topic.type!r}, which is not a standard type"
        )
    return types


def _own_types(topic: Topic) -> dict[str, Any]:
    """Types that the bag defines for the topic; one that cannot be parsed is as good as none."""
    try:
        if topic.definition_format == "ros2msg":
            return get_types_from_msg(topic.definition, topic.type)
        if topic.definition_format in ("ros2idl", "omgidl"):
            parts = topic.definition.split(_SEPARATOR)
            texts = [part.split("\n", 1)[1] for part in parts if part.startswith("IDL: ")] or [
                topic.definition
            ]
            return {name: fields for text in texts for name, fields in get_types_from_idl(text).items()}
    except (TypesysError, KeyError, IndexError, ValueError):
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
    store.register(dict(type_fields(topic)))
    return store


def stamp_path(topic: Topic) -> str | None:
    """Path of the time stamp in the topic's messages: of its header, else its own; None if there is none."""
    types = type_fields(topic)
    fields = dict(types[topic.type][1])
    if fields.get("header") == (Nodetype.NAME, "std_msgs/msg/Header"):
        return "header.stamp"
    return "stamp" if fields.get("stamp") == (Nodetype.NAME, "builtin_interfaces/msg/Time") else None
