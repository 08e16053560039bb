"""Extended Kalman filter that runs a model beside the machine, and its normalised innovations.

A segment of measurements is processed at once: factoring the covariance of all its innovations gives the same result as processing
one measurement after another (B. D. O. Anderson, J. B. Moore, Optimal Filtering, 1979, sections 3.1, 8.2 and 10.2). Between
segments a random force changes the velocity. Without it the filter's covariance would shrink, and it would cease to follow.

The effect of a change of physics on the innovations is computed as well: the change moves the outputs, and the filter follows in
part (M. Basseville, I. V. Nikiforov, Detection of Abrupt Changes, 1993, section 7.2.5).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgError, cholesky, solve_triangular

from rhythmid.twin.lateness import Doubt
from rhythmid.twin.samples import Samples
from rhythmid.twin.segment import Inputs, Run, Simulation, Start

Array = NDArray[np.float64]
KNOWN = 3.0  # initial standard deviation of a state, times its usual scatter


@dataclass(frozen=True)
class Filter:
    """Parameters of the filter.

    `noise` is the variance of a block average of the measurement. `kick` is that of the velocity change by random forces in a
    segment. `scatter` (q,) are the usual sizes of the states. `block` is the number of samples averaged into one, `samples` the
    number in a segment.
    """

    noise: float
    kick: float
    scatter: Array
    block: int
    samples: int


@dataclass(frozen=True)
class Innovations:
    """Innovations of a segment.

    `white` (m,) are normalised innovations, `by_change` (m, p) their sensitivities to each change. `log_density` is their log
    density up to a constant, `rms` the rms of the innovations in the measurement's unit.
    """

    white: Array
    by_change: Array
    log_density: float
    rms: float


class Observer:
    """The running filter; it processes one segment after another."""

    def __init__(self, simulation: Simulation, given: Filter, sizes: Array | None) -> None:
        self.simulation, self.given, self.sizes = simulation, given, sizes
        self.start: Start | None = None

    def begin(self, stamps: Array, values: Array) -> None:
        """Initialise at the last of some samples, with position and velocity of a straight line through them."""
        q = self.simulation.states
        time = float(self.simulation.physical(stamps)[-1])
        line = np.polynomial.Polynomial.fit(stamps - stamps[-1], values, 1)
        state = np.zeros(q)
        if self.simulation.settings.output_kind == "position":
            state[:2] = line(0.0), line.deriv()(0.0)
        elif self.simulation.settings.output_kind == "velocity":
            state[1] = line(0.0)
        self.start = Start(time, state)
        self.covariance = np.diag((KNOWN * self.given.scatter) ** 2)
        self.by_change = np.zeros((q, len(self.simulation.changes)))

    def take(
        self, stamps: Array, values: Array, doubt: Doubt, command: Samples, forcing: Samples | None
    ) -> Innovations | None:
        """Process a segment of measurements with uncertain times.

        None for the first segment, and where the model diverges; the filter is then initialised again.
        """
        if self.start is None:
            self.begin(stamps, values)
            return None
        block, scatter = self.given.block, self.given.scatter
        given = self.simulation.inputs(stamps, self.start, command, forcing)
        run = self.simulation.run(given, self.start, block, scatter, self.sizes)
        found = None if run is None else self._correct(run, given, values, doubt)
        if found is None:
            self.begin(stamps, values)
        return found

    def _of_times(self, run: Run, doubt: Doubt) -> Array:
        """Covariance (m, m) of the block averages due to uncertain times: an independent and a common part."""
        each, all_of_them = (
            (np.abs(run.slope) * late + 0.5 * np.abs(run.curvature) * late**2)
            .reshape(-1, self.given.block)
            .mean(axis=1)
            for late in (doubt.late, doubt.rms)
        )
        return np.diag(each**2) + np.outer(all_of_them, all_of_them)

    def _correct(self, run: Run, given: Inputs, values: Array, doubt: Doubt) -> Innovations | None:
        assert self.start is not None
        error = values.reshape(-1, self.given.block).mean(axis=1) - run.output
        sensitivity = run.by_start @ self.by_change + run.by_change
        before = self.covariance.copy()
        before[1, 1] += self.given.kick
        spread = run.by_start @ before @ run.by_start.T + self.given.noise * np.eye(len(error))
        spread += self._of_times(run, doubt)
        try:
            root = cholesky(spread, lower=True)
        except (LinAlgError, ValueError):
            return None
        joined = np.column_stack([error, sensitivity, run.by_start @ before])
        white = solve_triangular(root, joined, lower=True)
        p = len(self.simulation.changes)
        gain = white[:, 1 + p :].T  # for white innovations
        state = self.start.state + gain @ white[:, 0]
        again = self.simulation.rows(given, Start(self.start.time, state, self.start.past))
        if again is None:
            return None
        rows, past = again
        after = before - gain @ gain.T
        self.covariance = run.end_by_start @ after @ run.end_by_start.T
        self.covariance = 0.5 * (self.covariance + self.covariance.T)
        self.by_change = run.end_by_start @ (self.by_change - gain @ white[:, 1 : 1 + p]) + run.end_by_change
        self.start = Start(float(given.times[-1]), rows[-1, : self.simulation.states].copy(), past)
        density = -0.5 * float(white[:, 0] @ white[:, 0]) - float(np.log(np.diag(root)).sum())
        return Innovations(white[:, 0], white[:, 1 : 1 + p], density, float(np.sqrt(np.mean(error**2))))
