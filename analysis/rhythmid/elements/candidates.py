"""Elements that could be missing from a model, with first guesses; and the elements that are not tried, with the
reasons."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from rhythmid.elements.element import OFTEN_ENOUGH, Element, Scales
from rhythmid.elements.first_guess import NoGuess

STIFFNESS = "stiffness"  # the family of the forces that bring a position back
DRIFT = "drift"  # the family of the laws of the time
IDLE = "no command, forcing or controller drives the machine"
# along such a motion the way before sliding is a spring from wherever the record begins, and with a state of its own in each
# window a constant force of each
NEVER_REVERSED = "the motion never comes back, and without reversals nothing but the first way shows what it does before it slides"
STEADY = "the drive passes through each level only once in the same direction in each record, which does not show that its effect changes with time"
ONE_WAY = "nothing in the model restores the position, and the motion never comes back, so a force that depends on position cannot be distinguished from one that depends on speed or time"
UNPRESSED = "the motion never comes back, and nothing drives it on where it rests, so a stop cannot be distinguished from friction"
DYING = "nothing drives the motion, and it meets each speed once, so a law of the time or of the past cannot be distinguished from one of the speed"
LEVEL = "the drive never changes within a record, which shows no delay, lag or memory on its way"


@dataclass(frozen=True)
class Setting:
    """Properties of a model that decide which effects it could lack.

    `present` holds its terms as (element, what it acts against); `parameters` and `free` are the names of all and
    of the estimated parameters; `rotational` says whether positions are angles, `controlled` whether a controller
    closes the loop, `restored` whether a force depends on the position.
    """

    present: frozenset[tuple[str, str | None]]
    parameters: frozenset[str]
    free: frozenset[str]
    rotational: bool = False
    controlled: bool = False
    restored: bool = False


@dataclass(frozen=True)
class Candidates:
    """`tried` are first guesses of elements; `not_tried` gives, by name, the reason why a candidate of the
    catalogue has none."""

    tried: tuple[tuple[Element, dict[str, float]], ...]
    not_tried: Mapping[str, str]


def candidates(catalogue: Mapping[str, Element], setting: Setting, scales: Scales) -> Candidates:
    """First guesses of all elements that a model with this setting could lack, for records with these scales.

    Where the input displaces the base, friction and dampers are tried both against the base and against the room.
    The latter are elements of the same name with `Element.against` set to the room.
    """
    tried: list[tuple[Element, dict[str, float]]] = []
    not_tried: dict[str, str] = {}
    for name, element in catalogue.items():
        if not element.candidate:
            continue
        reasons = [(one, _unsuitable(one, setting, scales)) for one in variants(element, scales)]
        suitable = [one for one, reason in reasons if reason is None]
        if not suitable:
            not_tried[name] = reasons[0][1] or ""
            continue
        try:
            starts = element.first_guesses(scales)
        except NoGuess as reason:
            not_tried[name] = str(reason)
            continue
        if not starts:
            not_tried[name] = "the motion is too small or too slow to show it"
        tried += [(one, dict(start)) for one in suitable for start in starts]
    return Candidates(tuple(tried), not_tried)


def variants(element: Element, scales: Scales) -> tuple[Element, ...]:
    """The element in its possible forms: on a moving base, a friction or a damper against the base or against the
    room."""
    if element.against is None or not scales.displaced_base:
        return (element,)
    return element.acting_against("base"), element.acting_against("room")


def _unsuitable(element: Element, setting: Setting, scales: Scales) -> str | None:
    """Reason why an element cannot be the missing effect; None where it can."""
    names = {name for name, _ in setting.present}
    there = (element.name, element.against) in setting.present
    if not element.repeats and (there or (element.name in names and not scales.displaced_base)):
        return "the model has it"
    for other in element.needless_with if element.against != "room" else ():
        if other in names or other in setting.free:
            return (
                f"{other} is in the model and does the same"
                if other in names
                else f"{other} is free and does the same"
            )
    if element.rotational and not setting.rotational:
        return "it needs an angle as position"
    if element.controlled and not setting.controlled:
        return "it needs a controller in the model"
    if scales.idle and (element.driven or element.slot in ("command", "actuator", "timing")):
        return IDLE
    # what it does comes back with each turn
    turns = element.rotational and scales.high - scales.low >= 2.0 * math.pi
    one_way = not (setting.restored or scales.comes_back or turns)
    if (element.family == STIFFNESS or element.placed) and one_way:
        return ONE_WAY
    if element.stops and one_way and not scales.pressed:
        return UNPRESSED
    if scales.idle and scales.once and one_way and (element.states or element.family == DRIFT):
        return DYING
    if element.reversing and not scales.comes_back:
        return NEVER_REVERSED
    if (reason := _untold_by_levels(element, setting, scales)) is not None:
        return reason
    if element.displaced_base and not scales.displaced_base:
        return "it needs an input that displaces the base"
    for source, default in element.borrows.values():
        if default is None and source not in setting.parameters:
            return f"it needs {source.split('.')[0]}, which the model does not have"
    return None


def _untold_by_levels(element: Element, setting: Setting, scales: Scales) -> str | None:
    """Reason why a drive that is constant in each record, or only begins with it, does not show an element.

    Its levels show static laws of the actuator. A delay, lag or memory shows where the drive changes, and a change of
    gain, delay or clock with time where it does the same twice. A controller's output changes all the
    time, but not its reference.
    """
    dynamic = element.slot in ("command", "timing") or (
        element.slot == "actuator" and bool(element.own or element.history or element.delay)
    )
    if element.drifts and scales.changes < OFTEN_ENOUGH and (element.delay or not setting.controlled):
        return STEADY if scales.changes else LEVEL
    return LEVEL if dynamic and scales.changes == 0 and not setting.controlled else None
