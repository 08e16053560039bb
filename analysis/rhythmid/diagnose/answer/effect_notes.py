"""Notes about the effects that an answer names."""

from collections.abc import Mapping

from rhythmid.diagnose.constants import VAGUE
from rhythmid.diagnose.size_error import departure
from rhythmid.diagnose.verdict import Decision
from rhythmid.identify.output_error import Fit
from rhythmid.model import Term
from rhythmid.report.quantity import with_std, with_written_unit


def own_sizes(decision: Decision, fit: Fit, size_errors: Mapping[str, float]) -> tuple[str, ...]:
    """A sentence for each stated effect whose size is determined beside the others, but whose standard deviation in the answer is large.

    The probability of a name follows from the first: whether the records show the effect. The second contains other sizes of the other
    effects and the values of other explanations, for example with another scale of the effort.

    Parameters
    ----------
    decision, fit : the decision, and the fit of the chosen model with the standard deviations that the answer states.
    size_errors : relative standard deviations of the effects' sizes beside the others in that fit alone, by label.
    """
    if decision.verdict != "missing_physics":
        return ()
    found = []
    for label in decision.named:
        term = fit.model.term(label)
        if term is None or label not in size_errors:
            continue
        name, value, size = f"{label}.{term.element.size}", term.values[term.element.size], departure(term)
        own = size_errors[label] * size
        if size_errors[label] <= VAGUE and fit.std.get(name, 0.0) > VAGUE * size:
            told = with_written_unit(with_std(value.value, own), value.unit)
            found.append(
                f"{name}: {told} beside the other effects as they were found, from which the probability of the name follows. The larger standard "
                "deviation of the answer contains other sizes of those effects, and other explanations, which may scale all forces otherwise."
            )
    return tuple(found)


def same_while_moving(term: Term | None, where: str = "") -> tuple[str, ...]:
    """A sentence with the sizes of other effects that give the same force while the machine moves, so that only its rests separate them.

    Empty for an effect of which none are known. `where` is the joint of a machine.
    """
    if term is None or term.element.moving_as is None:
        return ()
    unit = next(value.unit for name, value in term.values.items() if name == term.element.size)
    others = " and ".join(
        f"{name} of {with_written_unit(f'{size:.3g}', unit)}"
        for name, size in term.element.moving_as(**term.numbers)
    )
    return (
        f"{where}{term.label}: while the machine moves this is the same as {others}, such as a weight or a zero of the effort. Only rests "
        "under several efforts separate them.",
    )
