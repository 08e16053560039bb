"""The balance of forces of a machine of which nothing is known yet, by least squares: what goes with the acceleration, the speed and its
direction, the position and its sine. A first guess for a nominal model, no estimate: that is what `identify` is for."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from rhythmid.errors import InputError
from rhythmid.identify.inverse_dynamics.bandwidth import Bandwidth, bandwidth_of
from rhythmid.identify.inverse_dynamics.motion import Motion, high_pass, low_pass, motion_of, stretches
from rhythmid.model import Model
from rhythmid.record.record import Record

Array = NDArray[np.float64]
LATEST_ACTION = 0.2  # s by which what drives may act later than it was recorded, in a first guess
EARNS_PLACE = (
    0.9  # of what a balance leaves: by so much an element has to lower it to be among the first guesses
)
# of the power of what drives, that it has to explain, too: less is a matter of friction, ripple and noise, which anything takes up at random.
# Of a delay of half a radian, inertia, damper and spring leave (ω τ)²/2 of the size, which is as much; of a shorter one less
OF_THE_DRIVE = 0.015
STEADY = 1e-9  # of its size, within which what drives never changes: the rounding of the filters
COLUMNS = ("acceleration", "velocity", "position", "sine", "cosine", "constant", "friction")
POSITIVE = frozenset({"acceleration", "velocity", "position", "friction"})
SLOW = 0.03  # of the fast speed (its 95 % quantile), within which dry friction changes its sign: as for the balance of effort
MOST_ROWS = 4000  # of the balance: more would not make a first guess better
FED_BACK = 1e-3  # share of what drives that a multiple of the position leaves, below which a controller made it of the position
THERE_AND_BACK = 2.0  # of its travel, that a machine goes at least that comes back to where it began
LEAST_ROWS = 40  # rows of a stretch without which nothing is guessed from it


@dataclass(frozen=True)
class Law:
    """Coefficients by column, the share of the driving signal's power that they leave (0: nothing), and by how much later it acts [s]."""

    coefficients: dict[str, float]
    left: float
    delay: float = 0.0

    def earns_place(self, simpler: "Law") -> bool:
        """Whether it explains clearly more than a simpler law, of what that leaves and of what drives."""
        return self.left < EARNS_PLACE * simpler.left and simpler.left - self.left >= OF_THE_DRIVE


@dataclass(frozen=True, eq=False)
class Rows:
    """What drives, and the columns of the balance, of all stretches, low-pass filtered.

    `drives` (n,) and `columns` (n, 7) of each stretch, in the order of COLUMNS; `period` [s] of each, as the filtered motion is sampled; `margin` samples at either end
    that the filter spoils. `latest` [s] is by how much later what drives may act at most. `span` is the travel of the position, relative to the base where that moves; where the base drives
    (`by_base`), what drives is −a.
    """

    drives: tuple[Array, ...]
    columns: tuple[Array, ...]
    period: tuple[float, ...]
    margin: tuple[int, ...]
    span: float
    bandwidth: Bandwidth
    by_base: bool
    latest: float = LATEST_ACTION

    @classmethod
    def of(cls, records: Sequence[Record], bare: Model) -> "Rows":
        """Rows of records whose input or effort drives. Raises InputError where they are too short or nothing drives them."""
        raw = stretches(records, bare)
        chosen = bandwidth_of(raw, bare)
        motions = [motion_of(one, bare, chosen.motion, chosen.low) for one in raw]
        motions = [one for one in motions if len(one.time) >= LEAST_ROWS]
        if not motions:
            raise InputError("the records are too short for a balance of forces")
        fast = float(np.quantile(np.abs(np.concatenate([one.leg_velocity for one in motions])), 0.95))
        made = [_filtered(one, chosen, SLOW * fast) for one in motions]
        return cls(
            tuple(both[:, 0] for both in made), tuple(both[:, 1:] for both in made), tuple(one.period for one in motions),
            tuple(min(int(1.0 / (chosen.effort * one.period)), len(one.time) // 8) for one in motions),
            max(float(np.ptp(one.leg_position)) for one in motions), chosen, motions[0].driven_by_base,
        )  # fmt: skip

    @property
    def steady(self) -> bool:
        """Whether what drives never changes: then a constant balances it, and tells nothing of the machine."""
        every = np.concatenate(self.drives)
        return not self.by_base and bool(np.ptp(every) <= STEADY * np.abs(every).max())

    @property
    def reversed(self) -> "Rows":
        """The same with what drives counted the other way."""
        return replace(self, drives=tuple(-one for one in self.drives))

    @property
    def comes_back(self) -> bool:
        """Whether the position goes more than there and back: its path is twice its travel at least."""
        place = COLUMNS.index("position")
        path = sum(float(np.abs(np.diff(one[:, place])).sum()) for one in self.columns)
        return path >= THERE_AND_BACK * self.span

    def delay(self, names: Sequence[str]) -> float:
        """By how much later [s] what drives acts, where that makes the balance of these columns clearly better; else 0.

        A balance that is still getting better at the end of the range shows no delay.
        """
        if self.by_base or self.steady or self.is_fed_back():
            return 0.0
        period = max(self.period)
        most = min(
            self.latest, 0.25 * min(len(one) * p for one, p in zip(self.drives, self.period, strict=True))
        )
        delays = [number * period for number in range(1, int(most / period) + 1)]
        at_once = self.fit(names)
        best = min((self.fit(names, one) for one in delays), key=lambda law: law.left, default=at_once)
        at_the_end = not delays or best.delay == delays[-1]
        return best.delay if best.earns_place(at_once) and not at_the_end else 0.0

    def is_fed_back(self) -> bool:
        """Whether what drives is −k times the position and a constant: a delayed balance would tell of that law, not of the machine."""
        x, drive = (
            np.concatenate(
                [one[margin : len(one) - margin] for one, margin in zip(of, self.margin, strict=True)]
            )
            for of in ([one[:, COLUMNS.index("position")] for one in self.columns], self.drives)
        )
        x, drive = x - x.mean(), drive - drive.mean()
        both = float(x @ drive)
        return both < 0.0 and 1.0 - both**2 / (float(x @ x) * float(drive @ drive)) < FED_BACK

    def fit(self, names: Sequence[str], delay: float = 0.0) -> Law:
        """Force balance of these columns; coefficients of acceleration, velocity and position are not negative."""
        places = [COLUMNS.index(name) for name in names]
        every = max(1, sum(map(len, self.drives)) // MOST_ROWS)
        sides, matrices = [], []
        for drive, columns, period, margin in zip(
            self.drives, self.columns, self.period, self.margin, strict=True
        ):
            step = round(delay / period)
            rows = np.arange(margin + step, len(drive) - margin, every)
            sides.append(drive[rows - step])
            matrices.append(columns[rows][:, places])
        side, matrix = np.concatenate(sides), np.vstack(matrices)
        size = np.linalg.norm(matrix, axis=0)
        told = size > 0.0
        size[~told] = 1.0
        low = [0.0 if name in POSITIVE else -np.inf for name in names]
        solved = lsq_linear(matrix / size, side, (low, np.inf))
        told &= solved.active_mask == 0  # it ends a little inside a bound, which stands for nothing at all
        power = float(np.sum((side - (0.0 if self.steady else side.mean())) ** 2)) or 1.0
        return Law(
            dict(zip(names, np.where(told, solved.x / size, 0.0).tolist(), strict=True)),
            2.0 * float(solved.cost) / power,
            delay,
        )


def _filtered(one: Motion, bandwidth: Bandwidth, slow: float) -> Array:
    """What drives and all columns (n, 8), without what is above the effort's bandwidth; friction changes its sign within the speed `slow`."""
    x, v = one.leg_position, one.leg_velocity
    friction = np.tanh(v / slow) if slow > 0.0 else np.zeros(len(v))
    level = np.ones(len(x))
    both = np.column_stack([one.effort, one.acceleration, v, x, np.sin(x), np.cos(x), level, friction])
    both = high_pass(low_pass(both, one.period, bandwidth.effort), one.period, bandwidth.low)
    if bandwidth.low > 0.0:
        both[:, 1 + COLUMNS.index("constant")] = 0.0  # what the filter leaves of a constant tells nothing
    return both
