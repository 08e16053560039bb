"""Laws at a limit of their parameters, where they are another law: a hysteresis that never yields is a spring."""

from collections.abc import Sequence

from rhythmid.diagnose.constants import EDGE
from rhythmid.diagnose.search.trial import Trial
from rhythmid.diagnose.shape import within_bounds
from rhythmid.elements.element import Element
from rhythmid.identify.record_scales import scales
from rhythmid.identify.series import Series


def without_limits(found: Sequence[Trial], series: Sequence[Series]) -> list[Trial]:
    """The trials without those whose newest law is at a limit of its range, where a special case of that law was fitted, too.

    The law at its limit fits a little better than the special case, because it has more parameters. But further effects are then
    judged beside a law that is no hypothesis of its own.
    """
    return [
        one
        for one in found
        if not (_at_limit(one, series) and any(_is_special_case(other, one) for other in found))
    ]


def _newest(trial: Trial) -> Element:
    return trial.element(trial.added[-1])


def _at_limit(trial: Trial, series: Sequence[Series]) -> bool:
    term = trial.model.term(trial.added[-1])
    return term is not None and within_bounds(term, scales(series, trial.model)) < EDGE


def _is_special_case(plain: Trial, rich: Trial) -> bool:
    """Whether two trials differ only in their newest effect, which in the first is a special case of that in the second."""
    return plain.added[:-1] == rich.added[:-1] and _newest(rich).name in _newest(plain).special_case_of
