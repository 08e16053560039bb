"""Linearisation of any model around its limit cycle: the periodic matrices A(t), B(t), C(t), D(t) of equation (1).

The Jacobian is taken by differences of the compiled right-hand side along the cycle. Where it jumps (a damper switches, a
contact opens) the instant is found by dividing intervals, and Fourier coefficients are integrated piece by piece between these
instants: for the paper's plant that gives the coefficients of s(t) in (13) exactly from its switch times. Where the
force itself jumps, perturbed motions cross the jump earlier or later: ξ becomes S ξ with the saltation matrix S (P. C.
Müller, Chaos, Solitons & Fractals 5 (1995) 1671). In A(t) that is an impulse J δ(t − t_s). A Fourier series takes the mean
of both sides at a jump, so S ξ − ξ = J (S ξ + ξ)/2, which gives J.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from rhythmid.ltp.limit_cycle import LimitCycle, PeriodMap, right_hand_side

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
PANELS = 96  # of the quadrature, in a period
NODES, WEIGHTS = np.polynomial.legendre.leggauss(6)
SMALLEST = 1e-3  # least jump relative to the variation of the quantity
STRETCH = 2e-3  # periods before and after a jump of the force over which its effect is measured
# parts of an interval that are evaluated at once in the search for a jump: a call costs more than its points
SECTIONS = 128
STEP = 1e-6  # of the differences, relative to the motion


@dataclass(frozen=True, eq=False)
class Impulse:
    """A Dirac impulse `size` δ(t − time) in A(t): effect of a force jump on perturbations."""

    time: float
    size: Array


@dataclass(frozen=True, eq=False)
class Linearisation:
    """Equation (1): dξ/dt = A(t) ξ + B(t) u, y = C(t) ξ + D(t) u, all of period T, in cycle time.

    Attributes
    ----------
    time, weight : float64[n] quadrature nodes over one period [s] and their weights [s].
    jacobian : float64[n, q + 1, q + 1] at the nodes: A | B over C | D.
    switches : float64[k] instants [s] at which these matrices jump.
    impulses : Dirac impulses in A(t) due to force jumps.
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
        kernel = np.exp(-1j * pumping.omega * np.multiply.outer(n, self.time)) * (
            self.weight / pumping.period
        )
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
        size[1] = max(size[1], 1e-3 * size[0] * cycle.pumping.omega)  # at rest
        self.steps = STEP * np.where(span > 1e-6 * size, span, np.where(size > 0.0, size, 1.0))
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
        """Jacobian and right-hand side as one row per time, each entry in units of the motion: (n, k)."""
        inside = np.mod(time, self.cycle.pumping.period)
        jacobian, flow = self.at(inside)
        motion = np.concatenate([self.steps, [self.effort_step]]) / STEP
        return np.hstack([(jacobian * motion).reshape(len(time), -1), flow])

    def variation(self) -> Array:
        """Variation of each entry of `scaled` along the cycle, (k,). It is at least a thousandth of the largest in
        its row of the Jacobian, so that rounding errors of differences do not count."""
        q = len(self.steps)
        values = self.scaled(self.cycle.time)
        largest = np.abs(values).max(axis=0)
        rows = largest[: (q + 1) ** 2].reshape(q + 1, q + 1).max(axis=1)
        rows[:q] = np.maximum(rows[:q], largest[(q + 1) ** 2 :])
        floor = 1e-3 * np.concatenate([np.repeat(rows, q + 1), rows[:q]])
        return np.maximum(np.ptp(values, axis=0), floor) + 1e-300

    def flow(self, time: Array) -> Array:
        """dx/dt (n, q) along the cycle."""
        return self.rates(time, self.cycle.path(time)[None])[0, :, : len(self.steps)]


def _narrowed(
    signal: Callable[[Array], Array], low: Array, high: Array, rounds: int
) -> tuple[Array, Array, Array]:
    """Divide each interval [low, high] into `SECTIONS` and keep the one across which the signal (n, k) changes most, in
    `rounds` rounds.

    Returns the ends and the largest remaining change (n,) across them.
    """
    each, change = np.arange(len(low)), np.zeros(len(low))
    for _ in range(rounds):
        grid = np.linspace(low, high, SECTIONS + 1)
        values = signal(grid.ravel()).reshape(*grid.shape, -1)
        changes = np.abs(np.diff(values, axis=0)).max(axis=2)
        most = changes.argmax(axis=0)
        low, high, change = grid[most, each], grid[most + 1, each], changes[most, each]
    return low, high, change


def _jumps(jacobian: _Jacobian) -> tuple[Array, Array]:
    """Instants (k,) at which Jacobian or right-hand side jump, and grid times around which they change rapidly."""
    time = jacobian.cycle.time
    inner = time[:-1] + 0.5 * np.diff(time)  # so that a switch at a grid time lies inside an interval
    low, high = np.concatenate([[inner[-1] - time[-1]], inner[:-1]]), inner
    period = jacobian.cycle.pumping.period
    scale = jacobian.variation()

    def signal(at: Array) -> Array:
        return jacobian.scaled(at) / scale

    after = signal(high)
    change = np.abs(after - np.roll(after, 1, axis=0)).max(axis=1)
    steep = high[change > 0.02]
    candidate = change > np.maximum(4.0 * np.median(change), SMALLEST)
    if not candidate.any():
        return np.empty(0), steep
    first, last, left = _narrowed(signal, low[candidate], high[candidate], 1)
    # a smooth change is spread over the interval, a jump is not; differences smear it over 1e-6 of the period
    jumped = left > 0.5 * change[candidate]
    if not jumped.any():
        return np.empty(0), steep
    first, last, _ = _narrowed(signal, first[jumped], last[jumped], 2)
    times = np.sort(np.mod(0.5 * (first + last), period))
    apart = np.concatenate([[True], np.diff(times) > 1e-9 * period]) if len(times) else np.empty(0, bool)
    return times[apart], steep


def _impulse(jacobian: _Jacobian, time: float) -> Impulse | None:
    """Impulse by a jump of the right-hand side at `time`; None where it is continuous there.

    The state's sensitivity across a short stretch is simulated in very fine steps. The saltation matrix remains
    after the smooth motion before and after the jump is removed.
    """
    cycle, period = jacobian.cycle, jacobian.cycle.pumping.period
    q = len(jacobian.steps)
    around = np.mod(time + np.array([-1e-5, 1e-5]) * period, period)
    before, after = jacobian.flow(around)
    if np.all(np.abs(after - before) < SMALLEST * np.abs(cycle.rates).max(axis=0)):
        return None
    half = STRETCH * period
    ends = np.array([time - half, time + half])
    start = cycle.path(ends[0] % period)
    period_map = PeriodMap(cycle.model, cycle.pumping, cycle.excited, half / 1e4)
    through = np.empty((q, q))
    for i, rate in enumerate(jacobian.flow(np.array([ends[0] % period]))[0]):
        shift = np.zeros(q)
        shift[i] = max(0.3 * half * abs(rate), 10.0 * jacobian.steps[i])  # the jump stays within the stretch
        up, down = (period_map.rows(start + sign * shift, ends)[-1, :q] for sign in (1.0, -1.0))
        through[:, i] = (up - down) / (2.0 * shift[i])
    smooth, _ = jacobian.at(np.mod(ends, period))
    saltation = expm(-smooth[1, :q, :q] * half) @ through @ expm(-smooth[0, :q, :q] * half)
    size = 2.0 * np.linalg.solve((saltation + np.eye(q)).T, (saltation - np.eye(q)).T).T
    return Impulse(time, size.astype(float))


def linearise(cycle: LimitCycle, effort: float | None = None) -> Linearisation:
    """Linearise a model around its limit cycle; equation (1), and for the paper's plant (11)-(13).

    `effort` [N] is the size of a perturbing command, which scales the difference steps; with None it is the size of the
    forcing, or 1.
    """
    if effort is None:
        effort = float(np.abs(cycle.pumping.coefficients[1:]).max(initial=0.0)) or 1.0
    jacobian = _Jacobian(cycle, effort)
    switches, steep = _jumps(jacobian)
    period = cycle.pumping.period
    edges = np.unique(
        np.concatenate(
            [np.linspace(0.0, period, PANELS + 1), switches, steep[(steep > 0) & (steep < period)]]
        )
    )
    edges = edges[np.concatenate([[True], np.diff(edges) > 1e-12 * period])]
    edges[-1] = period
    half = 0.5 * np.diff(edges)
    time = ((edges[:-1] + half)[:, None] + half[:, None] * NODES).ravel()
    weight = (half[:, None] * WEIGHTS).ravel()
    matrices, _ = jacobian.at(time)
    impulses = tuple(found for t in switches if (found := _impulse(jacobian, float(t))) is not None)
    return Linearisation(cycle, time, weight, matrices, switches, impulses)
