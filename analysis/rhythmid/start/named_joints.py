"""Columns of joints with a name that also means something else: `velocity_Rotation` is the velocity of the joint
`rotation`, `tau_SP` beside `tau_ELBOW` the torque of the joint `sp`, not a set point, and `X_Current` beside `X_Position` and
`Y_Current` that of the axis `x` of a machine tool (ISO 841)."""

from collections.abc import Iterable
from dataclasses import replace

from rhythmid.record.inventory import Inventory, Recorded
from rhythmid.start.meaning import is_word, joint_of_column
from rhythmid.start.vocabulary import COMMANDED, CONTROLLED_SHORT, LETTERS, PLACES, WORDS, Quantity
from rhythmid.start.words import words_of

NAMING: tuple[Quantity, ...] = (
    "position",
    "effort",
)  # beside a word for a motion, they show that it is a name
# least number of joint names beside a word, each with all of its quantities, that make the word a joint name: a
# single one may be a sensor's
PEERS = 2
AXES = frozenset("x y z".split())  # axes of a machine tool, or directions of a vector


def with_joints(found: Inventory) -> Inventory:
    """The inventory with the joint of every column whose joint name could be taken for a quantity."""
    every = (*found.recorded, *found.constant)
    names = _joints_among(one.said for one in every if one.column)
    if not names:
        return found
    recorded, constant = (
        tuple(_named(one, names) for one in part) for part in (found.recorded, found.constant)
    )
    return replace(found, recorded=recorded, constant=constant)


def _joints_among(headings: Iterable[str]) -> frozenset[str]:
    """Words for motions that are used as names.

    Such a word occurs beside words for several quantities, as in position_Rotation and torque_Rotation, or in place
    of a word that is only a name, as in command_Rotation and command_Pitch.
    """
    split = [words_of(one) for one in headings]
    known = {tuple(words) for words in split}
    return frozenset(
        word for word in {one for words in known for one in words}
        if _is_one_of_many(word, known) or _is_axis(word, known)
        or (word in WORDS["position"] and (_beside_several(word, split) or _in_place_of_name(word, known)))
    )  # fmt: skip


def _is_one_of_many(word: str, known: set[tuple[str, ...]]) -> bool:
    """Whether a word occurs in place of names, with the same quantities as several of them: SP in q_SP, tau_SP,
    q_KNEE, tau_KNEE, q_HIP and tau_HIP, without columns called only q or tau."""
    if not (is_word(word) or word in CONTROLLED_SHORT) or word in LETTERS:
        return False
    frames = _frames(word, known)
    quantities = {quantity for begin, end in frames if (quantity := _quantity_of((*begin, *end))) is not None}
    if len(quantities) < 2 or any((*begin, *end) in known for begin, end in frames):
        return False
    within = [
        {words[len(begin)] for words in known if len(words) == len(begin) + 1 + len(end) and words == (*begin, words[len(begin)], *end)}
        for begin, end in frames
    ]  # fmt: skip
    peers = set.intersection(*within)
    return sum(_is_name(one) and one not in PLACES for one in peers) >= PEERS


def _is_axis(word: str, known: set[tuple[str, ...]]) -> bool:
    """Whether a letter is an axis with a motion and an effort of its own, as a second letter is: X in X_Position and
    X_Current beside Y_Position and Y_Current. The letters of a vector have one quantity."""
    if word not in AXES:
        return False
    own = _frames(word, known)
    if not set(NAMING) <= {quantity for frame in own for quantity in _said((*frame[0], *frame[1]), "")}:
        return False
    alone = any((*begin, *end) in known for begin, end in own)
    return not alone and any(own <= _frames(other, known) for other in AXES - {word})


def _frames(word: str, known: set[tuple[str, ...]]) -> set[tuple[tuple[str, ...], tuple[str, ...]]]:
    """The words before and after a word, in all names that contain it."""
    return {
        (words[:place], words[place + 1 :])
        for words in known
        for place, one in enumerate(words)
        if one == word
    }


def _quantity_of(words: Iterable[str]) -> Quantity | None:
    """The quantity denoted by words, or by one letter by convention."""
    words = list(words)
    said = sorted(_said(words, ""))
    return said[0] if said else next((LETTERS[one] for one in words if one in LETTERS), None)


def _beside_several(word: str, split: list[list[str]]) -> bool:
    beside = {quantity for words in split if word in words for quantity in _said(words, word)}
    return len(beside) > 1 and bool(beside & set(NAMING))


def _in_place_of_name(word: str, known: set[tuple[str, ...]]) -> bool:
    for words in known:
        for place, one in enumerate(words):
            if one != word or not (_said(words, word) or set(words) & COMMANDED):
                continue
            peers = (other for other in known if len(other) == len(words))
            if any(
                _is_name(other[place]) and other == (*words[:place], other[place], *words[place + 1 :])
                for other in peers
            ):
                return True
    return False


def _is_name(word: str) -> bool:
    """Whether a word only identifies a joint."""
    return not word.isdigit() and word not in LETTERS and bool(joint_of_column(word))


def _said(words: Iterable[str], but: str) -> set[Quantity]:
    """Quantities denoted by the other words."""
    return {quantity for quantity, known in WORDS.items() for one in words if one != but and one in known}


def _named(one: Recorded, names: frozenset[str]) -> Recorded:
    """The column with its joint, and without the joint's name in `said` where another word states the quantity."""
    words = words_of(one.said)
    own = names & set(words)
    if not one.column or not own:
        return one
    rest = [word for word in words if word not in own]
    joint = joint_of_column(one.said, one.side, own)
    told = _said(rest, "") if own <= WORDS["position"] else _quantity_of(rest)
    said = " ".join(rest) if told else one.said
    return replace(one, said=said, joint=joint)
