"""Free-run simulation of a model over many series, prepared once and run often."""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PPoly

from rhythmid.compiled import Compiled, compile_model
from rhythmid.errors import InputError
from rhythmid.identify.series import Series
from rhythmid.model import Model
from rhythmid.signal import pieces
from rhythmid.simulate import physical_times

Array = NDArray[np.float64]
NO_SIGNAL = pieces(None)


@dataclass(frozen=True)
class Inputs:
    """A series' command and forcing as the compiled loop takes them; the command's knots are before any delay."""

    command: tuple[Array, Array]
    forcing: tuple[Array, Array]


@dataclass(frozen=True)
class FreeRun:
    """A structure and the series that it is run over."""

    compiled: Compiled
    series: tuple[Series, ...]
    inputs: tuple[Inputs, ...]
    max_step: float

    @property
    def states(self) -> int:
        """Length of the state vector."""
        return len(self.compiled.layout.states)

    def rows(self, model: Model, index: int, start: Array, disturbance: PPoly | None = None) -> Array | None:
        """Rows (n, states + 2) of the compiled loop over series `index`; None when the simulation diverges."""
        one, given = self.series[index], self.inputs[index]
        times = np.ascontiguousarray(np.maximum.accumulate(physical_times(model, one.time)))
        out = np.empty((len(times), self.states + 2))
        force = NO_SIGNAL if disturbance is None else pieces(disturbance)
        done = self.compiled.run(
            times, _delayed(model, given.command[0]), given.command[1], *given.forcing, *force,
            self.compiled.layout.vector(model), np.ascontiguousarray(start), self.max_step, out,
        )  # fmt: skip
        return out if done == len(times) and np.isfinite(out[-1]).all() else None

    def outputs(self, model: Model, starts: Sequence[Array]) -> list[Array] | None:
        """Block-averaged outputs of all series from the given starts; None when one of them diverges."""
        found: list[Array] = []
        for index, one in enumerate(self.series):
            rows = self.rows(model, index, starts[index])
            if rows is None:
                return None
            found.append(one.average(rows[:, self.states]))
        return found

    def many(self, cases: Sequence[tuple[Model, Sequence[Array]]], pool: ThreadPoolExecutor | None) -> list:
        """Outputs of several (model, starts) cases; the compiled loop runs in parallel threads."""
        if pool is None:
            return [self.outputs(*case) for case in cases]
        return list(pool.map(lambda case: self.outputs(*case), cases))


def _delayed(model: Model, knots: Array) -> Array:
    """Knots of the command after the delays of the command path; nothing overtakes."""
    moved = knots
    inner = slice(1, -1)  # the outermost knots stand for minus and plus infinity
    for term in model.terms:
        if term.element.slot == "command" and term.element.delay is not None:
            late = term.element.delay(knots[inner], **{n: v.value for n, v in term.values.items()})
            if moved is knots:
                moved = knots.copy()
            moved[inner] += late
    if moved is not knots:
        moved[inner] = np.maximum.accumulate(moved[inner])
    return moved


def prepare_run(
    model: Model, series: Sequence[Series], max_step: float | None = None, disturbed: bool = False
) -> FreeRun:
    """Prepare the model's structure for the series. Raises InputError when series of different input kinds are mixed.

    `max_step` [s] None means one Runge-Kutta step a sample at most.
    """
    kinds = {one.kind for one in series if one.command is not None}
    if len(kinds) > 1:
        raise InputError(f"records with different kinds of input ({', '.join(sorted(kinds))}) cannot be fitted together")
    compiled = compile_model(model, disturbed, kinds.pop() if kinds else "force")
    inputs = tuple(
        Inputs(_contiguous(pieces(one.command)), _contiguous(pieces(one.forcing))) for one in series
    )
    return FreeRun(compiled, tuple(series), inputs, max_step or min(one.period for one in series))


def _contiguous(pair: tuple[Array, Array]) -> tuple[Array, Array]:
    return np.ascontiguousarray(pair[0]), np.ascontiguousarray(pair[1])


def accurate(run: FreeRun, model: Model, starts: Sequence[Array], tolerance: float, finest: int = 6) -> FreeRun:
    """The run with its step halved until the outputs change by less than `tolerance` (rms); at most `finest` times."""
    coarse = run.outputs(model, starts)
    for _ in range(finest):
        finer = replace(run, max_step=run.max_step / 2)
        fine = finer.outputs(model, starts)
        if fine is None:
            run, coarse = finer, fine
            continue
        if coarse is not None:
            change = max(float(np.sqrt(np.mean((a - b) ** 2))) for a, b in zip(coarse, fine))
            if change < tolerance:
                return run
        run, coarse = finer, fine
    return run
