"""Simulation of a short segment, with sensitivities to its initial state and to every change of physics."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from rhythmid.model import Model
from rhythmid.simulation.compiled import NO_HISTORY, compile_model
from rhythmid.simulation.right_hand_side import Variant
from rhythmid.simulation.signal import FAR, continuous, pieces
from rhythmid.simulation.transport import command_delay, physical_times
from rhythmid.twin.changes import Change
from rhythmid.twin.samples import Samples
from rhythmid.twin.settings import Settings

Array = NDArray[np.float64]
Pieces = tuple[Array, Array]
DIFFERENCE_STEP_SHARE = 1e-3  # finite-difference step of a state or parameter, relative to its scale
# [s] the same for a delay: below the sample period of most machines, above the rounding of times
DELAY_STEP = 2e-4
MARGIN = 4  # samples on either side of a segment that are used for a spline through a smooth signal
LONGEST_STEP = 2e-3  # [s] largest integration step: a hundredth of a period of 5 Hz
DIVERGED = 1e100


@dataclass(frozen=True)
class Start:
    """The machine at the end of the last segment: time [s], state (q,), and the past that elements remember."""

    time: float
    state: Array
    past: Array = field(default_factory=lambda: NO_HISTORY)


@dataclass(frozen=True)
class Inputs:
    """Inputs of a segment: the physical times of its samples (n,) [s], the command, the command `DELAY_STEP` later, the forcing."""

    times: Array
    command: Pieces
    later: Pieces
    forcing: Pieces


@dataclass(frozen=True)
class Run:
    """A simulated segment.

    `output` (m,) are block averages, `states` (q,) those at its end. `by_start` (m, q) and `by_change` (m, p) are the sensitivities of
    the output to each state at the start and to each change; `end_by_start` (q, q) and `end_by_change` (q, p) those of the end
    state. `slope` and `curvature` (n,) are the first and the second derivative of the output at each sample.
    """

    output: Array
    slope: Array
    curvature: Array
    states: Array
    by_start: Array
    by_change: Array
    end_by_start: Array
    end_by_change: Array
    past: Array


class Simulation:
    """A model that is simulated segment by segment with incoming signals."""

    def __init__(self, model: Model, changes: tuple[Change, ...], settings: Settings, period: float) -> None:
        self.model, self.changes, self.settings = model, changes, settings
        self.compiled = compile_model(model, Variant(settings.input_kind, settings.output_kind))
        self.parameters = self.compiled.layout.vector(model)
        places = {name: index for index, (name, _) in enumerate(self.compiled.layout.parameters)}
        self.places = [places.get(change.name) for change in changes]
        self.max_step = min(period, LONGEST_STEP)

    @property
    def states(self) -> int:
        """Length q of the state vector."""
        return len(self.compiled.layout.states)

    def command(self, samples: Samples, start: float, end: float, later: float = 0.0) -> Pieces:
        """The command as it acts between two times [s], `later` [s] later than in the model; zero before the first sample."""
        reach = later + self.longest_delay
        time, value = samples.between(start - reach, end, MARGIN)
        if len(time) == 0:
            return pieces(None)
        if self.settings.hold == "zero":
            knots = np.maximum.accumulate(time + self._late(time) + later)
            coefficients = np.concatenate([[0.0], value])[None, :]
            return np.concatenate([[-FAR], knots, [FAR]]), coefficients
        if len(time) < 4:
            return pieces(None)
        signal = continuous(time, value, self.settings.hold)
        knots, coefficients = pieces(signal)
        knots = knots.copy()
        knots[1:-1] += self._late(knots[1:-1]) + later
        return knots, coefficients

    @property
    def longest_delay(self) -> float:
        """Longest time [s] from a command's stamp until it acts."""
        return float(self._late(np.zeros(1))[0])

    def _late(self, stamps: Array) -> Array:
        """Delay (n,) [s] from the stamps of commands until they act."""
        late = command_delay(self.model, stamps)
        return np.zeros(len(stamps)) if late is None else late

    def forcing(self, samples: Samples | None, start: float, end: float) -> Pieces:
        """The measured forcing between two times [s] as a smooth signal."""
        if samples is None:
            return pieces(None)
        time, value = samples.between(start, end, MARGIN)
        if len(time) < 2:
            return pieces(None)
        knots = np.concatenate([[-FAR], time, [FAR]])
        return knots, np.ascontiguousarray(_hermite(time, value))

    def physical(self, stamps: Array) -> Array:
        """Times [s] at which measurements with these stamps were taken."""
        return physical_times(self.model, stamps)

    def inputs(self, stamps: Array, start: Start, command: Samples, forcing: Samples | None) -> Inputs:
        """Inputs between a start and the last of the stamps."""
        times = np.maximum(self.physical(stamps), start.time)
        begin, end = start.time, float(times[-1])
        later = self.command(command, begin, end, DELAY_STEP)
        return Inputs(times, self.command(command, begin, end), later, self.forcing(forcing, begin, end))

    def rows(
        self, given: Inputs, start: Start, command: Pieces | None = None, parameters: Array | None = None
    ) -> tuple[Array, Array] | None:
        """Rows (n, q + 2) at the times after the start, and the past that elements remember; None where the run diverges.

        `command` replaces the given one, `parameters` those of the model.
        """
        times = given.times
        none = pieces(None)
        out = np.empty((len(times) + 1, self.states + 2))
        done, past = self.compiled.resume(
            np.concatenate([[start.time], times]), *(command or given.command), *given.forcing, *none,
            self.parameters if parameters is None else parameters,
            np.ascontiguousarray(start.state), self.max_step, out, start.past,
        )  # fmt: skip
        if done <= len(times) or not np.abs(out[-1]).max() < DIVERGED:
            return None
        return out[1:], past

    def run(
        self,
        given: Inputs,
        start: Start,
        block: int,
        scatter: Array,
        sizes: Array | None,
    ) -> Run | None:
        """Simulate a segment whose number of samples is a multiple of `block`; None where the run diverges.

        `scatter` (q,) are the usual sizes of the states, `sizes` (p,) those of the changes; with None their sensitivities are left
        out.
        """
        nominal = self.rows(given, start)
        if nominal is None:
            return None
        rows, past = nominal
        q, p = self.states, len(self.changes)

        def averaged(output: Array) -> Array:
            return output.reshape(-1, block).mean(axis=1)

        output, slope = averaged(rows[:, q]), _slope(given.times, rows[:, q])
        by_start, end_by_start = np.zeros((len(output), q)), np.zeros((q, q))
        by_change, end_by_change = np.zeros((len(output), p)), np.zeros((q, p))

        def moved(other: tuple[Array, Array] | None, size: float) -> tuple[Array, Array]:
            if other is None:
                return np.zeros(len(output)), np.zeros(q)
            return averaged(other[0][:, q] - rows[:, q]) / size, (other[0][-1, :q] - rows[-1, :q]) / size

        for i in range(q):
            size = DIFFERENCE_STEP_SHARE * scatter[i]
            state = start.state.copy()
            state[i] += size
            there = Start(start.time, state, start.past)
            by_start[:, i], end_by_start[:, i] = moved(self.rows(given, there), size)
        for i, change in enumerate(self.changes if sizes is not None else ()):
            assert sizes is not None
            if change.name == "measurement_delay.delay":
                by_change[:, i] = -averaged(slope)
            elif change.delay:
                other = self.rows(given, start, command=given.later)
                by_change[:, i], end_by_change[:, i] = moved(other, DELAY_STEP)
            elif (place := self.places[i]) is not None:
                size = DIFFERENCE_STEP_SHARE * sizes[i]
                parameters = self.parameters.copy()
                parameters[place] += size
                other = self.rows(given, start, parameters=parameters)
                by_change[:, i], end_by_change[:, i] = moved(other, size)
        curvature = _slope(given.times, slope)
        return Run(
            output,
            slope,
            curvature,
            rows[-1, :q].copy(),
            by_start,
            by_change,
            end_by_start,
            end_by_change,
            past,
        )


def _slope(time: Array, value: Array) -> Array:
    """Rate of change (n,) at samples; 0 where neighbours have equal times."""
    step = np.gradient(time)
    return np.where(step > 0.0, np.gradient(value) / np.where(step > 0.0, step, 1.0), 0.0)


def _hermite(time: Array, value: Array) -> Array:
    """Coefficients (4, n + 1) of cubic pieces through samples (n,), with central differences for slopes; constant outside.

    E. Catmull, R. Rom, A class of local interpolating splines, in Computer Aided Geometric Design, 1974.
    """
    step, slope = np.diff(time), np.gradient(value, time)
    rise = np.diff(value) / step
    found = np.zeros((4, len(time) + 1))
    found[0, 0], found[0, -1] = value[0], value[-1]
    found[0, 1:-1], found[1, 1:-1] = value[:-1], slope[:-1]
    found[2, 1:-1] = (3.0 * rise - 2.0 * slope[:-1] - slope[1:]) / step
    found[3, 1:-1] = (slope[:-1] + slope[1:] - 2.0 * rise) / step**2
    return found
