"""Meaning of a recorded number from its name, unit and message type: its quantity, and whether it is commanded or
measured."""

import re
from collections.abc import Collection
from dataclasses import dataclass

from rhythmid.record.inventory import Recorded, StatedRole
from rhythmid.start.derivative_words import order_of, words_of_order
from rhythmid.start.vocabulary import (
    BASE,
    BY_UNIT,
    COMMANDED,
    COMMANDED_COLUMNS,
    COMMANDED_LETTERS,
    CONTROLLED,
    CONTROLLED_SHORT,
    COUNTED,
    DEVICES,
    DRIVING,
    DUTY,
    ELECTRICAL,
    FORCES,
    FORCING,
    GAUGES,
    IGNORED,
    IN_SI,
    JOINT,
    LETTERS,
    MEASURED,
    MECHANICAL,
    MODELLED,
    MOTION,
    MOTIONS,
    NO_EFFORT,
    PLACES,
    POSED,
    PULSED,
    READ,
    SHAKEN,
    WITH_MEANING,
    WORDS,
    Quantity,
)
from rhythmid.start.words import words_of


@dataclass(frozen=True)
class Meaning:
    """Meaning of a number by its name: None where nothing is stated. `reason` is a phrase, `certain` whether a word
    or unit states it."""

    quantity: Quantity | None
    commanded: bool | None
    forcing: bool
    base: bool
    joint: str
    reason: str
    certain: bool


def is_word(word: str) -> bool:
    """Whether a word has a known meaning, so that it is no name."""
    return word in WITH_MEANING


def meaning_of(one: Recorded) -> Meaning:
    """Meaning of a recorded number by the role that the user gives it, else by its name, unit and type."""
    near, far = words_of(one.said), words_of(one.topic)
    quantity, reason, certain = _quantity(one, near, far)
    every = {*near, *far}
    commanded: bool | None = None
    of_column = set() if one.topic else set(near) & COMMANDED_COLUMNS
    letters = set() if one.topic or certain else set(near) & COMMANDED_LETTERS
    of_controller = _controlled(one, near) if quantity == "effort" and certain else set[str]()
    pulsed = set(near) & PULSED if one.unit == "s" else set[str]()
    if asked := (every & COMMANDED) | of_column | letters | of_controller | pulsed:
        commanded = True
        reason += f"; {_one(near + far, asked)!r} says that it was asked for"
    elif every & MEASURED or one.type in (
        "sensor_msgs/msg/JointState",
        "sensor_msgs/msg/Imu",
        "nav_msgs/msg/Odometry",
        "tf2_msgs/msg/TFMessage",
    ):
        commanded = False
    elif quantity == "effort" and (set_by := set(near) & DUTY):
        commanded = True
        reason += f"; a {_one(near, set_by)!r} is set, not measured"
    forcing = bool(every & FORCING)
    base = bool(every & BASE)
    if (
        every & SHAKEN
        and quantity in ("position", "acceleration")
        and not (one.unit or "m").startswith("rad")
    ):
        base, commanded = True, None
    joint = one.joint or ("" if one.topic else joint_of_column(one.said, one.side))
    found = Meaning(quantity, commanded, forcing, base, joint, reason.removeprefix("; "), certain)
    return found if one.stated is None else _of_role(found, one.stated)


def _of_role(found: Meaning, role: StatedRole) -> Meaning:
    """The meaning of a number whose role is stated; its name or unit still says which motion it is, and who set it."""
    driving, base = role in ("input", "forcing"), role == "base"
    motion = found.quantity if found.quantity in MOTIONS else None if role == "reference" else "position"
    commanded = found.commanded if driving else role == "reference"
    quantity = "effort" if driving else motion
    return Meaning(quantity, commanded, role == "forcing", base, found.joint, "it was stated", certain=True)


def is_measured_effort(one: Recorded) -> bool:
    """Whether it is an effort as it acts: one that is said to be measured, or the current of a motor, where none was asked for."""
    meaning = meaning_of(one)
    if meaning.quantity != "effort" or meaning.commanded is True:
        return False
    return meaning.commanded is False or force_unit_of(one) == "A"


def is_ignored(one: Recorded) -> bool:
    """Whether its name says that it is neither a motion nor a driving signal."""
    near = words_of(one.said)
    of_effort = _plain_quantity(one, near, [])[0] == "effort" and order_of(near, MOTION)[0] > 0
    return bool({*near, *words_of(one.topic)} & IGNORED) or derivative_of(one) >= len(MOTIONS) or of_effort


def is_counted(one: Recorded) -> bool:
    """Whether its name says that a computer counts or sets it."""
    return bool({*words_of(one.said), *words_of(one.topic)} & COUNTED)


def is_no_effort(one: Recorded) -> bool:
    """Whether its name says that it is no driving signal."""
    return bool({*words_of(one.said), *words_of(one.topic)} & NO_EFFORT)


def force_unit_of(one: Recorded) -> str:
    """Unit of the driving signal, by its heading or a word for a motor's supply; empty where neither states it."""
    if one.unit:
        return one.unit
    for word in (*reversed(words_of(one.said)), *reversed(words_of(one.topic))):
        if unit := next((unit for unit, names in ELECTRICAL.items() if word in names.split()), ""):
            return unit
        if word in MECHANICAL:  # the present torque, not a current
            return ""
    return ""


def tells_unit(one: Recorded) -> bool:
    """Whether its unit is stated by a heading or by a ROS message type, which is in SI units by REP 103."""
    return bool(one.unit) or one.type.startswith(IN_SI)


def is_lone_v(one: Recorded) -> bool:
    """Whether its only name is `v`: a velocity, or a driving voltage."""
    return words_of(one.said) == ["v"] and not one.unit


def driving_unit_of(one: Recorded) -> str:
    """Unit of the driving signal, where `v` can only be a voltage."""
    return force_unit_of(one) or ("V" if is_lone_v(one) else "")


def poses(one: Recorded) -> bool:
    """Whether its name denotes a reference of a motion: a target, a set point, an `r` that does not mean right."""
    return bool({*words_of(one.said), *words_of(one.topic)} & POSED) or words_of(one.said) == ["r"]


def says_that_it_drives(one: Recorded) -> bool:
    """Whether its name says that it drives the machine, whatever its quantity."""
    return bool({*words_of(one.said), *words_of(one.topic)} & DRIVING)


def says_base(one: Recorded) -> bool:
    """Whether a word of its name refers to the base."""
    return bool({*words_of(one.said), *words_of(one.topic)} & BASE)


def names_a_place(one: Recorded) -> bool:
    """Whether its name states the location or the device of the measurement."""
    return bool({*words_of(one.said), *words_of(one.topic)} & PLACES)


def letter_of(one: Recorded) -> str:
    """The single letter for a quantity in its name; empty where there is none, or several."""
    letters = [word for word in words_of(one.said) if word in LETTERS]
    return letters[0] if letters else ""


def doubt_of_letter(one: Recorded) -> str:
    """Doubt about a quantity that is denoted by one letter of a name beside unknown words; empty where there are none.

    A joint's name is such a word, too.
    """
    if meaning_of(one).certain or not (letter := letter_of(one)):
        return ""
    unknown = [word for word in words_of(joint_of_column(one.said)) if len(word) > 1 and not word.isdigit()]
    if not unknown or one.topic:
        return ""
    listed = ", ".join(map(repr, unknown))
    return f"the letter {letter!r} is all that says it, beside {listed}, which is a joint's name or something else: set kind and unit"


def differ_in_number(one: Recorded, other: Recorded) -> bool:
    """Whether two names differ only in a number, like those of two joints or sensors."""
    first, second = ([word for word in words_of(each.said) if not word.isdigit()] for each in (one, other))
    return first == second and one.said != other.said


def of_one_array(one: Recorded, other: Recorded) -> bool:
    """Whether two columns are entries of one array, or are named as measured and differ only in a number: one
    quantity of two joints."""
    if one.topic or other.topic or one.column == other.column:
        return False
    first, second = (re.sub(r"\[\d+\]", "[]", each.column) for each in (one, other))
    return (first == second and "[]" in first) or (differ_in_number(one, other) and says_who_asks(one))


def same_joint(one: str, other: str) -> bool:
    """Whether two names denote the same joint: ignoring the word joint, case, and separators."""
    first, second = ([word for word in words_of(each) if word not in JOINT] for each in (one, other))
    return bool(first) and first == second


def says_who_asks(one: Recorded) -> bool:
    """Whether a word of its name says that it was commanded, or that it was measured."""
    return bool({*words_of(one.said), *words_of(one.topic)} & (COMMANDED | MEASURED))


def says_it_was_read(one: Recorded) -> bool:
    """Whether a word of its name says that it is a sensor reading."""
    return bool({*words_of(one.said), *words_of(one.topic)} & READ)


def is_modelled(one: Recorded) -> bool:
    """Whether its name says that it is one part of an effort, which only a model separates from the others."""
    return bool(set(words_of(one.said)) & MODELLED) and not says_it_was_read(one)


def _controlled(one: Recorded, near: list[str]) -> set[str]:
    """Words of an effort's name for a controller's output; empty where a word says that it was measured."""
    words = set(near)
    if words & READ:
        return set()
    of_force = bool(words & FORCES) or one.unit == "N"
    return words & (CONTROLLED if of_force else CONTROLLED | CONTROLLED_SHORT)


def derivative_of(one: Recorded) -> int:
    """Order of the derivative of a position that its name states; 0 where it states none. Above 2 it is no motion
    that a sensor measures."""
    near = words_of(one.said)
    order, _ = order_of(near, MOTION)
    plain = _plain_quantity(one, near, words_of(one.topic))[0]
    # theta_dot_vel says twice that it is a velocity
    of_position = plain not in MOTIONS or not WORDS["position"].isdisjoint(near)
    return order if not order or of_position else order + MOTIONS.index(plain)


def _quantity(one: Recorded, near: list[str], far: list[str]) -> tuple[Quantity | None, str, bool]:
    plain, order = _plain_quantity(one, near, far), derivative_of(one)
    if not order or one.unit in BY_UNIT or plain[0] == "effort":
        return plain
    said = f"its name says {order_of(near, MOTION)[1]!r}"
    return MOTIONS[order] if order < len(MOTIONS) else None, said, True


def _plain_quantity(one: Recorded, near: list[str], far: list[str]) -> tuple[Quantity | None, str, bool]:
    """The quantity, its reason and whether it is certain, without the words for a derivative."""
    if one.unit in ELECTRICAL and (motion := _motion_word(near)):
        return motion[1], f"its name says {motion[0]!r}, and a sensor's volts or amperes are no effort", True
    if one.unit in ELECTRICAL and (gauge := set(near) & GAUGES):
        return (
            "effort",
            f"its name says {_one(near, gauge)!r}, of which the volts or amperes are in proportion to an effort",
            False,
        )
    if one.unit == "s" and (pulsed := set(near) & PULSED):
        return (
            "effort",
            f"its name says {_one(near, pulsed)!r}, and its heading the width of a pulse ({one.written_unit})",
            True,
        )
    if one.unit in BY_UNIT:
        return BY_UNIT[one.unit], f"its heading says {one.written_unit}", True
    for words, where in ((near, "name"), (far, "topic")):
        for word in reversed(words):
            for quantity, known in WORDS.items():
                if word in known:
                    return quantity, f"its {where} says {word!r}", True
    for word in (*reversed(near), *reversed(far)):
        if word in DEVICES:
            return DEVICES[word], f"its name says {word!r}", True
    # of what a controller gives out, a letter is an axis or a channel
    for word in () if set(near) & CONTROLLED else reversed(near):
        if word in LETTERS:
            return LETTERS[word], f"{word!r} usually stands for that", False
    return None, "", False


def _motion_word(near: list[str]) -> tuple[str, Quantity] | None:
    """The word for a motion in the name, and its quantity; None where the last word for a quantity means an effort."""
    for word in reversed(near):
        for quantity, known in WORDS.items():
            if word in known:
                return None if quantity == "effort" else (word, quantity)
    return None


def _one(words: list[str], known: Collection[str]) -> str:
    return next(word for word in words if word in known)


def joint_of_column(said: str, side: str = "", names: Collection[str] = ()) -> str:
    """The part of a name that distinguishes a column from others of the same quantity: `3` of dof_pos[3], `knee` of
    knee_pos. `names` are words that are names here."""
    words = words_of(said)
    known = WITH_MEANING | set(LETTERS) | words_of_order(words)
    if set(words) & (WORDS["effort"] - FORCES):
        known |= CONTROLLED_SHORT
    left = [word for word in words if word in names or word not in known]
    return "_".join([*([side] if side else []), *left])
