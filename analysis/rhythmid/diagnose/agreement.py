"""Agreement of the scoring modes: which of several answers to the same records contradict the chosen one."""

from collections.abc import Mapping, Sequence

from rhythmid.diagnose.answer.result import Diagnosis
from rhythmid.diagnose.constants import LEFT
from rhythmid.diagnose.effort.candidate import SEEN
from rhythmid.diagnose.hypothesis import ScoringKind, Verdict
from rhythmid.report.quantity import in_words

HOW: Mapping[ScoringKind, str] = {"free_run": "in free run", "windows": "in windows", "effort": "by effort"}
# verdicts that neither state a name nor deny a mismatch
UNSETTLED: tuple[Verdict, ...] = ("undecided", "unknown_physics")
DOUBTED = "Believe neither without another experiment."


def effort_suffices(found: Diagnosis, disturbed: bool) -> bool:
    """Whether effort scoring leaves nothing that the motion could tell: little effort, and nothing without a name.

    A free run that small errors of the effort disturb tells less than even a little effort: that of a quasi-static machine, whose
    motion is a small difference of large forces, or that of a machine whose recorded effort has more noise than its motion.
    """
    return found.augmented.train_nrmse < LEFT and (found.verdict not in UNSETTLED or disturbed)


def contradictions(chosen: int, made: Sequence[Diagnosis]) -> tuple[str, ...]:
    """A sentence for each diagnosis that contradicts the one at the index `chosen`.

    The diagnosis of the most informative scoring mode comes first. If a less informative one names nothing, that does not contradict
    stated names.
    """
    found = made[chosen]
    stands = found.verdict == "missing_physics"
    weaker = [one for one in made[chosen + 1 :] if not (stands and one.verdict in UNSETTLED)]
    told = [_difference(found, other) for other in (*made[:chosen], *weaker)]
    return tuple(one for one in told if one is not None)


def _difference(found: Diagnosis, other: Diagnosis) -> str | None:
    """One sentence: how the result of another scoring mode contradicts an answer.

    None where they agree, or where the other mode could not show the named effects.
    """
    scored = f"Scored {HOW[other.scoring.kind]} the same records"
    names, others = ({effect.element for effect in one.missing} for one in (found, other))
    if found.verdict == other.verdict:
        if found.verdict != "missing_physics" or names & others:
            return None
        words = in_words(" and ".join(sorted(others)))
        return f"{scored} stand by another name: {words}. {DOUBTED}"
    if found.verdict == "missing_physics" and other.verdict == "consistent":
        hidden = other.scoring.kind == "effort" and not any(one.slot in SEEN for one in found.missing)
        return None if hidden else f"{scored} lack nothing of practical size. {DOUBTED}"
    return f"{scored} come to another verdict. {other.summary}"
