"""Unnamed list entries beside a list of the same message type with names: `position[2]` belongs to the joint that
is third in that list."""

from collections import defaultdict
from dataclasses import replace

from rhythmid.record.inventory import Inventory, Recorded

NUMBER = "#"  # start of the name of an unnamed entry's joint


def with_listed_joints(found: Inventory) -> Inventory:
    """The inventory with the joint of every such entry. It is unchanged where the named lists of a type differ in
    length from the list, or in their names."""
    names: dict[str, set[tuple[str, ...]]] = defaultdict(set)
    for topic, joints in _joints_by_topic(found).items():
        if not any(joint.startswith(NUMBER) for joint in joints):
            names[topic[1]].add(joints)
    one_list = {type_: next(iter(lists)) for type_, lists in names.items() if len(lists) == 1}
    counts = {topic: len(joints) for topic, joints in _joints_by_topic(found).items()}

    def told(one: Recorded) -> Recorded:
        listed = one_list.get(one.type, ())
        if not one.joint.startswith(NUMBER) or counts[one.topic, one.type] != len(listed):
            return one
        return replace(one, joint=listed[int(one.joint.removeprefix(NUMBER))])

    recorded, constant = (tuple(map(told, part)) for part in (found.recorded, found.constant))
    return replace(found, recorded=recorded, constant=constant)


def _joints_by_topic(found: Inventory) -> dict[tuple[str, str], tuple[str, ...]]:
    """The joints of every topic and type, in the order of their messages."""
    order: dict[tuple[str, str], list[str]] = defaultdict(list)
    for one in found.listed:
        if one.joint and one.joint not in order[one.topic, one.type]:
            order[one.topic, one.type].append(one.joint)
    return {topic: tuple(joints) for topic, joints in order.items()}
