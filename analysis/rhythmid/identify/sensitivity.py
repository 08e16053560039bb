"""Sensitivities of a free run to parameters and initial states, by differences, with the initial states projected out."""

import math
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhythmid.identify.free_run import FreeRun, coarser, start_of
from rhythmid.identify.noise import NoiseModel
from rhythmid.identify.record_zero import zero_place
from rhythmid.identify.series import record_of
from rhythmid.model import Model

Array = NDArray[np.float64]
# share of a sensitivity below which its remainder after projection is finite-difference error: differences move the
# motion by a ten-thousandth, and a pendulum's angle at rest, which the initial state can absorb, leaves up to
# 1.2e-3 of its effect
DEAD = 3e-3
# share of the motion below which a difference is rounding error; the step then grows up to the size of its
# parameter, not further
SEEN = 1e-15

# ratio of the steps for sensitivities to the step of the run, where that is accurate enough
COARSER = 4.0
# largest error of coarser steps as a share of the residual: the directions in which a fit still improves move the
# outputs by about the residual
COARSE_ERROR = 0.1


@dataclass(frozen=True)
class Linearisation:
    """Whitened residual (n,) and its sensitivities to parameters (n, p), both with the initial states projected out.

    `bases` (one orthonormal basis (n_s, q) per series) span the effects of the initial states. `steps` (p,) and
    `state_steps` (q,) are the finite-difference steps.
    """

    residual: Array
    jacobian: Array
    bases: tuple[Array, ...]
    pieces: tuple[slice, ...]
    steps: Array
    state_steps: Array

    def without_starts(self, white: Sequence[Array]) -> Array:
        """Whitened signals of the series (n_s,), joined (n,), with the effects of the initial states projected out."""
        return np.concatenate([w - b @ (b.T @ w) for w, b in zip(white, self.bases)])


class Problem:
    """One structure, its series and a noise model: residuals and their sensitivities."""

    def __init__(
        self, run: FreeRun, names: Sequence[str], noise: NoiseModel, pool: ThreadPoolExecutor | None
    ) -> None:
        self.run, self.names, self.noise, self.pool = run, tuple(names), noise, pool
        self.coarse = coarser(run, COARSER)
        self.hidden: list[tuple[Array, Array]] = []  # mean and scatter of each series' element states
        self.spread = max(float(np.std(one.averaged)) for one in run.series) or 1.0
        # zeros differ by no more than the outputs do
        self.reach = float(np.ptp([[one.averaged.min(), one.averaged.max()] for one in run.series])) or 1.0
        self.stretches = [one.stretches(noise) for one in run.series]
        self.ignored = [
            None if one.ignored is None else span(self._white(i, one.ignored))
            for i, one in enumerate(run.series)
        ]

    def _white(self, index: int, samples: Array) -> Array:
        return self.run.series[index].whitened(self.noise, samples, self.stretches[index])

    def whitened(self, index: int, samples: Array) -> Array:
        """Used stretches of series `index`, whitened and joined, with ignored signals projected out; (n,) or (n, q)."""
        white, ignored = self._white(index, samples), self.ignored[index]
        return white if ignored is None else white - ignored @ (ignored.T @ white)

    def residuals(self, model: Model, starts: Sequence[Array]) -> list[Array] | None:
        outputs = self.run.outputs(model, starts)
        if outputs is None:
            return None
        return [output - one.averaged for output, one in zip(outputs, self.run.series)]

    def learn_hidden(self, model: Model, starts: Sequence[Array]) -> None:
        """Learn the usual range of the elements' own states from a run in which they start as the motion determines them.

        The effect of a hidden state of a fast element is almost that of a change of the velocity, so the usual
        range is needed as a prior. A run from the fitted starts would not do: it would accept any start, however
        far off. From fit to fit, a mode of nearly no mass would start further away and finally act as an
        independent force. All windows of a record share one range, because an oscillation in one window was excited
        in another. A zero is constant during a run; its range is that of the outputs.
        """
        if self.run.states == 2:
            self.hidden = [(np.empty(0), np.empty(0)) for _ in starts]
            return
        zero = zero_place(self.run.compiled.layout.states)
        means: list[Array] = []
        ranges: dict[str, Array] = {}
        for index, (one, start) in enumerate(zip(self.run.series, starts, strict=True)):
            states = self._usual(model, index, start, zero)
            means.append(states.mean(axis=0))
            scatter = 3.0 * states.std(axis=0) + 1e-12
            widest = ranges.setdefault(record_of(one), scatter)
            np.maximum(widest, scatter, out=widest)
        self.hidden = []
        for one, mean in zip(self.run.series, means, strict=True):
            scatter = ranges[record_of(one)].copy()
            if zero is not None and one.zero is not None:
                scatter[zero - 2] = self.reach
            self.hidden.append((mean, scatter))

    def _usual(self, model: Model, index: int, start: Array, zero: int | None) -> Array:
        """States of elements (n, h) along series `index`, started from the position and velocity of its start.
        Where the model diverges from there, the element states of the start are kept."""
        begin = start_of(model, self.run, index, float(start[0]), float(start[1]))
        if zero is not None:
            begin[zero] = start[zero]
        rows = self.run.rows(model, index, begin)
        if rows is None:
            rows = self.run.rows(model, index, start)
        # the whole run: a free decay is largest at its start
        return np.zeros((1, self.run.states - 2)) if rows is None else rows[:, 2 : self.run.states]

    def departure(self, index: int, start: Array) -> Array:
        """Deviation of a start's element states from their usual mean, in units of their usual scatter, (h,)."""
        mean, scatter = self.hidden[index]
        return (start[2:] - mean) / scatter

    def cost(self, model: Model, residuals: Sequence[Array] | None, starts: Sequence[Array]) -> float:
        if residuals is None:
            return math.inf
        with np.errstate(over="ignore"):  # a nearly divergent run has infinite cost
            total = sum(float(np.sum(self.whitened(i, r) ** 2)) for i, r in enumerate(residuals))
        total += sum(float(np.sum(self.departure(i, start) ** 2)) for i, start in enumerate(starts))
        for name in self.names:
            value = model.parameters[name]
            if value.prior is not None:
                total += ((value.value - value.prior.mean) / value.prior.std) ** 2
        return total if math.isfinite(total) else math.inf

    def _perturbed(
        self,
        run: FreeRun,
        model: Model,
        starts: Sequence[Array],
        signed: Array,
        state_steps: Array,
        columns: Sequence[int],
    ) -> list[list[Array] | None]:
        """Outputs of a run with the parameter, or from p on the initial state, of each of the `columns` moved by
        its step."""
        cases: list[tuple[Model, Sequence[Array]]] = []
        for c in columns:
            if c < len(self.names):
                name = self.names[c]
                cases.append((model.with_values({name: model.value(name) + signed[c]}), starts))
            else:
                shift = np.zeros(self.run.states)
                shift[c - len(self.names)] = state_steps[c - len(self.names)]
                cases.append((model, [start + shift for start in starts]))
        return run.many(cases, self.pool)

    def _base(
        self, model: Model, starts: Sequence[Array], residuals: Sequence[Array]
    ) -> tuple[FreeRun, list[Array]]:
        """The run used for sensitivities, and its outputs as the reference for those of `_perturbed`."""
        own = [residual + one.averaged for residual, one in zip(residuals, self.run.series)]
        if self.coarse.max_step == self.run.max_step:
            return self.run, own
        outputs = self.coarse.outputs(model, starts)
        if outputs is None:
            return self.run, own
        error = sum(float(np.sum((a - b) ** 2)) for a, b in zip(outputs, own))
        left = sum(float(np.sum(residual**2)) for residual in residuals)
        return (self.coarse, outputs) if error < COARSE_ERROR**2 * left else (self.run, own)

    def settle_steps(
        self,
        model: Model,
        starts: Sequence[Array],
        residuals: Sequence[Array],
        steps: Array,
        state_steps: Array,
        known: Sequence[bool],
    ) -> tuple[Array, Array]:
        """Finite-difference steps that move the outputs by about the same small amount for every parameter and state.

        Natural sizes span many powers of ten (a stiffness, a delay, a hidden state of an actuator). Steps marked
        `known` (p + q) are unchanged.
        """
        run, base = self._base(model, starts, residuals)
        joint = np.concatenate([steps, state_steps])
        p = len(self.names)
        todo = [column for column, settled in enumerate(known) if not settled]
        for _ in range(4):
            if not todo:
                break
            signed = self._signed(model, joint[:p])
            outputs = self._perturbed(run, model, starts, signed, joint[p:], todo)
            again = []
            for c, case in zip(todo, outputs):
                if case is None:
                    joint[c] *= 1e-2
                    again.append(c)
                    continue
                moved = max(float(np.sqrt(np.mean((new - old) ** 2))) for new, old in zip(case, base))
                ratio = float(np.clip(1e-4 * self.spread / max(moved, 1e-30), 1e-4, 1e4))
                joint[c] *= ratio
                if not 0.1 < ratio < 10.0:
                    again.append(c)
            todo = again
        return joint[:p], joint[p:]

    def _signed(self, model: Model, steps: Array) -> Array:
        """Steps with signs that keep the parameters within their bounds."""
        signed = steps.copy()
        for i, name in enumerate(self.names):
            value = model.parameters[name]
            low, high = value.bounds
            signed[i] = min(signed[i], 0.1 * (high - low))
            if value.value + signed[i] > high:
                signed[i] = -signed[i]
        return signed

    def linearise(
        self,
        model: Model,
        starts: Sequence[Array],
        residuals: Sequence[Array],
        steps: Array,
        state_steps: Array,
    ) -> tuple[Linearisation, list[tuple[Array, Array, Array]], Array, Array]:
        """Sensitivities by forward differences whose steps settle at a ten-thousandth of the motion.

        Returns the linearisation, each series' whitened residual and sensitivities to parameters and initial state, and the
        next steps.
        """
        signed = self._signed(model, steps)
        run, base = self._base(model, starts, residuals)
        outputs = self._perturbed(
            run, model, starts, signed, state_steps, range(len(self.names) + self.run.states)
        )
        p, q = len(self.names), self.run.states
        rows, columns, bases, states, places = [], [], [], [], []
        place = 0
        moved = np.zeros(p + q)
        for index, at in enumerate(base):
            change = np.zeros((len(at), p + q))
            for c, case in enumerate(outputs):
                if case is not None:
                    change[:, c] = case[index] - at
            moved = np.maximum(moved, np.sqrt(np.mean(change**2, axis=0)))
            change[:, :p] /= signed
            white = self.whitened(index, np.column_stack([residuals[index], change]))
            known = np.zeros((q - 2, 1 + p + q))
            known[:, 0] = self.departure(index, starts[index])
            known[:, 1 + p + 2 :] = np.diag(state_steps[2:] / self.hidden[index][1])
            joined = np.vstack([white, known])
            basis = span(joined[:, 1 + p :])
            projected = joined[:, : 1 + p] - basis @ (basis.T @ joined[:, : 1 + p])
            # the remainder of a parameter with the same effect as the initial state or an ignored signal is
            # rounding error
            whole = np.linalg.norm(self._white(index, change[:, :p]), axis=0)
            projected[:, 1:][:, np.linalg.norm(projected[:, 1:], axis=0) < DEAD * whole] = 0.0
            rows.append(projected[: len(white), 0])
            columns.append(projected[: len(white), 1:])
            bases.append(basis[: len(white)])
            states.append((joined[:, 0], joined[:, 1 : 1 + p], joined[:, 1 + p :]))
            places.append(slice(place, place + len(white)))
            place += len(white)
        ratio = self._ratio(model, moved, np.append(np.abs(steps), np.abs(state_steps)))
        linearisation = Linearisation(
            np.concatenate(rows), np.concatenate(columns), tuple(bases), tuple(places), signed, state_steps
        )
        return linearisation, states, steps * ratio[:p], state_steps * ratio[p:]

    def _ratio(self, model: Model, moved: Array, steps: Array) -> Array:
        """Ratio (p + q,) of the next to the present `steps`, which `moved` the outputs by this rms."""
        ratio = np.clip(1e-4 * self.spread / np.maximum(moved, 1e-30), 1e-3, 1e3)
        # a clock's tick has an effect once a step passes it; a parameter without effect never has
        unseen = moved < SEEN * self.spread
        values = [abs(model.value(name)) or self.spread for name in self.names]
        most = np.append(values, np.full(self.run.states, self.spread))
        ratio[unseen] = np.minimum(ratio, np.maximum(most / steps, 1.0))[unseen]
        return ratio


def state_update(sensitivity: Array, target: Array, damping: Array | None = None) -> Array:
    """Least-squares change (q,) of a series' initial state, in units of its difference steps, with damping (q,)."""
    norms, live = _felt(sensitivity)
    change = np.zeros(sensitivity.shape[1])
    if live.any():
        scaled = sensitivity[:, live] / norms[live]
        if damping is not None and damping.any():
            scaled = np.vstack([scaled, np.diag(np.sqrt(damping[live]))])
            target = np.concatenate([target, np.zeros(len(scaled) - len(target))])
        change[live] = np.linalg.lstsq(scaled, -target, rcond=1e-7)[0] / norms[live]
    return change


def span(columns: Array) -> Array:
    """Orthonormal basis of the columns' span; dependent columns are dropped."""
    norms, live = _felt(columns)
    if not live.any():
        return np.zeros((len(columns), 0))
    left, singular, _ = np.linalg.svd(columns[:, live] / norms[live], full_matrices=False)
    return left[:, singular > 1e-7 * singular[0]]


def _felt(columns: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Norms of the columns, and which of them exceed rounding errors.

    The first two, of position and velocity, set the scale. The prior of a hidden state that never moves can exceed
    them by many powers of ten and would make them look like rounding errors.
    """
    norms = np.linalg.norm(columns, axis=0)
    return norms, norms > 1e-9 * max(norms[:2].max(initial=0.0), 1e-300)
