"""Identifiability of parameters and delays: undetermined directions, three observables of the delays, closure and
aliases.

Let δ_f be the offset of the forcing's phase against the record's clock. A shift (τ_u, τ_y, δ_f) → (+a, −a, +a)
changes nothing in the record. Three quantities can be observed: the limit cycle's phase A = τ_y + δ_f, the slope of
the response's phase B = τ_u + τ_y, and the sidebands' offset C = τ_u − δ_f. In a correct model A + C = B.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import reduce
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from rhythmid.errors import InputError
from rhythmid.identify.declared import own_model
from rhythmid.identify.discretisation import discretisation_error
from rhythmid.identify.harmonic_likelihood import INPUT_DELAY, MEASUREMENT_DELAY, visible_sidebands
from rhythmid.identify.identification import Delays, Estimate, Observables
from rhythmid.identify.inner_delays import with_inner_delays
from rhythmid.identify.joint import JointFit, without_forcing
from rhythmid.identify.natural_size import are_told
from rhythmid.identify.robust_covariance import widening
from rhythmid.identify.sensitivity import Problem
from rhythmid.identify.series import Series
from rhythmid.identify.undetermined import sum_of, undetermined
from rhythmid.ltp.limit_cycle import limit_cycle
from rhythmid.ltp.pumping import pumping_of
from rhythmid.model import Model
from rhythmid.simulation.transport import physical_times
from rhythmid.statistics import NORMAL_95

Array = NDArray[np.float64]
Forcing = Literal["on_robot", "delayed", "clock_unknown"]
SEPARATE_BY = 4.0  # standard deviations
SEEN = 1e-3  # share of the limit cycle's fundamental above which a harmonic is used


@dataclass(frozen=True)
class Offset:
    """Prior knowledge of δ_f [s], the clock offset of the forcing's reference: bounds, or a Gaussian prior about
    `mean`."""

    low: float = -math.inf
    high: float = math.inf
    mean: float = 0.0
    std: float = math.inf

    @property
    def limits(self) -> str:
        """The bounds in words."""
        bounded = math.isfinite(self.high - self.low)
        return f"between {self.low:g} and {self.high:g} s" if bounded else "unknown"


def offset_of(bounds: tuple[float, float] | None, std: float | None) -> Offset | None:
    """The stated clock offset: bounds (low, high) [s] or a standard deviation [s]; None where neither is given.

    Raises InputError for bounds out of order, or for both.
    """
    if bounds is None:
        return None if std is None else Offset(std=std)
    if std is not None:
        raise InputError(
            "the clock offset is either bounded or has a standard deviation: give one of the two"
        )
    if not bounds[0] < bounds[1]:
        raise InputError(
            f"bounds of the clock offset {bounds[0]:g} to {bounds[1]:g} s: the lower comes first"
        )
    return Offset(*bounds)


def _cycle_slope(joint: JointFit) -> Array | None:
    """Whitened, projected sensitivity (n,) [1/s] of the output to a delay of the limit cycle alone; None without a
    cycle."""
    fit = joint.fit
    problem = Problem(fit.run, fit.names, fit.noise, None)
    columns = []
    for index, (one, record) in enumerate(zip(fit.run.series, joint.records)):
        pumping = pumping_of(record) or joint.pumping
        slope = np.zeros(one.blocks)
        if pumping is not None and pumping.active:
            try:
                cycle = limit_cycle(without_forcing(fit.model), pumping)
            except InputError:
                return None
            output = cycle.output.copy()
            output[-1] = output[0]
            rate = CubicSpline(cycle.time, output, bc_type="periodic").derivative()
            physical = physical_times(own_model(fit.model, one), one.centres) - pumping.origin
            slope = -rate(np.mod(physical, pumping.period))
        white = problem.whitened(index, slope)
        basis = fit.linearisation.bases[index]
        columns.append(white - basis @ (basis.T @ white))
    column = np.concatenate(columns)
    return column if np.linalg.norm(column) > 0.0 else None


def observables(joint: JointFit) -> Observables | None:
    """A, B and C, each from its own part of the data, and the closure A + C − B divided by its standard deviation.

    The limit cycle gets a delay of its own beside that of the response to the command. Both are estimated together
    with all other parameters, one step from the joint optimum. Their standard deviations are confirmed by the
    scores of blocks. None where there is no cycle or where a delay is not free.
    """
    fit = joint.fit
    if joint.pumping is None or INPUT_DELAY not in fit.names or MEASUREMENT_DELAY not in fit.names:
        return None
    extra = _cycle_slope(joint)
    if extra is None:
        return None
    joined = np.column_stack([fit.linearisation.jacobian, extra])
    norms = np.linalg.norm(joined, axis=0)
    norms[norms == 0.0] = 1e-150
    inverse = np.linalg.pinv((joined / norms).T @ (joined / norms), rcond=1e-13, hermitian=True)
    covariance = inverse / np.outer(norms, norms)
    step = -covariance @ (joined.T @ fit.linearisation.residual)
    moved = covariance @ (joined.T @ discretisation_error(fit))
    left = fit.linearisation.residual + joined @ step
    factors = widening(joined, left, fit.linearisation.pieces, covariance, np.sqrt(np.diag(covariance)))
    covariance = covariance * np.outer(factors, factors) + np.outer(moved, moved)
    u, y, gap = fit.names.index(INPUT_DELAY), fit.names.index(MEASUREMENT_DELAY), len(fit.names)
    delays = {u: fit.model.value(INPUT_DELAY), y: fit.model.value(MEASUREMENT_DELAY), gap: 0.0}

    def of(*places: int) -> Estimate:
        pick = np.zeros(gap + 1)
        pick[list(places)] = 1.0
        value = sum(delays[p] + float(step[p]) for p in places)
        return Estimate(value, float(math.sqrt(max(pick @ covariance @ pick, 0.0))), "s")

    closure = of(gap)
    assert closure.value is not None and closure.std is not None
    return Observables(of(y, gap), of(u, y), of(u), closure.value / closure.std if closure.std > 0.0 else 0.0)


def aliases(joint: JointFit, cycle: bool = True) -> tuple[tuple[float, float], ...]:
    """Nonnegative pairs (τ_u, τ_y) that give exactly the same record: shifts by T divided by the gcd of all visible
    harmonics."""
    pumping, fit = joint.pumping, joint.fit
    if pumping is None:
        return ()
    seen: list[int] = []
    plain = without_forcing(fit.model)
    one = fit.run.series[0]
    if cycle and one.ignored is None:
        lines = np.abs(limit_cycle(plain, pumping).harmonics(4)[1:])
        seen += [n + 1 for n in range(len(lines)) if lines[n] > SEEN * lines.max()]
    record = joint.records[0]
    if record.input is not None and np.ptp(record.input.value) > 0.0:
        density = fit.noise.long_run_variance * one.period * one.block
        seen += visible_sidebands(record, plain, pumping, density)
    if not seen:
        return ()
    shift = pumping.period / reduce(math.gcd, seen)
    u, y = fit.model.value(INPUT_DELAY), fit.model.value(MEASUREMENT_DELAY)
    slack = 4.0 * max(s for n, s in fit.std.items() if n in (INPUT_DELAY, MEASUREMENT_DELAY)) + one.period
    steps = range(-int((u + slack) / shift), int((y + slack) / shift) + 1)
    return tuple((u + j * shift, y - j * shift) for j in steps if j != 0)


def stated_by(joint: JointFit) -> Forcing | None:
    """Where the forcing acts, according to the recordings: a run that describes its forcing generated it on the robot."""
    runs_given = [record.run for record in joint.records]
    if runs_given and all(
        run is not None and dict(run.get("forcing") or {}).get("amplitude") for run in runs_given
    ):
        return "on_robot"
    return None


def delays_of(
    joint: JointFit,
    forcing: Forcing | None = None,
    offset: Offset | None = None,
    source: str = "the recorded forcing",
) -> Delays:
    """Estimates of the delays, separate only where the records and the user's statement support it.

    `forcing` states how the forcing reaches the machine: `on_robot` (generated there; the recorded phase is the
    acting one), `delayed` (through the same delayed channel as the command), `clock_unknown` (generated on the
    robot; its phase is recorded by a clock of unknown `offset`). The default is `on_robot`, unless the fit then
    gives an input delay of zero. A forcing through the delayed channel looks exactly like that, so the delays are
    then not reported separately.
    """
    directions = tuple(direction.words for direction in undetermined(joint.fit))
    return with_inner_delays(_of_paths(joint, forcing, offset, source, directions), joint.fit)


def of_told_sum(delays: Delays, model: Model, series: Sequence[Series]) -> Delays:
    """The answer without a sum of which the records tell nothing; see `are_told`. Where the delays are separable each of them is told."""
    total = delays.sum
    if delays.separable or total.value is None or total.std is None:
        return delays
    name = INPUT_DELAY if INPUT_DELAY in model.parameters else MEASUREMENT_DELAY
    if name not in model.parameters or are_told(model, series, {name: (total.value, total.std)}):
        return delays
    return replace(delays, sum=Estimate(None, None, "s"))


def _of_paths(
    joint: JointFit, forcing: Forcing | None, offset: Offset | None, source: str, directions: tuple[str, ...]
) -> Delays:
    """Delays of the command and measurement paths; `directions` are the undetermined directions, in words."""
    fit = joint.fit
    total = sum_of(fit, INPUT_DELAY, MEASUREMENT_DELAY)
    nothing = Estimate(None, None, "s")
    if not {INPUT_DELAY, MEASUREMENT_DELAY} & set(fit.names) and joint.pumping is None:
        words = "no recorded input changes, so no delay shows"
        return Delays(nothing, nothing, nothing, False, words, undetermined=directions)
    if joint.pumping is None or not joint.pumping.active:
        words = "no forcing is known, and with it no phase of the cycle: only the sum of the delays is identifiable"
        return Delays(nothing, nothing, total, False, words, undetermined=directions)
    if INPUT_DELAY not in fit.model.parameters or MEASUREMENT_DELAY not in fit.model.parameters:
        here = sum_of(fit, MEASUREMENT_DELAY)
        words = f"{source} acts on the machine without delay; there is no command, so its delay does not show"
        return Delays(nothing, here, nothing, False, words, undetermined=directions)
    first, second = sum_of(fit, INPUT_DELAY), sum_of(fit, MEASUREMENT_DELAY)
    seen = observables(joint)
    closure = None if seen is None else seen.z
    told = forcing or stated_by(joint)
    intervals = _intervals(first, second, total, None)

    def only_sum(words: str, limits: dict[str, tuple[float, float]] = intervals) -> Delays:
        return Delays(nothing, nothing, total, False, words, closure, (), limits, seen, directions)

    if first.std is None or second.std is None:
        return only_sum("the records do not separate the two delays")
    if told == "delayed":
        return only_sum(
            "the forcing comes through the same delayed channel as the command: only the sum of the delays "
            "is identifiable"
        )
    if told == "clock_unknown":
        known = offset or Offset()
        words = f"the offset of the forcing's clock is {known.limits}: each delay is only known to lie in an interval"
        if math.isfinite(known.std):
            shifted = _shifted(first, second, known)
            words = f"the forcing's clock is off by {known.mean:g} ± {known.std:g} s, as stated"
            return Delays(*shifted, total, True, words, closure, (), None, seen, directions)
        return only_sum(words, _intervals(first, second, total, known))
    step = max(record.output.period for record in joint.records)
    if told is None and _alike_delayed(first, second, step):
        return only_sum(
            "the input delay comes out at zero, which is also what a forcing through the same delayed channel looks like; "
            "state --forcing on_robot if the forcing is made on the robot, or --forcing delayed if it is not"
        )
    words = (
        f"{source} acts on the machine without delay, at its stamps (δ_f = 0)"
        + ("" if told is None else f", as {'the user' if forcing else 'the recording'} states")
    )  # fmt: skip
    return Delays(first, second, total, True, words, closure, aliases(joint), None, seen, directions)


def _alike_delayed(first: Estimate, second: Estimate, step: float) -> bool:
    """Whether the input delay, but not the measurement delay, comes out at zero, to a sample period `step` [s]."""
    assert first.value is not None and first.std is not None
    assert second.value is not None and second.std is not None
    zero = abs(first.value) < SEPARATE_BY * first.std + step
    return zero and second.value > SEPARATE_BY * second.std + 2.0 * step


def _shifted(first: Estimate, second: Estimate, offset: Offset) -> tuple[Estimate, Estimate]:
    """Delays under a Gaussian prior on the offset δ_f: τ_u = C + δ_f, τ_y = A − δ_f."""
    assert first.value is not None and first.std is not None
    assert second.value is not None and second.std is not None
    return (
        Estimate(first.value + offset.mean, math.hypot(first.std, offset.std), "s"),
        Estimate(second.value - offset.mean, math.hypot(second.std, offset.std), "s"),
    )


def _intervals(
    first: Estimate, second: Estimate, total: Estimate, offset: Offset | None
) -> dict[str, tuple[float, float]]:
    """95 % intervals of the delays from causality (neither is negative) and from bounds on the clock offset."""
    spread = NORMAL_95 * (total.std or 0.0)
    longest = max((total.value or 0.0) + spread, 0.0)
    whole = (0.0, longest)
    if offset is None or first.value is None or second.value is None:
        return {"input": whole, "measurement": whole}
    wide = (NORMAL_95 * (first.std or 0.0), NORMAL_95 * (second.std or 0.0))
    ranges = (
        (first.value + offset.low - wide[0], first.value + offset.high + wide[0]),
        (second.value - offset.high - wide[1], second.value - offset.low + wide[1]),
    )
    low, high = zip(*[(min(max(a, 0.0), longest), min(max(b, 0.0), longest)) for a, b in ranges])
    return {"input": (low[0], high[0]), "measurement": (low[1], high[1])}
