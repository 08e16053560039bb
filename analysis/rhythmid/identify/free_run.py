"""Free-run simulation of a model over many series, prepared once and run often."""

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PPoly

from rhythmid.errors import InputError
from rhythmid.identify.declared import own_model
from rhythmid.identify.inputs import LONG, Pieces
from rhythmid.identify.series import Series
from rhythmid.model import Model
from rhythmid.simulation.compiled import Compiled, compile_model
from rhythmid.simulation.right_hand_side import InputKind, OutputKind, Variant
from rhythmid.simulation.signal import is_held, pieces
from rhythmid.simulation.simulate import start_states
from rhythmid.simulation.transport import acting_delay, command_delay, physical_times

Array = NDArray[np.float64]
DIVERGED = 1e100  # in any unit; the square of a larger value would overflow
NO_SIGNAL = pieces(None)


@dataclass(frozen=True)
class Prepared:
    """Arguments of the compiled loop: the `times` (n,) [s] of its rows, knots and coefficients of command and
    forcing, and the parameter vector."""

    compiled: Compiled
    times: Array
    command: Pieces
    forcing: Pieces
    parameters: Array


@dataclass(frozen=True)
class FreeRun:
    """A model structure and the series that it is simulated over.

    `stopping` is the structure whose integration steps end at the command's knots. `compiled` is used while the
    delay is constant; where every command has a `smooth` surrogate, it takes those.
    """

    compiled: Compiled
    stopping: Callable[[], Compiled]
    series: tuple[Series, ...]
    smooth: bool
    max_step: float

    @property
    def states(self) -> int:
        """Length of the state vector."""
        return len(self.compiled.layout.states)

    @property
    def longest_step(self) -> float:
        """Largest integration step [s]; every step also ends at a block or at a knot of the command."""
        ticks = [] if self.smooth else [one.inputs.tick for one in self.series]
        return min([*(one.period * one.block for one in self.series), *ticks])

    def rows(self, model: Model, index: int, start: Array, disturbance: PPoly | None = None) -> Array | None:
        """Rows (blocks, states + 2) of the compiled loop at the block centres of series `index`.

        `start` is the state at the first centre. Parameters that the record declares replace the model's own. Returns
        None when the simulation diverges. Raises ValueError when the length of `start` is not that of the state vector.
        """
        return self._rows(self.prepared(model, index), start, disturbance)

    def _rows(self, given: Prepared, start: Array, disturbance: PPoly | None = None) -> Array | None:
        if start.shape != (self.states,):  # the compiled loop would read past its end
            raise ValueError(f"a start of shape {start.shape} for {self.states} states")
        out = np.empty((len(given.times), self.states + 2))
        force = NO_SIGNAL if disturbance is None else pieces(disturbance)
        done = given.compiled.run(
            given.times, *given.command, *given.forcing, *force,
            given.parameters, np.ascontiguousarray(start), self.max_step, out,
        )  # fmt: skip
        return out if done == len(given.times) and float(np.abs(out[-1]).max()) < DIVERGED else None

    def prepared(self, model: Model, index: int) -> Prepared:
        """Arguments of the compiled loop for a run of a model over series `index`."""
        one = self.series[index]
        given = one.inputs
        model = own_model(model, one)
        times = np.ascontiguousarray(physical_times(model, one.centres))
        late = acting_delay(model, given.stamps)
        varies = isinstance(late, np.ndarray)
        smooth = one.smooth if self.smooth else None
        compiled = self.compiled if smooth is None or not varies else self.stopping()
        knots, coefficients = given.command if smooth is None or varies else smooth
        if late is not None and len(given.stamps):
            knots = knots.copy()
            knots[1:-1] += late
        return Prepared(compiled, times, (knots, coefficients), given.forcing, compiled.layout.vector(model))

    def outputs(self, model: Model, starts: Sequence[Array]) -> list[Array] | None:
        """Block-averaged outputs of all series from the given starts; None when one series diverges."""
        return self._outputs((self.prepared(model, index) for index in range(len(self.series))), starts)

    def _outputs(self, given: Iterable[Prepared], starts: Sequence[Array]) -> list[Array] | None:
        found: list[Array] = []
        for one, prepared, start in zip(self.series, given, starts, strict=True):
            rows = self._rows(prepared, start)
            if rows is None:
                return None
            found.append(one.of_block(rows[:, self.states]))
        return found

    def many(self, cases: Sequence[tuple[Model, Sequence[Array]]], pool: ThreadPoolExecutor | None) -> list:
        """Outputs of several cases (model, starts), computed by the compiled loop in parallel threads."""
        often = Counter(id(model) for model, _ in cases)
        short = all(len(one.inputs.stamps) < LONG for one in self.series)
        shared = {  # by the cases that differ in their starts alone
            id(model): [self.prepared(model, index) for index in range(len(self.series))]
            for model, _ in {id(case[0]): case for case in cases}.values()
            if short and often[id(model)] > 1
        }

        def outputs(case: tuple[Model, Sequence[Array]]) -> list[Array] | None:
            model, starts = case
            given = shared.get(id(model))
            return self.outputs(model, starts) if given is None else self._outputs(given, starts)

        return [outputs(case) for case in cases] if pool is None else list(pool.map(outputs, cases))


def _sees_steps(model: Model) -> bool:
    """Whether an element of the command path responds differently to a held command and its smooth surrogate: one
    that remembers extremes."""
    return any(term.element.memories for term in model.terms if term.element.slot in ("command", "actuator"))


def prepare_run(
    model: Model, series: Sequence[Series], max_step: float | None = None, disturbed: bool = False
) -> FreeRun:
    """Prepare the model's structure for the series. Raises InputError when series of different input kinds are mixed.

    `max_step` [s] None means at most one Runge-Kutta step per block, or per command value where steps end at knots.
    """
    kinds: set[InputKind] = {one.kind for one in series if one.command is not None}
    if len(kinds) > 1:
        raise InputError(
            f"records with different kinds of input ({', '.join(sorted(kinds))}) cannot be fitted together"
        )
    excited: InputKind = kinds.pop() if kinds else "force"
    sensors: set[OutputKind] = {one.measured for one in series}
    if len(sensors) > 1:
        raise InputError(
            f"records that measure different things ({', '.join(sorted(sensors))}) cannot be fitted together"
        )
    measured: OutputKind = sensors.pop() if sensors else "position"
    commands = [one.command for one in series if one.command is not None]
    smooth = all(one.command is None or one.smooth is not None for one in series) and not (
        _sees_steps(model) and any(map(is_held, commands))
    )
    variant = Variant(excited, measured, smooth, disturbed)
    return FreeRun(
        compile_model(model, variant),
        lambda: compile_model(model, replace(variant, smooth=False)),
        tuple(series),
        smooth,
        max_step or _longest_step(model, series, smooth),
    )


def _longest_step(model: Model, series: Sequence[Series], smooth: bool) -> float:
    """One Runge-Kutta step [s] per block, or per command value where steps end at the command's knots.

    With a controller, at most one sample: the controller may be as fast as that. With steps beyond its limit of
    stability no fit converges to its gains.
    """
    controlled = any(term.element.acts == "feedback" for term in model.terms)
    blocks = [one.period * (1 if controlled else one.block) for one in series]
    return min([*blocks, *([] if smooth else [one.inputs.tick for one in series])])


def start_of(model: Model, run: FreeRun, index: int, position: float, velocity: float) -> Array:
    """State of series `index` at its first block with this position and velocity. The elements' own states are
    those in the middle of the motion, at the command and forcing that act there."""
    one = run.series[index]
    model = own_model(model, one)
    begin = physical_times(model, one.centres[:1])
    late = command_delay(model, begin)
    command = _value(one.command, begin[0] - (0.0 if late is None else late[0]))
    return start_states(model, run.compiled, position, velocity, command, _value(one.forcing, begin[0]))


def _value(signal: PPoly | None, time: float) -> float:
    """Value of a signal at a time [s]; zero before its start."""
    return 0.0 if signal is None or time < signal.x[0] else float(signal(time))


def with_series(run: FreeRun, index: int, series: Series) -> FreeRun:
    """The run with one series exchanged, for example for another command. Steps end at the command's knots."""
    every = (*run.series[:index], series, *run.series[index + 1 :])
    return replace(run, compiled=run.stopping(), series=every, smooth=False)


def sufficient(
    run: FreeRun, model: Model, starts: Sequence[Array], tolerance: float, halvings: int = 8
) -> FreeRun:
    """The run with its step halved until a further halving changes the outputs by less than `tolerance` (rms), at
    most `halvings` times."""
    coarse = run.outputs(model, starts)
    for _ in range(halvings):
        finer = halved(run)
        fine = finer.outputs(model, starts)
        if coarse is not None and fine is not None:
            change = max(float(np.sqrt(np.mean((a - b) ** 2))) for a, b in zip(coarse, fine))
            if change < tolerance:
                break
        run, coarse = finer, fine
    return run


def integrable(run: FreeRun, model: Model, starts: Sequence[Array], halvings: int = 6) -> FreeRun:
    """The run with its step halved, at most `halvings` times, until the model's outputs are finite; as it is where they never are.

    A controller or a spring that is fast for the step makes an explicit method diverge, although the model does not.
    """
    finer = run
    for _ in range(halvings + 1):
        if finer.outputs(model, starts) is not None:
            return finer
        finer = halved(finer)
    return run


def coarser(run: FreeRun, factor: float) -> FreeRun:
    """The run with steps longer by a factor. Blocks and the command's knots still end steps."""
    return replace(run, max_step=max(run.max_step, min(factor * run.max_step, run.longest_step)))


def halved(run: FreeRun) -> FreeRun:
    """The run with steps of half the size. Where the forces are smooth, the integration error falls to a sixteenth."""
    return replace(run, max_step=run.max_step / 2)
