"""Score tests: which elements of the catalogue would explain the residual of the nominal fit?

For each first guess of each element the change of the free run is computed to first order. The element's force along the fitted
trajectory disturbs the tangent linear model; a sensor element changes the output, a timing element the stamps. The part that the
nominal parameters and initial states can reproduce is projected out. The correlation with the residual is then Rao's score
statistic, asymptotically chi-squared with one degree of freedom when the element is absent
(C. R. Rao, Math. Proc. Camb. Phil. Soc. 44 (1948) 50). Nothing is compiled or fitted for a guess.
"""

import heapq
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import cast

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2 as chi2_distribution

from rhythmid.diagnose.search.tangent import Tangent, tangent
from rhythmid.elements.element import Element, Scales
from rhythmid.elements.first_guess import limited, rescaled
from rhythmid.errors import InputError
from rhythmid.identify.declared import own_model
from rhythmid.identify.drive import controlled
from rhythmid.identify.free_run import DIVERGED, FreeRun, prepare_run, with_series
from rhythmid.identify.noise import NoiseModel
from rhythmid.identify.output_error import Fit, minimise
from rhythmid.identify.record_scales import scales
from rhythmid.model import Model
from rhythmid.parallel import each
from rhythmid.simulation.effect import Path, effect_along, past_modifiers
from rhythmid.simulation.right_hand_side import DRIVES
from rhythmid.simulation.signal import first_order_hold, is_held
from rhythmid.simulation.transport import delayed_command, delays, physical_times

Array = NDArray[np.float64]
# total number of block averages from which changes are stored in single precision, which suffices for a score
FULL_PRECISION_ROWS = 200_000
SMALL = 1e-3  # ratio of the applied part of a force to the force that moves the machine, at most


@dataclass(frozen=True)
class Change:
    """Change of the free run by one first guess of one element; `outputs` are block averages of each series."""

    element: Element
    values: Mapping[str, float]
    outputs: tuple[Array, ...]


@dataclass(frozen=True)
class Score:
    """How well one first guess of one element explains the residual.

    `statistic` is the score test's chi-squared. `size` is the best factor on the guess; an element whose sign is fixed by
    physics scores 0 if it is negative. `beside` are the changes of the model's own parameters for a guess of size one: the part
    of the effect that they had compensated for.
    """

    element: Element
    values: Mapping[str, float]
    statistic: float
    size: float
    beside: Mapping[str, float] = field(default_factory=dict)

    @property
    def start(self) -> dict[str, float]:
        """First guess for a refit, scaled by the size from the score test."""
        return rescaled(self.element, self.values, self.size)

    def own(self, model: Model, factor: float | None = None) -> dict[str, float]:
        """Values of the model's own parameters beside the first guess, times `factor` if given, within their bounds."""
        found = {}
        for name, change in self.beside.items():
            low, high = model.parameters[name].bounds
            moved = model.value(name) + (limited(self.size) if factor is None else factor) * change
            found[name] = float(np.clip(moved, low, high))
        return found


@dataclass(frozen=True)
class Trajectories:
    """The fitted free run: paths of all series, and the run to which disturbances are applied.

    All signals are at the block centres; a path's `signal` is the sensor's output. `legs` are the paths as seen by the leg:
    relative to its base where that moves. `push` is the typical force (rms) on the mass in the strongest motion.
    """

    fit: Fit
    disturbed: FreeRun
    paths: tuple[Path, ...]
    legs: tuple[Path, ...]
    commands: tuple[Array, ...]
    states: tuple[Array, ...]
    push: float

    @cached_property
    def tangents(self) -> tuple[Tangent | None, ...]:
        """The tangent linear model along each series; None where there is none."""
        return tuple(
            tangent(self.disturbed, self.fit.model, index, states, self.push or 1.0)
            for index, states in enumerate(self.states)
        )

    def response(self, index: int, force: Array) -> Array | None:
        """First-order change (n,) of the measurement of series `index` at its block centres by a force (n,); None where the model diverges.

        Computed by the tangent linear model. For a model that keeps a history, by the difference to a run with a small part of the force,
        scaled back.
        """
        along = self.tangents[index]
        change = self._by_difference(index, force) if along is None else along.response(force)
        bounded = change is not None and float(np.abs(change).max()) < DIVERGED  # false for NaN, too
        return change if bounded else None

    def _by_difference(self, index: int, force: Array) -> Array | None:
        fit, run, path = self.fit, self.disturbed, self.paths[index]
        strength = float(np.sqrt(np.mean(force**2)))
        if strength == 0.0:
            return np.zeros(len(path.time))
        share = min(1.0, SMALL * self.push / strength)
        rows = run.rows(fit.model, index, fit.starts[index], first_order_hold(path.time, share * force))
        return None if rows is None else (rows[:, run.states] - path.signal) / share


def trajectories(fit: Fit) -> Trajectories:
    """Run the fitted model once and store all signals that elements may depend on."""
    run = fit.run
    disturbed = replace(
        prepare_run(fit.model, run.series, run.max_step, disturbed=True), max_step=run.max_step
    )
    paths, legs, commands, states = [], [], [], []
    q = run.states
    for index, (one, start) in enumerate(zip(run.series, fit.starts)):
        rows = disturbed.rows(fit.model, index, start)
        if rows is None:
            raise InputError(f"{one.name}: the fitted model diverges")
        model = own_model(fit.model, one)
        # the time at which the measurement was taken, not its stamp
        time = one.centres - float(np.mean(one.centres - physical_times(model, one.centres)))
        acceleration = np.gradient(rows[:, 1], time)
        body = _body_force(model, time, rows[:, 0], rows[:, 1], rows[:, q + 1])
        command = delayed_command(model, one.command)
        signal = np.zeros(one.blocks) if command is None else _evaluate(command, time)
        if one.kind == "base_acceleration":
            acceleration = acceleration + signal
        leg = model.mass.value * acceleration - rows[:, q + 1] - body
        paths.append(Path(time, rows[:, 0], rows[:, 1], rows[:, q + 1], leg, rows[:, q].copy()))
        legs.append(paths[-1])
        if one.kind == "base_displacement" and command is not None:
            rate = _evaluate(command.derivative(), time)
            legs[-1] = replace(paths[-1], position=rows[:, 0] - signal, velocity=rows[:, 1] - rate)
        states.append(rows[:, :q].copy())
        commands.append(signal)
    shaken = max(float(np.std(np.gradient(path.velocity, path.time))) for path in paths)
    push = fit.model.mass.value * shaken
    return Trajectories(fit, disturbed, tuple(paths), tuple(legs), tuple(commands), tuple(states), push)


def _evaluate(signal, time: Array) -> Array:
    value = np.asarray(signal(np.maximum(time, signal.x[0])))
    return np.where(time < signal.x[0], 0.0 if is_held(signal) else value, value)


def _body_force(model: Model, time: Array, x: Array, v: Array, f: Array) -> Array:
    total = np.zeros(len(time))
    for term in model.terms:
        element = term.element
        if (
            element.slot == "force"
            and element.acts == "body"
            and element.kernel is not None
            and not element.own
        ):
            values = term.numbers
            total += effect_along(element, values, model, Path(time, x, v, f, total, x))
    return total


def change_of_output(
    known: Trajectories, element: Element, values: Mapping[str, float]
) -> list[Array] | None:
    """Change (blocks,) of each series' block-averaged output when the element with these values joins the fitted model.

    None when the model diverges with it.
    """
    fit, run = known.fit, known.disturbed
    changes: list[Array] = []
    if element.delay is not None or element.history:
        model = fit.model.with_element(element, values, fixed=True)
        # an element with a history changes a controller's output from then on; it is simulated
        kept = prepare_run(model, fit.run.series, fit.run.max_step) if element.history else fit.run
        outputs = kept.outputs(model, fit.starts)
        if outputs is None:
            return None
        return [new - one.of_block(old.signal) for new, one, old in zip(outputs, run.series, known.paths)]
    for index, (one, path) in enumerate(zip(run.series, known.paths)):
        model = own_model(fit.model, one)
        if element.slot == "sensor":
            changes.append(one.of_block(effect_along(element, values, model, path)))
            continue
        if element.slot == "actuator":
            path = replace(path, signal=path.effort)
        elif element.slot == "command":
            if one.kind not in DRIVES:
                changes.append(np.zeros(one.blocks))
                continue
            path = replace(path, signal=known.commands[index])
            if controlled(fit.model):
                change = _change_of_reference(known, index, effect_along(element, values, model, path))
                if change is None:
                    return None
                changes.append(change)
                continue
        elif element.acts != "body":
            path = known.legs[index]
        force = effect_along(element, values, model, path)
        if element.slot == "force" and element.acts in ("leg", "transmission"):
            force = past_modifiers(force, model, path)
        if not float(np.abs(force).max()) < DIVERGED:  # true for NaN, too
            return None
        change = known.response(index, force)
        if change is None:
            return None
        changes.append(one.of_block(change))
    return changes


def _change_of_reference(known: Trajectories, index: int, change: Array) -> Array | None:
    """Change of the block-averaged output when a controller's reference changes; None when the model diverges."""
    fit, run, one = known.fit, known.disturbed, known.disturbed.series[index]
    if not np.isfinite(change).all():
        return None
    time = known.paths[index].time
    late = sum((late for _, late in delays(fit.model, time, "command")), np.zeros(len(time)))
    stamped = time - float(np.mean(late))
    both = []
    for reference in (known.commands[index], known.commands[index] + change):
        moved = replace(one, command=first_order_hold(stamped, reference))
        rows = with_series(run, index, moved).rows(fit.model, index, fit.starts[index])
        if rows is None:
            return None
        both.append(rows[:, run.states])
    return one.of_block(both[1] - both[0])


def whitened(fit: Fit, samples: Sequence[Array], noise: NoiseModel) -> list[Array]:
    """Used stretches (n,) of each series, whitened under a noise model and concatenated; `samples` has one array a series."""
    series = fit.run.series
    return [one.whitened(noise, given, one.stretches(noise)) for one, given in zip(series, samples)]


def parameter_basis(fit: Fit) -> tuple[Array, Array]:
    """Orthonormal basis (n, r) of the output changes by the free parameters, and the parameter changes (p, r) of each."""
    jacobian = fit.linearisation.jacobian
    norms = np.linalg.norm(jacobian, axis=0)
    felt = norms > 0.0
    if not felt.any():
        return np.zeros((len(fit.linearisation.residual), 0)), np.zeros((len(norms), 0))
    left, singular, right = np.linalg.svd(jacobian[:, felt] / norms[felt], full_matrices=False)
    kept = singular > 1e-9 * singular[0]
    changes = np.zeros((len(norms), int(kept.sum())))
    changes[felt] = (right[kept] / singular[kept, None]).T / norms[felt, None]
    return left[:, kept], changes


def sizes_along(known: Trajectories) -> Scales:
    """Scales for first guesses at a fit: those of the records, and those of the fitted run."""
    fit = known.fit
    sizes = replace(scales(fit.run.series, fit.model), residual_frequency=residual_line(fit))
    efforts = [path.effort for path in known.paths]  # force of the controller or of the motor
    return replace(
        sizes,
        effort=max(float(np.std(effort)) for effort in efforts) or sizes.effort,
        peak_effort=max(float(np.abs(effort).max()) for effort in efforts),
    )


def changes_of(
    known: Trajectories,
    candidates: Sequence[tuple[Element, dict[str, float]]],
    pool: ThreadPoolExecutor | None = None,
) -> Iterator[Change]:
    """Changes by all guesses, simulated on demand because those of a whole catalogue over long records are large.

    Guesses that make the model diverge, or change nothing, are left out.
    """

    def one(case: tuple[Element, dict[str, float]]) -> Change | None:
        element, values = case
        outputs = change_of_output(known, element, values)
        if outputs is None or not any(np.any(o) for o in outputs):
            return None
        with np.errstate(over="ignore", invalid="ignore"):
            kept = _kept(outputs)
            finite = all(math.isfinite(o @ o) for o in kept)  # the squares in a score must be finite, too
        return Change(element, values, kept) if finite else None

    return (change for change in each(one, candidates, pool) if change is not None)


def _kept(outputs: Sequence[Array]) -> tuple[Array, ...]:
    """Changes in the precision in which they are stored: single for very long records."""
    if sum(map(len, outputs)) <= FULL_PRECISION_ROWS:
        return tuple(outputs)
    return tuple(cast(Array, one.astype(np.float32)) for one in outputs)


def score(fit: Fit, changes: Iterable[Change]) -> list[Score]:
    """Scores of all changes under the fit's noise model, best first."""
    return sorted((one for one, _, _ in scored(fit, changes)), key=lambda s: -s.statistic)


def best_changes(fit: Fit, changes: Iterable[Change], count: int) -> list[Change]:
    """The `count` changes with the best scores under the fit's noise model, best first; no others are stored meanwhile."""
    best = heapq.nlargest(count, scored(fit, changes), key=lambda found: found[0].statistic)
    return [change for _, change, _ in best]


def unexplained(fit: Fit) -> Array:
    """The whitened residual (n,) of a fit without its part along the effects of the free parameters."""
    return _beyond(parameter_basis(fit)[0], fit.linearisation.residual)


def _beyond(basis: Array, values: Array) -> Array:
    """Values (n,) without their part along the columns of an orthonormal basis (n, r)."""
    return values - basis @ (basis.T @ values)


def scored(fit: Fit, changes: Iterable[Change]) -> Iterator[tuple[Score, Change, Array]]:
    """Changes with their scores under the fit's noise model, and the whitened part (n,) that the free parameters cannot reproduce.

    Changes that these can reproduce are left out.
    """
    left, made_by = parameter_basis(fit)
    residual = _beyond(left, fit.linearisation.residual)
    parts = [(series, series.stretches(fit.noise)) for series in fit.run.series]
    for one in changes:
        with np.errstate(over="ignore", invalid="ignore"):  # changes that overflow in whitening are left out
            white = [
                series.whitened(fit.noise, given, part) for (series, part), given in zip(parts, one.outputs)
            ]
            raw = math.sqrt(sum(float(w @ w) for w in white))
            joined = fit.linearisation.without_starts(white)
            change = _beyond(left, joined)
            strength = float(change @ change)
        if not math.isfinite(strength) or raw == 0.0 or strength <= (1e-6 * raw) ** 2:
            continue  # within the span of the nominal parameters
        size = -float(change @ residual) / strength
        statistic = size**2 * strength
        if one.element.forbids(one.values, size):
            statistic = 0.0
        proportional = one.element.size and math.isfinite(one.element.absent)
        beside = dict(zip(fit.names, -made_by @ (left.T @ joined))) if proportional else {}
        yield Score(one.element, one.values, statistic, size, beside), one, change


def under(fit: Fit, noise: NoiseModel, pool: ThreadPoolExecutor | None = None) -> Fit:
    """The fit repeated under another noise model, starting from its present values."""
    return minimise(fit.model, fit.run, fit.names, noise, fit.starts, 10, pool, differences=fit.differences)


def residual_line(fit: Fit) -> float:
    """Frequency [Hz] of the strongest spectral line in the residuals: sum of all series' spectra, interpolated between bins."""
    period = fit.run.series[0].period * fit.run.series[0].block
    length = 8 * max(one.blocks for one in fit.run.series)
    power = np.zeros(length // 2 + 1)
    for one, residual in zip(fit.run.series, fit.residuals):
        part = residual[one.used]
        if len(part) > 8 and one.period * one.block == period:
            power += np.abs(np.fft.rfft((part - part.mean()) * np.hanning(len(part)), length)) ** 2
    power[:16] = 0.0
    place = int(np.argmax(power))
    if not 0 < place < len(power) - 1 or power[place] == 0.0:
        return 0.0
    below, top, above = np.log(np.maximum(power[place - 1 : place + 2], 1e-300))
    bend = below - 2.0 * top + above
    return float((place + (0.5 * (below - above) / bend if bend < 0.0 else 0.0)) / (length * period))


def p_value(scores: Sequence[Score]) -> float:
    """Probability of a best score as high as this where nothing is missing (Bonferroni over all guesses)."""
    if not scores:
        return 1.0
    return float(min(1.0, len(scores) * chi2_distribution.sf(scores[0].statistic, 1)))
