"""Force balance of an unknown machine by least squares: terms proportional to the acceleration, the speed and its
sign, the position and its sine. It gives a first guess for a nominal model; the estimate is the task of
`identify`."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear
from scipy.signal import lfilter

from rhythmid.errors import InputError
from rhythmid.identify.inverse_dynamics.bandwidth import Bandwidth, bandwidth_of
from rhythmid.identify.inverse_dynamics.motion import (
    Motion,
    Stretch,
    high_pass,
    low_pass,
    motion_of,
    stretches,
)
from rhythmid.model import Model
from rhythmid.record.back_and_forth import goes_back_and_forth
from rhythmid.record.record import Record

Array = NDArray[np.float64]
LATEST_ACTION = 0.2  # [s] largest delay of the driving signal in a first guess
EARNS_PLACE = 0.9  # ratio of residuals to which an element has to lower the balance to be a first guess
# share of the driving signal's power that the element also has to explain: less may be friction, ripple and noise,
# which any element absorbs at random. With a delay of half a radian, inertia, damper and spring leave (ω τ)²/2 of
# the size, which is as much; with a shorter one less
OF_THE_DRIVE = 0.015
# ratio of residuals below which a delay is better than a lag however little both leave: a lag in place of a delay leaves
# (ω τ)⁴/4 of the power, and more with every further effect that it takes on
OF_A_LAG = 0.5
STEADY = 1e-9  # relative variation below which the driving signal is constant: rounding error of the filters
# acceleration that a sensor of angle reads off centre, e v² sin(x − φ): once a turn as gravity is, but growing with the speed
OFF_CENTRE = ("off_centre_sine", "off_centre_cosine")
OF_ANGLE = ("sine", "cosine")
LEFT_OF_A_TURN = 0.1  # least share of such a column's power within the filter: less is the end of a band, where turns are slow
COLUMNS = ("acceleration", "velocity", "position", *OF_ANGLE, "constant", "friction", *OFF_CENTRE)
POSITIVE = frozenset({"acceleration", "velocity", "position", "friction"})
# share of the fast speed (its 95 % quantile) within which dry friction changes its sign: as for the effort balance
SLOW = 0.03
MOST_ROWS = 4000  # largest number of rows: more would not improve a first guess
# share of the driving signal that a multiple of the position leaves, below which it is a controller's position feedback
FED_BACK = 1e-3
LEAST_ROWS = 40  # least rows of a stretch for a guess


@dataclass(frozen=True)
class Law:
    """Coefficients by column, the share of the driving signal's power that they leave unexplained, and its delay [s]."""

    coefficients: dict[str, float]
    left: float
    delay: float = 0.0

    def earns_place(self, simpler: "Law") -> bool:
        """Whether it explains clearly more than a simpler law, relative to that law's residual and to the driving
        signal."""
        return self.left < EARNS_PLACE * simpler.left and simpler.left - self.left >= OF_THE_DRIVE


@dataclass(frozen=True, eq=False)
class Rows:
    """The driving signal and the columns of the balance for all stretches, low-pass filtered.

    `drives` (n,) and `columns` (n, 9) belong to each stretch, in the order of COLUMNS. `period` [s] is the sample
    period of the filtered motion, `margin` the number of samples at either end that are affected by the filter.
    `latest` [s] is the longest delay of the driving signal. `span` is the travel of the position, relative to a moving base.
    Where the base drives the machine (`by_base`), the driving signal is −a.
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
        """Rows of records driven by input or effort. Raises InputError where they are too short or have no driving
        signal."""
        raw = stretches(records, bare)
        chosen = bandwidth_of(raw, bare)
        every = [(motion_of(one, bare, chosen.motion, chosen.low), one) for one in raw]
        every = [(motion, one) for motion, one in every if len(motion.time) >= LEAST_ROWS]
        if not every:
            raise InputError("the records are too short for a balance of forces")
        motions = [motion for motion, _ in every]
        fast = float(np.quantile(np.abs(np.concatenate([one.leg_velocity for one in motions])), 0.95))
        margins = tuple(min(int(1.0 / (chosen.effort * one.period)), len(one.time) // 8) for one in motions)
        made = [_filtered(one, chosen, SLOW * fast) for one in motions]
        for both, (motion, one), margin in zip(made, every, margins, strict=True):
            if (level := _level(one, motion.time[margin], motion.time[-1 - margin])) is not None:
                both[:, 0] = level
        return cls(
            tuple(both[:, 0] for both in made), tuple(both[:, 1:] for both in made), tuple(one.period for one in motions), margins,
            max(float(np.ptp(one.leg_position)) for one in motions), chosen, motions[0].driven_by_base,
        )  # fmt: skip

    @property
    def steady(self) -> bool:
        """Whether the driving signal is constant: then a constant balances it, and it contains no information about
        the machine."""
        every = np.concatenate(self.drives)
        return not self.by_base and bool(np.ptp(every) <= STEADY * np.abs(every).max())

    @property
    def reversed(self) -> "Rows":
        """The same rows with the opposite sign of the driving signal."""
        return replace(self, drives=tuple(-one for one in self.drives))

    @property
    def comes_back(self) -> bool:
        """Whether the position goes back and forth."""
        place = COLUMNS.index("position")
        return goes_back_and_forth([one[:, place] for one in self.columns])

    def delay(self, names: Sequence[str]) -> float:
        """Delay [s] of the driving signal that makes the balance of these columns clearly better; else 0.

        If the balance still improves at the end of the range, no delay is detected; nor if a lag of the driving signal
        explains nearly as much.
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
        if at_the_end or not best.earns_place(at_once):
            return 0.0
        lag = min((self.lagged(one).fit(names) for one in delays), key=lambda law: law.left)
        return best.delay if best.earns_place(lag) or best.left < OF_A_LAG * lag.left else 0.0

    def lagged(self, constant: float) -> "Rows":
        """The same rows with the driving signal after a lag of this time constant [s]."""
        shares = [math.exp(-period / constant) for period in self.period]
        made = [
            lfilter([1.0 - share], [1.0, -share], drive - drive[0]) + drive[0]
            for share, drive in zip(shares, self.drives, strict=True)
        ]
        return replace(self, drives=tuple(made))

    def is_fed_back(self) -> bool:
        """Whether the driving signal is −k times the position plus a constant: a delayed balance would fit that
        feedback, not the machine."""
        x, drive = (
            np.concatenate(
                [one[margin : len(one) - margin] for one, margin in zip(of, self.margin, strict=True)]
            )
            for of in ([one[:, COLUMNS.index("position")] for one in self.columns], self.drives)
        )
        x, drive = x - x.mean(), drive - drive.mean()
        both = float(x @ drive)
        return both < 0.0 and 1.0 - both**2 / (float(x @ x) * float(drive @ drive)) < FED_BACK

    def fit(self, names: Sequence[str], delay: float = 0.0, followed: str = "", moving: bool = False) -> Law:
        """Force balance of these columns; coefficients of acceleration, velocity and position are nonnegative.

        The coefficient of the column that is `followed` is one, beside those of `names`: the driving signal is a reference.
        `moving` leaves out the rows at rest, at which dry friction balances any driving signal up to its size.
        """
        places = [COLUMNS.index(name) for name in names]
        every = max(1, sum(map(len, self.drives)) // MOST_ROWS)
        sides, kept = [], []
        for drive, columns, period, margin in zip(
            self.drives, self.columns, self.period, self.margin, strict=True
        ):
            step = round(delay / period)
            rows = np.arange(margin + step, len(drive) - margin, every)
            sides.append(drive[rows - step])
            kept.append(columns[rows])
        drives, columns = np.concatenate(sides), np.vstack(kept)
        if moving:
            speed = np.abs(columns[:, COLUMNS.index("velocity")])
            moves = speed > SLOW * float(np.quantile(speed, 0.95))
            drives, columns = drives[moves], columns[moves]
        side = drives - columns[:, COLUMNS.index(followed)] if followed else drives
        matrix = columns[:, places]
        size = np.linalg.norm(matrix, axis=0)
        told = size > 0.0
        size[~told] = 1.0
        low = [0.0 if name in POSITIVE else -np.inf for name in names]
        # the triangle of the rows has the same solution and the same residual, in as many rows as columns
        triangle = np.asarray(np.linalg.qr(np.column_stack([matrix / size, side]), mode="r"))
        solved = lsq_linear(triangle[:, :-1], triangle[:, -1], (low, np.inf), method="bvls")
        told &= solved.active_mask == 0
        power = float(np.sum((drives - (0.0 if self.steady else drives.mean())) ** 2)) or 1.0
        return Law(
            dict(zip(names, np.where(told, solved.x / size, 0.0).tolist(), strict=True)),
            2.0 * float(solved.cost) / power,
            delay,
        )


def _level(one: Stretch, begin: float, end: float) -> float | None:
    """The force that drives without a change from `begin` to `end` [s], such as one that is switched off where the recording
    ends: only the filter spreads that change over the rows. None where it changes, or a base drives."""
    within = one.drive[(one.time >= begin) & (one.time <= end)]
    if one.kind != "force" or not len(within) or np.ptp(within) > STEADY * np.abs(within).max():
        return None
    return float(within[0])


def _filtered(one: Motion, bandwidth: Bandwidth, slow: float) -> Array:
    """The driving signal and all columns (n, 10) below the effort's bandwidth; friction changes its sign within the
    speed `slow`."""
    x, v = one.leg_position, one.leg_velocity
    friction = np.tanh(v / slow) if slow > 0.0 else np.zeros(len(v))
    level = np.ones(len(x))
    sine, cosine = np.sin(x), np.cos(x)
    both = np.column_stack(
        [one.effort, one.acceleration, v, x, sine, cosine, level, friction, v**2 * sine, v**2 * cosine]
    )
    whole = np.var(both, axis=0)
    both = high_pass(low_pass(both, one.period, bandwidth.effort), one.period, bandwidth.low)
    turned = [1 + COLUMNS.index(name) for name in (*OF_ANGLE, *OFF_CENTRE)]
    # in turns too fast for the filter, what it leaves of a sine is no force of the angle but follows the speed
    both[:, [place for place in turned if np.var(both[:, place]) < LEFT_OF_A_TURN * whole[place]]] = 0.0
    if bandwidth.low > 0.0:
        # the remainder of a constant after the filter contains no information
        both[:, 1 + COLUMNS.index("constant")] = 0.0
    return both
