"""Rests as evidence: the effort at a rest beyond what the model balances there.

At rest the recorded effort must be what the model requires: exactly where the model has no dry friction, and within the friction at rest
where it has. The efforts that a model balances at rest are the interval between those of a motion that comes to rest there from above and
of one that comes to rest from below. Dry friction, hysteresis and a dead band make it wide. Without them it is a point, but for the forces at
the speed below which a motion counts as rest.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import reduce
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rhythmid.identify.inverse_dynamics.motion import Motion
from rhythmid.identify.noise import runs
from rhythmid.model import Model, Term
from rhythmid.simulation.effect import Path, effect_along

if TYPE_CHECKING:
    from rhythmid.identify.inverse_dynamics.balance import Balance

Array = NDArray[np.float64]
# share of the range of all motions that a machine must have gone beyond a rest, for it to be free to move there: elsewhere a stop
# that is not modelled may hold it
BEYOND = 0.05
COMES = 48  # samples in which a motion comes to rest
TRAVELS = 2.0  # ranges of the motion that it travels meanwhile: further than any hysteresis that slides within the records
STAYS = 16  # samples below the speed of rest after them
MOST = 32  # rests that are evaluated: of more, as many that are spread evenly
# ratio of static to sliding friction up to which a friction that is fitted to the motion counts as holding a rest (B. Armstrong-Hélouvry,
# P. Dupont, C. Canudas de Wit, Automatica 30 (1994) 1083: static friction exceeds the sliding one)
STATIC = 2.0
DRIVES = ("command", "actuator")  # slots that the effort passes, in this order
TURNS = "transition"  # name of the speed within which the sign of a dry friction turns; it makes the law smooth, but no friction at rest smaller


@dataclass(frozen=True, eq=False)
class Rest:
    """One rest: the filtered effort (n,), and whether the machine is known to be free to move upwards and downwards from there."""

    effort: Array
    up: bool
    down: bool


@dataclass(frozen=True, eq=False)
class Rests:
    """The rests of a balance. `approaches` has two motions for each: they come to rest there from above and from below."""

    found: tuple[Rest, ...] = ()
    approaches: "Balance | None" = None

    @classmethod
    def of(cls, balance: "Balance") -> "Rests":
        """Rests without their ends, to which the filter spreads the effort of the motion.

        There are none where the whole force at rest is not known: on a moving base, for one joint of several, for an effort that follows
        from a controller, for a motion without its slow part, and where no motor acts.
        """
        motions = balance.motions
        if balance.by_reference or balance.undriven or balance.bandwidth.low > 0.0:
            return cls()
        if any(one.driven_by_base or one.coupling is not None for one in motions):
            return cls()
        low = min(float(one.leg_position.min()) for one in motions)
        high = max(float(one.leg_position.max()) for one in motions)
        margin = BEYOND * (high - low)
        found: list[tuple[Rest, list[Motion]]] = []
        for motion in motions:
            effort = balance.filtered(motion.effort, motion.period)
            half = math.ceil(0.5 / (balance.bandwidth.effort * motion.period))
            for part in runs(np.abs(motion.leg_velocity) <= balance.stick_speed):
                rows = motion.recorded(np.arange(part.start + half, part.stop - half))
                if len(rows) < 2 * half:
                    continue
                place = float(np.mean(motion.leg_position[rows]))
                rest = Rest(effort[rows], place + margin < high, place - margin > low)
                if rest.up or rest.down:
                    time = float(motion.time[rows[len(rows) // 2]])
                    found.append((rest, _approaches(motions, motion, place, time, balance.stick_speed)))
        if len(found) > MOST:
            found = [found[i] for i in np.linspace(0.0, len(found) - 1.0, MOST).round().astype(int)]
        if not found:
            return cls()
        approaches = tuple(motion for _, two in found for motion in two)
        return cls(
            tuple(rest for rest, _ in found),
            replace(balance, motions=approaches, places=(), _forces={}, _sensitive={}),
        )

    def excess(self, model: Model) -> list[Array]:
        """For each rest, the effort (n,) that the model does not balance: recorded less required. It is 0 within the friction at rest,
        and where it presses the machine to where it was never seen."""
        if self.approaches is None:
            return []
        model = _sharp(model)
        motor = [
            t for t in model.terms if t.element.slot in DRIVES and t.element.kernel and not t.element.own
        ]
        free = reduce(lambda one, term: one.pruned(term.label), motor, model)
        held, needed = (self._balanced(one) for one in ((model, free) if motor else (model, model)))
        found = []
        for number, (rest, (least, most), force) in enumerate(zip(self.found, held, needed, strict=True)):
            beyond = (
                np.maximum(rest.effort - most, 0.0) * rest.up
                + np.minimum(rest.effort - least, 0.0) * rest.down
            )
            if motor:  # what comes out of a dead band may be balanced although no effort is computed for it
                out = self._through(number, motor, model)
                beyond = np.where((out >= force[0]) & (out <= force[1]), 0.0, beyond)
            found.append(beyond)
        return found

    def _balanced(self, model: Model) -> list[tuple[float, float]]:
        """Smallest and largest effort that a model balances at each rest, with a static friction larger than the sliding one."""
        assert self.approaches is not None
        ends = [one[-STAYS:] for one in self.approaches.required(model)]
        pairs = [np.concatenate(two) for two in zip(ends[::2], ends[1::2], strict=True)]
        half = [0.5 * (STATIC - 1.0) * float(np.ptp(one)) for one in pairs]
        return [
            (float(one.min()) - more, float(one.max()) + more) for one, more in zip(pairs, half, strict=True)
        ]

    def _through(self, number: int, motor: Sequence[Term], model: Model) -> Array:
        """What elements without a past make of the effort (n,) of a rest, in their order."""
        assert self.approaches is not None
        signal, motion = self.found[number].effort, self.approaches.motions[2 * number]
        zero = np.zeros(len(signal))
        for term in sorted(motor, key=lambda one: DRIVES.index(one.element.slot)):
            path = Path(zero + motion.time[-1], zero + motion.position[-1], zero, signal, zero, signal)
            signal = signal + effect_along(term.element, term.numbers, model, path)
        return signal


def _approaches(
    motions: Sequence[Motion], motion: Motion, place: float, time: float, slow: float
) -> list[Motion]:
    """Two motions that come to rest at a place and time, from above and from below; their position is that of the rest all the time."""
    speed, rate, span = (
        float(np.max(np.abs(np.concatenate(signals))))
        for signals in (
            [one.leg_velocity for one in motions],
            [one.acceleration for one in motions],
            [one.leg_position - place for one in motions],
        )
    )
    share = slow / speed
    size = np.concatenate(
        [np.linspace(1.0, share, COMES, endpoint=False), np.linspace(share, 0.0, STAYS, endpoint=False)]
    )
    period = TRAVELS * span / (speed * COMES * 0.5)
    times = np.asarray(time + period * np.arange(1 - len(size), 1), dtype=np.float64)
    still, none = np.full(len(size), place), np.zeros(len(size))
    return [
        Motion(
            motion.record, motion.name, times, still, side * speed * size, side * rate * size,
            still, side * speed * size, none, period,
        )
        for side in (-1.0, 1.0)
    ]  # fmt: skip


def _sharp(model: Model) -> Model:
    """The model whose dry friction turns its sign at once: with a wide transition it would hold no load."""
    turning = [
        f"{term.label}.{TURNS}"
        for term in model.terms
        if TURNS in term.values and term.element.switches == ("v", "")
    ]
    return model.with_values({name: model.parameters[name].bounds[0] for name in turning})
