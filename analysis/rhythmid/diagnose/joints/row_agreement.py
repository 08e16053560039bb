"""The rows of the joints agree with what the answer of the machine states at them.

A joint is judged as a machine with one axis. There a longer delay, or a value that is freed, is left to the author of the model, and what was
corrected leaves nothing to be found. The answer of the machine names such causes, and then the joint lacks them.
"""

from collections.abc import Collection, Iterable, Mapping
from dataclasses import replace

from rhythmid.diagnose.answer.result import Diagnosis
from rhythmid.diagnose.joints.joint_answer import JointEffect
from rhythmid.report.quantity import in_words


def words_of(one: JointEffect) -> str:
    """An effect in words, such as "the mass of shank" or "coulomb friction"."""
    return f"the {one.of_link}" if one.link else in_words(one.element)


def agreeing(
    answers: Mapping[str, Diagnosis], stated: Iterable[JointEffect], elsewhere: Mapping[str, Collection[str]]
) -> dict[str, Diagnosis]:
    """The answers with the verdict "missing physics" at the joints of effects that are `stated`, and why.

    `elsewhere` are joints whose own search has found the value of a link that another joint moves, with the words for it.
    """
    named: dict[str, dict[str, None]] = {joint: dict.fromkeys(words) for joint, words in elsewhere.items()}
    for one in stated:
        if one.joint is not None:
            named.setdefault(one.joint, {})[words_of(one)] = None
    return {
        joint: replace(
            answer, verdict="missing_physics", summary=f"The model is wrong in {' and '.join(named[joint])}."
        )
        if joint in named and answer.verdict in ("undecided", "consistent")
        else answer
        for joint, answer in answers.items()
    }
