"""Sizes that one explanation determines, and that other explanations put elsewhere."""

from collections.abc import Mapping

from rhythmid.diagnose.constants import VAGUE
from rhythmid.diagnose.size_error import departure
from rhythmid.diagnose.verdict import Decision
from rhythmid.identify.output_error import Fit
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
