"""Notes about the records of several joints: one for each cause, with the joints that it concerns."""

from collections.abc import Iterable, Mapping


def notes_of_joints(notes: Mapping[str, Iterable[str]]) -> list[str]:
    """The notes of each joint as "joint, joint: note", those of equal words as one."""
    joints: dict[str, list[str]] = {}
    for joint, said in notes.items():
        for words in dict.fromkeys(said):
            joints.setdefault(words, []).append(joint)
    return [f"{', '.join(of)}: {words}" for words, of in joints.items()]
