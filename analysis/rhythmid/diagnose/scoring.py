"""Choose how motion is scored: in free run where that is meaningful, otherwise in windows.

A free run is not meaningful where the machine integrates, or where the nominal model does not follow it at all: a score along a
trajectory that the machine never took does not show what the model lacks. Windows with initial states of their own are then
shortened until the model follows the machine through them. (Recorded effort is scored by inverse dynamics, see `effort`.)
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from itertools import takewhile

import numpy as np

from rhythmid.deadline import time_is_up
from rhythmid.diagnose.baseline import Calibration, calibrate, reconstructed
from rhythmid.diagnose.constants import BETTER_STEP, BETTER_TOGETHER, FOLLOWS, HOPELESS, PATIENCE
from rhythmid.diagnose.hypothesis import ScoringKind
from rhythmid.diagnose.record_zeros import with_zeros
from rhythmid.diagnose.reference_scale import with_reference_scale
from rhythmid.elements.catalogue import Catalogue
from rhythmid.errors import InputError
from rhythmid.identify.multiple_shooting import LEAST_BLOCKS, forgets, periods_long
from rhythmid.identify.multiple_shooting import windows as cut_up
from rhythmid.identify.series import Series, hold_out_tail
from rhythmid.model import Model
from rhythmid.progress import Tell

INTEGRATES = (
    "the model integrates or is unstable, so that a long free run would add up every small disturbance"
)
FREE_RUN = "the model follows the records of the fit in free run"
FREE_RUN_IN_PART = (
    "the model follows the records of the fit in free run in part only, and in windows not much better"
)
LOSES = "in free run the nominal model does not follow the machine"
FREE_RUN_BESIDE = (
    "windows hide what is slow, and in free run the model follows the records of the fit in part"
)
DISTURBED_FREE_RUN = (
    "the model follows the records of the fit in free run, although every small disturbance adds up there"
)


@dataclass(frozen=True)
class Scoring:
    """The calibrated nominal model and the scoring mode.

    `unseen` are held-out series, separate or tails. `kind` and `reason` state the mode, the length of windows and why. The
    reason refers to the fitted records; held-out data are judged by errors of their own.
    """

    calibration: Calibration
    unseen: tuple[Series, ...]
    kind: ScoringKind
    reason: str

    @property
    def error(self) -> float:
        """Rms of the calibrated model's residuals, in the output's unit."""
        return self.calibration.fit.white.std


def settle(
    model: Model,
    series: Sequence[Series],
    separate: Sequence[Series],
    catalogue: Catalogue,
    pool: ThreadPoolExecutor | None = None,
    tell: Tell = lambda _: None,
    windows: bool = True,
) -> Iterator[Scoring]:
    """Calibrate the nominal model in the longest runs through which it follows the machine, in free run or in windows.

    The results are computed on demand. The first result is the scoring mode. If it is windows, a free run that is not hopeless is the second result, for effects that
    windows leave unnamed: windows hide slow effects, and spectral lines narrower than their resolution. If the machine integrates
    or is unstable, a free run is the second result only if it follows the machine. Without `windows`, the only possible result is a
    free run that follows the machine. Without `separate` held-out series the last fifth of every run is held out.

    Raises InputError when no length works.
    """

    def scored(how: _Way) -> Scoring:
        return _scored(how, model, series, separate, catalogue, pool, tell)

    ways = takewhile(lambda how: windows or how.kind == "free_run", _ladder(model, series))
    tried, failure = _tried(ways, scored, tell)
    if not windows:
        yield from (one for one in tried if one.calibration.fit.nrmse() < FOLLOWS)
        return
    if not tried:
        assert failure is not None
        raise failure
    # the machine moves less in a shorter window, so the error must also decrease as a share of that motion
    longest, best = tried[0], min(tried, key=lambda one: one.calibration.fit.nrmse())
    if longest.kind != "free_run":
        yield longest if best.error >= BETTER_TOGETHER * longest.error else best
        if time_is_up():
            return
        # windows do not show slow effects
        try:
            disturbed = scored(_Way("free_run", DISTURBED_FREE_RUN, list))
        except InputError:
            return
        if disturbed.calibration.fit.nrmse() < FOLLOWS:
            yield disturbed
        return
    error = longest.calibration.fit.nrmse()
    if best.error >= BETTER_TOGETHER * longest.error:
        yield longest if error < FOLLOWS else replace(longest, reason=FREE_RUN_IN_PART)
        return
    yield best
    if error < HOPELESS and best is not longest:
        yield replace(longest, reason=FREE_RUN_BESIDE)


@dataclass(frozen=True)
class _Way:
    """A scoring mode with its reason, and the function `of` that cuts series for it."""

    kind: ScoringKind
    reason: str
    of: Callable[[Sequence[Series]], list[Series]]


def _tried(
    ways: Iterable[_Way], scored: Callable[[_Way], Scoring], tell: Tell
) -> tuple[list[Scoring], InputError | None]:
    """The results of the modes until one follows the machine, of which each is better than the one before; and the first failure."""
    tried: list[Scoring] = []
    idle = 0
    failure: InputError | None = None
    for how in ways:
        if tried and time_is_up():
            break
        if how.kind != "free_run":
            tell(f"scoring in {how.reason}")
        try:
            scoring = scored(how)
        except InputError as error:
            failure = failure or error
            continue
        if tried and scoring.error > BETTER_STEP * tried[-1].error:
            idle += 1
            if idle == PATIENCE:
                break
            continue
        tried.append(scoring)
        if scoring.calibration.fit.nrmse() < FOLLOWS:
            break
    return tried, failure


def _scored(
    how: _Way, model: Model, series: Sequence[Series], separate: Sequence[Series], catalogue: Catalogue,
    pool: ThreadPoolExecutor | None, tell: Tell,
) -> Scoring:  # fmt: skip
    """Calibrate the nominal model in one scoring mode. Raises InputError where that fails."""
    cut, unseen = how.of(series), how.of(separate)
    if not separate:
        cut, unseen = hold_out_tail(cut)
    calibration = calibrate(model, cut, catalogue, pool, tell)
    calibration = with_reference_scale(calibration, model, catalogue, pool, tell)
    if how.kind == "free_run":  # the initial states of windows would absorb most of a zero
        calibration, unseen = with_zeros(calibration, model, unseen, catalogue, pool, tell)
    if calibration.reconstructed:
        unseen = [reconstructed(one) for one in unseen]
    return Scoring(calibration, tuple(unseen), how.kind, how.reason)


def _ladder(model: Model, series: Sequence[Series]) -> Iterator[_Way]:
    """Scoring modes to try, the longest runs first. Of a machine that nothing drives it is a free run, whatever the model does:
    no force that was not recorded adds up there, and the initial states of windows would absorb the slow loss of its energy."""
    try:
        free = not any(one.driven for one in series) or forgets(model, series)
    except InputError:
        free = False
    if free:
        yield _Way("free_run", FREE_RUN, list)
    shortest = LEAST_BLOCKS * max(one.period * one.block for one in series)
    length = max(float(np.median([periods_long(one) for one in series])), shortest)
    while length >= shortest:
        said = f"windows of {length:.2g} s with initial states of their own (multiple shooting): "
        yield _Way("windows", said + (LOSES if free else INTEGRATES), partial(cut_up, length=length))
        length /= 2.0
