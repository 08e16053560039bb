"""Limit cycle of a model under periodic forcing: the fixed point of its period map.

Newton's method on x -> P(x) - x with the Jacobian of the period map by differences (shooting; R. Seydel, Practical Bifurcation
and Stability Analysis, 3rd ed., 2010, section 7.2), after a few periods of plain simulation have brought the state near.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicHermiteSpline

from rhythmid.elements.element import ELAPSED, STEP
from rhythmid.errors import InputError
from rhythmid.ltp.pumping import Pumping
from rhythmid.model import Model
from rhythmid.simulation.compiled import Compiled, compile_model, compile_rates
from rhythmid.simulation.right_hand_side import InputKind, Variant
from rhythmid.simulation.signal import pieces
from rhythmid.simulation.simulate import MAX_STEP, start_states

Array = NDArray[np.float64]
SAMPLES = 1000  # samples of the cycle
RELAXATION = 10  # periods simulated where Newton's method fails
SETTLING = 8  # periods simulated before Newton's method starts
DIVERGES = "the model diverges under its forcing; check its parameters"
TOLERANCE = 1e-11  # tolerance of the fixed point, relative to the motion


@dataclass(frozen=True, eq=False)
class RightHandSide:
    """dx/dt, sensor output and actuator force of a model at given points of cycle time [s], command and state."""

    compiled: Compiled
    parameters: Array
    pumping: Pumping

    def __call__(self, time: Array, states: Array, command: Array | None = None) -> Array:
        """Rows [dx/dt (q), output, effort] for times (n,), states (c, n, q) and commands (c,), 0 where None; shape
        (c, n, q + 2): c cases at the same times."""
        cases, n, q = states.shape
        out = np.empty((cases, n, q + 2))
        forcing = self.pumping(time) if self.pumping.active else np.zeros(n)
        given = np.zeros(cases) if command is None else command
        self.compiled.run(
            np.tile(time, cases), np.repeat(given, n), np.tile(forcing, cases),
            np.ascontiguousarray(states.reshape(-1, q)), self.parameters, out.reshape(-1, q + 2),
        )  # fmt: skip
        return out


def right_hand_side(model: Model, pumping: Pumping, excited: InputKind = "force") -> RightHandSide:
    """The model's right-hand side under the pumping; memory states are taken `MAX_STEP` earlier."""
    compiled = compile_rates(model, excited)
    parameters = compiled.layout.vector(model)
    for index, (name, _) in enumerate(compiled.layout.parameters):
        if name in (STEP, ELAPSED):
            parameters[index] = MAX_STEP
    return RightHandSide(compiled, parameters, pumping)


@dataclass(frozen=True, eq=False)
class LimitCycle:
    """A periodic motion in cycle time.

    Attributes
    ----------
    time : float64[n + 1] from 0 to T [s], both ends included.
    states, rates : float64[n + 1, q] state vector and its derivative; memory states as they were `MAX_STEP` earlier.
    output : float64[n + 1] sensor output.
    monodromy : float64[q, q] Jacobian of the period map; its eigenvalues are the Floquet multipliers.
    closure : distance between the state's two ends, relative to its motion.
    """

    model: Model
    pumping: Pumping
    excited: InputKind
    time: Array
    states: Array
    rates: Array
    output: Array
    monodromy: Array
    closure: float

    @cached_property
    def path(self) -> CubicHermiteSpline:
        """State as a function of cycle time within one period."""
        return CubicHermiteSpline(self.time, self.states, self.rates, axis=0)

    def harmonics(self, count: int) -> NDArray[np.complex128]:
        """Fourier coefficients X_0 … X_count of the output: ȳ(t) = Σ_n X_n exp(j n ω_p t), X_{−n} = conj X_n."""
        return np.fft.rfft(self.output[:-1])[: count + 1] / (len(self.output) - 1)

    @property
    def multipliers(self) -> NDArray[np.complex128]:
        """Floquet multipliers (q,), largest first; all inside the unit circle where the cycle is stable."""
        values = np.linalg.eigvals(self.monodromy).astype(complex)
        return values[np.argsort(-np.abs(values))]

    @property
    def ring_down(self) -> float:
        """Time constant [s] of the slowest decaying perturbation; infinite where one does not decay.

        A multiplier of one stands for a state that keeps its value (play, hysteresis) and is left out.
        """
        multipliers = self.multipliers
        slowest = float(np.abs(multipliers[np.abs(multipliers - 1.0) > 1e-6]).max(initial=0.0))
        if slowest >= 1.0 - 1e-9:
            return np.inf
        return self.pumping.period / -np.log(slowest) if slowest > 0.0 else 0.0


class PeriodMap:
    """Map x(0) -> x(T) of the forced, uncommanded model, with the trajectory between."""

    def __init__(self, model: Model, pumping: Pumping, excited: InputKind, max_step: float) -> None:
        self.compiled = compile_model(model, Variant(excited, rational=True))
        self.parameters = self.compiled.layout.vector(model)
        self.still = pieces(None)
        self.forcing = pieces(pumping.signal())
        self.ends = np.array([0.0, pumping.period])
        self.max_step = max_step

    def rows(self, start: Array, times: Array) -> Array:
        """Rows [state (q), output, effort] at cycle times (n,) within a period, from `start` (q,) at the first."""
        out = np.empty((len(times), len(start) + 2))
        done = self.compiled.run(
            times, *self.still, *self.forcing, *self.still, self.parameters, np.ascontiguousarray(start),
            self.max_step, out,
        )  # fmt: skip
        if done < len(times) or not np.isfinite(out[-1]).all():
            raise InputError(DIVERGES)
        return out

    def __call__(self, start: Array) -> Array:
        return self.rows(start, self.ends)[-1, : len(start)]

    def relaxed(self, start: Array, periods: int) -> Array:
        """The state after `periods` periods."""
        for _ in range(periods):
            start = self(start)
        return start

    def jacobian(self, start: Array, scale: Array) -> Array:
        """Central differences of the map with steps of 1e-4 of the motion; force jumps rule out smaller ones.

        Raises InputError where they overflow: the model diverges.
        """
        q = len(start)
        jacobian = np.empty((q, q))
        with np.errstate(over="ignore", invalid="ignore"):
            for i in range(q):
                step = np.zeros(q)
                step[i] = 1e-4 * scale[i]
                jacobian[:, i] = (self(start + step) - self(start - step)) / (2.0 * step[i])
        if not np.isfinite(jacobian).all():
            raise InputError(DIVERGES)
        return jacobian


def _start(model: Model, compiled: Compiled) -> Array:
    """State at rest: position at the first rest length, or zero."""
    return start_states(model, compiled, model.borrowed("linear_spring.rest_length", 0.0) or 0.0, 0.0)


def limit_cycle(
    model: Model,
    pumping: Pumping,
    guess: Array | None = None,
    excited: InputKind = "force",
    max_step: float | None = None,
    patience: int = 400,
) -> LimitCycle:
    """The limit cycle of a model: its motion under the pumping and its own drives, without command.

    `guess` (q,) is a state near the cycle at cycle time zero, such as `states[0]` of a similar model's cycle.
    `max_step` [s] bounds the integration step. Effects that depend on time other than periodically are taken as they
    are during the first period. Raises InputError when the model diverges or no cycle is found within `patience`
    periods.
    """
    step = max_step or min(MAX_STEP, pumping.period / SAMPLES)
    period_map = PeriodMap(model, pumping, excited, step)
    if guess is None:
        start = period_map.relaxed(_start(model, period_map.compiled), SETTLING)
    else:
        start = np.asarray(guess, dtype=float)
    grid = np.linspace(0.0, pumping.period, SAMPLES + 1)
    before = np.inf
    for _ in range(patience // RELAXATION):
        rows = period_map.rows(start, grid)
        states = rows[:, : len(start)]
        scale = np.maximum(np.ptp(states, axis=0), 1e-9 * np.abs(states).max(axis=0) + 1e-12)
        difference = states[-1] - start
        error = float(np.max(np.abs(difference) / scale))
        if error < TOLERANCE or (error < 1e-8 and error > 0.5 * before):
            break
        if error < 0.5 * before:
            jacobian = period_map.jacobian(start, scale)
            start = start + np.linalg.lstsq(np.eye(len(start)) - jacobian, difference, rcond=1e-9)[0]
            before = error
        else:  # Newton's method fails here, but the cycle is attractive
            start = period_map.relaxed(start, RELAXATION)
            before = np.inf
    if error > 1e-6:
        raise InputError(
            f"no limit cycle found: after {patience} periods of {pumping.period:.4g} s the motion still differs from one "
            f"period to the next by {error:.1e} of its size; the machine is not damped or its motion is not periodic"
        )
    jacobian = period_map.jacobian(start, scale)
    # its rate gives the change since then, see `right_hand_side`
    for place in period_map.compiled.layout.memories:
        states[:, place] = np.interp(grid - MAX_STEP, grid, states[:, place], period=pumping.period)
    rates = right_hand_side(model, pumping, excited)(grid, states[None])[0, :, : len(start)]
    return LimitCycle(
        model, pumping, excited, grid, states, rates, rows[:, len(start)].copy(), jacobian, error
    )
