"""Notes about the records of several joints: one for each cause, with the joints that it concerns."""

import re
from collections.abc import Iterable, Mapping, Sequence

# a number of its own: not part of a name, such as q_1 or tau[2]
NUMBER = re.compile(r"(?<![\w.\[\"'#])-?\d+(?:\.\d+)?(?:e[-+]?\d+)?(?![\w\]\"']|\.\d)")


def notes_of_joints(notes: Mapping[str, Iterable[str]]) -> list[str]:
    """The notes of each joint as "joint, joint: note", those of equal words as one; numbers that differ are given from the smallest to the
    largest."""
    joints: dict[str, list[str]] = {}
    told: dict[str, list[str]] = {}
    for joint, said in notes.items():
        for words in dict.fromkeys(said):
            alike = NUMBER.sub("#", words)
            if joint in joints.get(alike, ()):  # a joint that has two of them: each is its own
                alike = words
            joints.setdefault(alike, []).append(joint)
            told.setdefault(alike, []).append(words)
    return [f"{', '.join(of)}: {_ranged(told[alike])}" for alike, of in joints.items()]


def _ranged(notes: Sequence[str]) -> str:
    """Notes that differ only in their numbers as one."""
    columns = zip(*(NUMBER.findall(one) for one in notes), strict=True)
    ranges = [sorted(dict.fromkeys(column), key=float) for column in columns]
    made = iter(one[0] if len(one) == 1 else f"{one[0]} to {one[-1]}" for one in ranges)
    return NUMBER.sub(lambda _: next(made), notes[0])
