"""The effort balance: the effort that the motor must have given along the measured motion, if the model were correct.

u = m a − ΣF, with every element's force F and its states computed along the measured motion. The recorded effort is only the quantity
to predict; it is never a regressor. Forces under load and the actuator use the effort that the model itself requires. One zero-phase
filter acts on the recorded effort and on everything that is compared with it.
"""

import math
from collections.abc import Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rhythmid.errors import InputError
from rhythmid.identify.drive import controlled
from rhythmid.identify.inverse_dynamics.balance_rows import sampled, stuck
from rhythmid.identify.inverse_dynamics.bandwidth import QUARTER, Bandwidth, bridged
from rhythmid.identify.inverse_dynamics.inversion import Inversions
from rhythmid.identify.inverse_dynamics.motion import Motion, high_pass, low_pass, motion_of, stretches
from rhythmid.identify.inverse_dynamics.reference_path import changed_by
from rhythmid.identify.inverse_dynamics.rest_force import Rests
from rhythmid.model import INERTIA, Model, Term
from rhythmid.record.record import Record
from rhythmid.simulation.effect import MAX_STEP, Path, effect_along, load_along
from rhythmid.simulation.transport import MEASUREMENT, delays

Array = NDArray[np.float64]
STICK = 0.03  # share of FAST speed with set-valued dry friction (measured: six arm joints, an axis, a frame)
FAST = 0.95  # quantile of the speed that counts as fast
# rows per cut-off period: Nyquist rate plus a quarter for the filter's slope (Gautier et al.)
DECIMATED = 2.5
MEMORY = 2e8  # bytes of cached forces: a refit computes only what changed
MANY_ROWS = 200  # least rows kept of a short record; their correlation is taken into account
LEAST_ROWS = 40  # least number of rows for an estimate
# integration steps of an element's states per sample of the motion (10 samples per cut-off period)
SUBSTEPS = 4
INVISIBLE = 1e-4  # share of a signal that remains after a filter whose pass band does not contain it
TESTED = 64  # samples used to test whether an element's force depends on the effort


@dataclass(frozen=True, eq=False)
class Balance:
    """Efforts on rows that are the same for all models.

    Attributes
    ----------
    motions : the stretches without gaps.
    bandwidth : the cut-off frequencies [Hz].
    places : for each motion, the indices of the samples that are its rows.
    record : (n,) number of each row's record, in order.
    measured : (n,) the recorded effort at the rows, filtered.
    stick_speed : speed below which samples are left out.
    stuck : share of the rows that were left out for this reason.
    period : sample period [s] of motion or recorded effort, whichever is longer: the unit of the alignment.
    aligned : standard deviation [s] of the alignment where more is known of it than that stamps are rounded to a sample.
    fits : the latest fits to these rows, by all that they depend on.
    """

    motions: tuple[Motion, ...]
    bandwidth: Bandwidth
    places: tuple[NDArray[np.int64], ...]
    record: NDArray[np.int64]
    measured: Array
    stick_speed: float
    stuck: float
    period: float
    aligned: float | None = None
    _forces: dict[Hashable, Array] = field(default_factory=dict, repr=False)
    _sensitive: dict[str, bool] = field(default_factory=dict, repr=False)
    fits: dict[Hashable, Any] = field(init=False, default_factory=dict, repr=False)  # a copy has none

    @classmethod
    def of(cls, records: Sequence[Record], model: Model, bandwidth: Bandwidth | None = None) -> "Balance":
        """The balance of these records. Raises InputError where no effort was recorded, or too little of motion."""
        if bandwidth is None:
            raw, chosen = bridged(records, model)
        else:
            raw, chosen = stretches(records, model, QUARTER / bandwidth.effort), bandwidth
        motions = [motion_of(one, model, chosen.motion, chosen.low) for one in raw]
        efforts = [one.effort.period for one in records if one.effort is not None]
        return cls.of_motions(motions, chosen, max([*efforts, *(one.period for one in raw)]))

    @classmethod
    def of_motions(
        cls, motions: Sequence[Motion], chosen: Bandwidth, period: float, clear: float | None = None
    ) -> "Balance":
        """The balance of these motions of records with sample period `period` [s]. `clear` is the number of cut-off
        periods to leave out at both ends of each motion, however little remains. Raises InputError where too few
        rows are left."""
        speed = float(np.quantile(np.abs(np.concatenate([one.leg_velocity for one in motions])), FAST))
        length = sum(len(one.time) * one.period for one in motions)
        often = max(DECIMATED * chosen.effort, MANY_ROWS / length)
        places, all_rows = [], 0
        for motion in motions:
            step = max(1, int(1.0 / (often * motion.period)))
            margin = min(math.ceil(1.0 / (chosen.effort * motion.period)), len(motion.time) // 4)
            if clear is not None:
                margin = math.ceil(clear / (chosen.effort * motion.period))
            rows = motion.recorded(np.arange(margin, len(motion.time) - margin, step))
            all_rows += len(rows)
            sticks = stuck(
                np.abs(motion.leg_velocity) <= STICK * speed, 1.0 / (chosen.effort * motion.period)
            )
            places.append(rows[~sticks[rows]])
        count = sum(map(len, places))
        if count < LEAST_ROWS:
            raise InputError(
                f"only {count} rows of effort are left outside stick phases; at least {LEAST_ROWS} are needed"
            )
        numbers = np.concatenate([np.full(len(p), m.record) for p, m in zip(places, motions, strict=True)])
        made = cls(
            tuple(motions), chosen, tuple(places), np.unique(numbers, return_inverse=True)[1].astype(np.int64),
            np.zeros(count), STICK * speed, 1.0 - count / max(all_rows, 1), period,
        )  # fmt: skip
        made.measured[:] = made.rows([one.effort for one in motions])
        return made

    def rows(self, signals: Iterable[Array], shift: float = 0.0) -> Array:
        """Filtered signals at the rows, `shift` [s] later. One (n,) or (n, p) per motion gives (rows,) or (rows, p)."""
        return self.at_rows(self.all_filtered(signals), shift)

    def all_filtered(self, signals: Iterable[Array]) -> list[Array]:
        """One signal (n,) or (n, p) per motion, filtered."""
        return [self.filtered(one, motion.period) for one, motion in zip(signals, self.motions, strict=True)]

    def at_rows(self, signals: Sequence[Array], shift: float = 0.0) -> Array:
        """Signals that are filtered already, at the rows, `shift` [s] later."""
        return np.concatenate(
            [
                sampled(one, places, shift / motion.period)
                for one, motion, places in zip(signals, self.motions, self.places, strict=True)
            ]
        )

    def filtered(self, signal: Array, period: float) -> Array:
        """A signal (n,) or (n, p) after the filter that the recorded effort also passes."""
        return high_pass(low_pass(signal, period, self.bandwidth.effort), period, self.bandwidth.low)

    @property
    def notes(self) -> list[str]:
        """Notes on what was interpolated in each record."""
        found: dict[str, list[float]] = {}
        for motion in self.motions:
            if motion.bridged:
                found.setdefault(motion.name, []).extend(end - begin for begin, end in motion.bridged)
        counted = {
            name: f"a gap of {gaps[0]:.2g} s is"
            if len(gaps) == 1
            else f"{len(gaps)} gaps of at most {max(gaps):.2g} s ({sum(gaps):.3g} s in all) are"
            for name, gaps in found.items()
        }
        short = "short beside the effort's shortest period"
        why = {
            name: short
            if max(gaps) <= QUARTER / self.bandwidth.effort
            else f"{short} or told by the samples beside them"
            for name, gaps in found.items()
        }
        return [
            f"{name}: {said} bridged, {why[name]}; what lies within counts neither in fits nor in scores"
            for name, said in counted.items()
        ]

    @property
    def mechanical(self) -> Array:
        """Measured position, velocity and acceleration of the leg at each row, (n, 3)."""
        return np.concatenate(
            [
                np.column_stack([m.leg_position[p], m.leg_velocity[p], m.acceleration[p]])
                for m, p in zip(self.motions, self.places, strict=True)
            ]
        )

    @property
    def by_reference(self) -> bool:
        """Whether the effort was not recorded but follows from a controller and its reference."""
        return self.motions[0].reference is not None

    @cached_property
    def undriven(self) -> bool:
        """Whether no motor acts: the recorded effort is zero. An actuator makes nothing of it, so that no law of one is in the balance."""
        return not self.by_reference and not any(motion.effort.any() for motion in self.motions)

    @cached_property
    def rests(self) -> Rests:
        """The rests that count as evidence; their samples are not among the rows."""
        return Rests.of(self)

    def later(self, model: Model, alignment: float = 0.0) -> float:
        """Time [s] by which the motion lags the effort, `alignment` [s] beyond the model's delays. It is 0 for an
        effort computed from motion and reference: there only the reference is delayed, see `moved`."""
        return 0.0 if self.by_reference else self.shift(model) + alignment

    def moved(self, model: Model, alignment: float) -> list[Array]:
        """Change (n,) of each motion's effort if its reference acts `alignment` [s] later; empty for a recorded
        effort."""
        if not self.by_reference or alignment == 0.0:
            return []
        late = self.shift(model)
        return [
            self._asked(index, model, late) - one.reference.force(model, one, late + alignment)
            for index, one in enumerate(self.motions)
            if one.reference is not None
        ]

    def with_moved(self, rows: Array, model: Model, alignment: float) -> Array:
        """Rows (n,) of a required effort with the reference acting `alignment` [s] later."""
        changes = self.moved(model, alignment)
        return rows + self.rows(changes) if changes else rows

    def _asked(self, index: int, model: Model, late: float) -> Array:
        """Force (n,) commanded by the controller due to its reference. Cached: most refits keep the command path."""
        key = (index, "asked", changed_by(model), late)
        found = self._forces.get(key)
        if found is None:
            motion = self.motions[index]
            assert motion.reference is not None
            self._forces[key] = found = motion.reference.force(model, motion, late)
        return found

    def shift(self, model: Model) -> float:
        """Time [s] by which the motion lags the effort's timestamps, according to the model's delays."""
        slots = MEASUREMENT if controlled(model) else ("command", *MEASUREMENT)
        return sum((float(np.mean(late)) for _, late in delays(model, self.motions[0].time, *slots)), 0.0)

    def required(self, model: Model) -> list[Array]:
        """Effort (n,) that the model requires along each motion, unfiltered."""
        return [self._required(index, model, Inversions()) for index in range(len(self.motions))]

    def sensitive(self, model: Model, steps: Mapping[str, float]) -> tuple[list[Array], list[list[Array]]]:
        """The effort (n,) that the model requires along each motion, and its derivative (n,) with respect to each
        named parameter, by a difference over a step."""
        chains = [Inversions(with_slopes=True) for _ in self.motions]
        required = [self._required(index, model, chain) for index, chain in enumerate(chains)]
        known = [replace(chain, known=chain.made) for chain in chains]
        changes = []
        for name, step in steps.items():
            moved = model.with_values({name: model.value(name) + step})
            found = [self._required(index, moved, replace(one, made={})) for index, one in enumerate(known)]
            changes.append([(new - old) / step for new, old in zip(found, required, strict=True)])
        return required, changes

    def predicted(self, model: Model, alignment: float = 0.0) -> Array:
        """The predicted effort (rows,), `alignment` [s] beyond the model's own delays."""
        rows = self.rows(self.required(model), self.later(model, alignment))
        return self.with_moved(rows, model, alignment)

    def estimated(self, model: Model) -> list[str]:
        """The free parameters on which the effort depends: inertia, forces and actuator."""
        found = []
        for name in model.free:
            if name in self.motions[0].links:
                found.append(name)
                continue
            if name == INERTIA:
                if not self.motions[0].driven_by_base:
                    found.append(name)
                continue
            term = model.term(name.split(".")[0])
            if term is None or term.element.kernel is None or not self._counts(term, model):
                continue
            if self.bandwidth.low == 0.0 or self._passes(name, model):
                found.append(name)
        return found

    def _passes(self, name: str, model: Model) -> bool:
        """Whether the high-pass filter leaves any effect of a parameter."""
        value = model.value(name)
        moved = self.required(model.with_values({name: value + 1e-3 * (abs(value) or 1.0)}))
        change = [new - old for new, old in zip(moved, self.required(model), strict=True)]
        whole = np.concatenate([one[p] for one, p in zip(change, self.places, strict=True)])
        return bool(np.linalg.norm(self.rows(change)) > INVISIBLE * np.linalg.norm(whole))

    def _counts(self, term: Term, model: Model) -> bool:
        """Whether an element is part of the balance; a body's parameters enter by the motions' coupling instead."""
        slot = term.element.slot
        if any(f"{term.label}.{name}" in self.motions[0].links for name in term.values):
            return False
        if slot == "force":
            return term.element.acts != "drive" or not self.motions[0].driven_by_base
        if self.motions[0].driven_by_base or self.undriven or term.element.kernel is None:
            return False
        return slot == "actuator" or (
            slot == "command"
            and term.element.acts != "feedback"
            and (self.by_reference or not controlled(model))
        )

    def _required(self, index: int, model: Model, by: Inversions) -> Array:
        motion = self.motions[index]
        zero = np.zeros(len(motion.time))
        forces = [t for t in model.terms if t.element.slot == "force" and self._counts(t, model)]
        late = [t for t in forces if t.element.acts != "modifier" and self._sees_effort(t, model)]
        leg, others = zero.copy(), zero.copy()
        for term in forces:
            if term.element.acts == "modifier" or term in late:
                continue
            force = self._force(index, term, model)
            (leg if term.element.acts == "leg" else others)[:] += force
        for term in forces:
            if term.element.acts == "modifier":
                leg += self._along(motion, term, model, zero, leg, zero)
        inertial = zero if motion.driven_by_base else model.mass.value * motion.acceleration
        if motion.coupling is not None:
            inertial = inertial + motion.coupling
            known = model.parameters
            for name, (taken_at, column) in motion.links.items():
                if (change := known[name].value - taken_at) != 0.0:
                    inertial = inertial + change * column
        required = inertial - leg - others
        if late and motion.driven_by_base:
            required = required - sum(self._along(motion, t, model, zero, leg, zero) for t in late)
        elif late:
            required = self._with_load(motion, late, model, required, leg, by)
        for slot in ("actuator",) if self.by_reference else ("actuator", "command"):
            for term in reversed([t for t in model.terms if t.element.slot == slot]):
                if self._counts(term, model):
                    required = self._before(motion, term, model, required, leg, by)
        # the command path's effect is on this side, so that the rows stay the same for all models
        if self.by_reference:
            required = required + motion.effort - self._asked(index, model, self.shift(model))
        return required

    def _with_load(
        self, motion: Motion, terms: Sequence[Term], model: Model, without: Array, leg: Array, by: Inversions
    ) -> Array:
        """The effort (n,) with the forces that depend on it as load; `without` (n,) is the effort without them."""
        zero = np.zeros(len(motion.time))
        load = load_along(model, motion.path(zero, leg, zero, True))

        def left_over(effort: Array) -> Array:
            forces = [self._along(motion, t, model, effort, leg, zero, load) for t in terms]
            return effort + np.sum(forces, axis=0)

        return by.inverted("", left_over, without, any(term.element.own for term in terms))

    def _before(
        self, motion: Motion, term: Term, model: Model, after: Array, leg: Array, by: Inversions
    ) -> Array:
        """The input (n,) of an actuator or command element whose output is `after` (n,)."""

        def comes_out(into: Array) -> Array:
            return into + self._along(motion, term, model, after, leg, into)

        return by.inverted(term.label, comes_out, after, bool(term.element.own))

    def _along(
        self, motion: Motion, term: Term, model: Model, effort: Array, leg: Array, signal: Array,
        load: Array | None = None,
    ) -> Array:  # fmt: skip
        values = term.numbers
        of_leg = term.element.acts not in ("body", "drive")
        # the filtered motion moves states smoothly. Elements without states are not integrated: what they widen for the step of
        # a simulation stays as declared. Widened, the transition of friction on a light mass would depend on that mass
        step = max(MAX_STEP, motion.period / SUBSTEPS) if term.element.states else 0.0
        path = motion.path(effort, leg, signal, of_leg)
        if load is not None:
            path = replace(path, load=load)
        return effect_along(term.element, values, model, path, step)

    def _force(self, index: int, term: Term, model: Model) -> Array:
        """Force (n,) of an element that depends only on the motion. Cached: most refits change one element."""
        borrowed = tuple(model.borrowed(source, default) for source, default in term.element.borrows.values())
        key = (index, term.element.name, tuple((name, v.value) for name, v in term.values.items()), borrowed)
        found = self._forces.get(key)
        if found is None:
            zero = np.zeros(len(self.motions[index].time))
            found = self._along(self.motions[index], term, model, zero, zero, zero)
            if len(self._forces) * found.nbytes > MEMORY:
                self._forces.clear()
            self._forces[key] = found
        return found

    def _sees_effort(self, term: Term, model: Model) -> bool:
        """Whether an element's force depends on the actuator's force."""
        name = term.element.name
        if name not in self._sensitive:
            wave = np.sin(np.linspace(0.0, 20.0, TESTED))
            values = term.numbers
            if term.element.size and math.isfinite(term.element.absent):
                values[term.element.size] = term.element.absent + 0.5  # an absent effect depends on nothing
            span = np.linspace(0.0, 1.0, TESTED)
            two = [
                effect_along(term.element, values, model, Path(span, wave, wave, load, 0.0 * wave, wave))
                for load in (0.0 * wave, 1.0 + wave)
            ]
            self._sensitive[name] = bool(np.any(two[0] != two[1]))
        return self._sensitive[name]
