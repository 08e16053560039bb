"""Linearisation of any model around its limit cycle: the periodic matrices A(t), B(t), C(t), D(t) of equation (1).

The Jacobian is taken by differences of the compiled right-hand side along the cycle. Where it jumps (a damper switches, a
contact opens) the instant is found by bisection, and Fourier coefficients are integrated piece by piece between these
instants: for the paper's plant that gives the coefficients of s(t) in (13) exactly from its switch times. Where the
force itself jumps, perturbed motions cross the jump earlier or later, which acts like an impulse in A(t): the
saltation matrix (P. C. Müller, Chaos, Solitons & Fractals 5 (1995) 1671), whose logarithm is that impulse's size.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import logm

from rhythmid.ltp.limit_cycle import LimitCycle, right_hand_side

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
PANELS = 96  # of the quadrature, in a period
NODES, WEIGHTS = np.polynomial.legendre.leggauss(6)
STEP = 1e-6  # of the differences, relative to the motion


@dataclass(frozen=True, eq=False)
class Impulse:
    """A Dirac impulse `size` δ(t − time) in A(t): what a jump of the force does to perturbations."""

    time: float
    size: Array


@dataclass(frozen=True, eq=False)
class Linearisation:
    """Equation (1): dξ/dt = A(t) ξ + B(t) u, y = C(t) ξ + D(t) u, all of period T, in cycle time.

    Attributes
    ----------
    time, weight : float64[n] quadrature nodes over one period [s] and their weights [s].
    jacobian : float64[n, q + 1, q + 1] at the nodes: A | B over C | D.
    switches : float64[k] instants at which they jump [s].
    impulses : what jumps of the force add to A(t).
    """

    cycle: LimitCycle
    time: Array
    weight: Array
    jacobian: Array
    switches: Array
    impulses: tuple[Impulse, ...]

    def fourier(self, order: int) -> Complex:
        """Fourier coefficients −order … order of A | B over C | D, impulses included; (2 order + 1, q + 1, q + 1)."""
        pumping = self.cycle.pumping
        n = np.arange(order + 1)
        kernel = np.exp(-1j * pumping.omega * np.multiply.outer(n, self.time)) * (self.weight / pumping.period)
        flat = self.jacobian.reshape(len(self.time), -1).astype(complex)
        half = (kernel @ flat).reshape(order + 1, *self.jacobian.shape[1:]).astype(complex)
        for impulse in self.impulses:
            q = len(impulse.size)
            turn = np.exp(-1j * pumping.omega * n * impulse.time) / pumping.period
            half[:, :q, :q] += turn[:, None, None] * impulse.size
        return np.concatenate([np.conj(half[:0:-1]), half])


class _Jacobian:
    """Right-hand side along the cycle and its Jacobian, by central differences with a step of 1e-6 of the motion."""

    def __init__(self, cycle: LimitCycle, effort: float) -> None:
        self.cycle = cycle
        self.rates = right_hand_side(cycle.model, cycle.pumping, cycle.excited)
        span = np.ptp(cycle.states, axis=0)
        size = np.abs(cycle.states).max(axis=0)
        self.steps = STEP * np.where(span > 1e-9 * size, span, np.where(size > 0.0, size, 1.0))
        self.effort_step = STEP * effort

    def at(self, time: Array) -> tuple[Array, Array]:
        """[∂(dx/dt, y)/∂(x, u)] of shape (n, q + 1, q + 1), A | B over C | D; and dx/dt (n, q)."""
        q = len(self.steps)
        shifts = np.zeros((2 * q + 3, q))
        shifts[np.arange(q), np.arange(q)] = self.steps
        shifts[np.arange(q, 2 * q), np.arange(q)] = -self.steps
        command = np.zeros(2 * q + 3)
        command[2 * q : 2 * q + 2] = self.effort_step, -self.effort_step
        rows = self.rates(time, self.cycle.path(time)[None] + shifts[:, None, :], command)[:, :, : q + 1]
        columns = [(rows[i] - rows[q + i]) / (2.0 * step) for i, step in enumerate(self.steps)]
        columns.append((rows[2 * q] - rows[2 * q + 1]) / (2.0 * self.effort_step))
        return np.stack(columns, axis=2), rows[-1, :, :q]

    def scaled(self, time: Array) -> Array:
        """Jacobian and right-hand side as one row a time, each entry in units of the motion: (n, k)."""
        inside = np.mod(time, self.cycle.pumping.period)
        jacobian, flow = self.at(inside)
        motion = np.concatenate([self.steps, [self.effort_step]]) / STEP
        return np.hstack([(jacobian * motion).reshape(len(time), -1), flow])

    def flow(self, time: Array, offset: Array) -> Array:
        """dx/dt (n, q) at the cycle's states plus `offset` (q,)."""
        inside = np.mod(time, self.cycle.pumping.period)
        return self.rates(inside, (self.cycle.path(inside) + offset)[None])[0, :, : len(offset)]


def _bisect(scaled: Callable[[Array], Array], low: Array, high: Array, rounds: int) -> tuple[Array, Array, Array]:
    """Halve each interval [low, high] towards the side across which the signal changes more.

    Returns the ends and the change (n, k) that is left across them.
    """
    at_low, at_high = scaled(low), scaled(high)
    size = np.maximum(np.abs(at_low), np.abs(at_high)).max(axis=0) + 1e-300
    for _ in range(rounds):
        middle = 0.5 * (low + high)
        at_middle = scaled(middle)
        left = np.abs((at_middle - at_low) / size).max(axis=1) > np.abs((at_high - at_middle) / size).max(axis=1)
        high, low = np.where(left, middle, high), np.where(left, low, middle)
        at_high = np.where(left[:, None], at_middle, at_high)
        at_low = np.where(left[:, None], at_low, at_middle)
    return low, high, at_high - at_low


def _jumps(jacobian: _Jacobian) -> tuple[Array, Array]:
    """Instants at which Jacobian or right-hand side jump (k,), and grid times around which they change fast."""
    time = jacobian.cycle.time
    inner = time[:-1] + 0.5 * np.diff(time)  # a switch on a grid time is then inside an interval
    low, high = np.concatenate([[inner[-1] - time[-1]], inner[:-1]]), inner
    period = jacobian.cycle.pumping.period
    after = jacobian.scaled(high)
    before = np.roll(after, 1, axis=0)
    spread = np.maximum(np.ptp(after, axis=0), 1e-7 * np.abs(after).max(axis=0)) + 1e-300
    change = np.abs((after - before) / spread).max(axis=1)
    steep = high[change > 0.02]
    candidate = change > np.maximum(4.0 * np.median(change), 1e-6)
    if not candidate.any():
        return np.empty(0), steep
    first, last, left = _bisect(jacobian.scaled, low[candidate], high[candidate], 7)
    # a smooth change is spread over the interval, a jump is not; differences smear it over 1e-6 of the period
    jumped = np.abs(left / spread).max(axis=1) > 0.5 * change[candidate]
    if not jumped.any():
        return np.empty(0), steep
    first, last, _ = _bisect(jacobian.scaled, first[jumped], last[jumped], 14)
    times = np.sort(np.mod(0.5 * (first + last), period))
    apart = np.concatenate([[True], np.diff(times) > 1e-9 * period]) if len(times) else np.empty(0, bool)
    return times[apart], steep


def _impulse(jacobian: _Jacobian, time: float) -> Impulse | None:
    """What a jump of the right-hand side at `time` does; None where it is continuous there."""
    period = jacobian.cycle.pumping.period
    q = len(jacobian.steps)
    margin = 1e-7 * period

    still = np.zeros(q)
    before, after = jacobian.flow(np.array([time - margin, time + margin]), still)
    jump = after - before
    size = np.abs(jacobian.cycle.rates).max(axis=0) + 1e-300
    if np.max(np.abs(jump) / size) < 1e-5:
        return None
    later = np.zeros(q)  # how much later the jump comes when a state is larger
    width = 1e-3 * period
    for i, step in enumerate(jacobian.steps):
        shift = np.zeros(q)
        shift[i] = 100.0 * step
        ends = []
        for sign in (1.0, -1.0):
            low, high, _ = _bisect(
                partial(jacobian.flow, offset=sign * shift), np.array([time - width]), np.array([time + width]), 40
            )
            ends.append(0.5 * float(low[0] + high[0]))
        later[i] = (ends[0] - ends[1]) / (200.0 * step)
    saltation = np.eye(q) - np.outer(jump, later)
    return Impulse(time, np.real(logm(saltation)))


def linearise(cycle: LimitCycle, effort: float | None = None) -> Linearisation:
    """Linearise a model around its limit cycle; equation (1), and for the paper's plant (11)-(13).

    `effort` [N] is the size of a perturbing command, against which difference steps are measured; the size of the
    forcing, or 1, where it is None.
    """
    if effort is None:
        effort = float(np.abs(cycle.pumping.coefficients[1:]).max(initial=0.0)) or 1.0
    jacobian = _Jacobian(cycle, effort)
    switches, steep = _jumps(jacobian)
    period = cycle.pumping.period
    edges = np.unique(np.concatenate([np.linspace(0.0, period, PANELS + 1), switches, steep[(steep > 0) & (steep < period)]]))
    edges = edges[np.concatenate([[True], np.diff(edges) > 1e-12 * period])]
    edges[-1] = period
    half = 0.5 * np.diff(edges)
    time = ((edges[:-1] + half)[:, None] + half[:, None] * NODES).ravel()
    weight = (half[:, None] * WEIGHTS).ravel()
    matrices, _ = jacobian.at(time)
    impulses = tuple(found for t in switches if (found := _impulse(jacobian, float(t))) is not None)
    return Linearisation(cycle, time, weight, matrices, switches, impulses)
