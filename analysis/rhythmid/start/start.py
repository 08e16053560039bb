"""Drafts the two files that describe recordings without metadata: signals.yaml and a nominal model.yaml."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from rhythmid.elements.catalogue import Catalogue, load_catalogue
from rhythmid.errors import InputError
from rhythmid.model import Model
from rhythmid.record.angle_wrap import wraps_of
from rhythmid.record.braking import WHY as TAKES_ENERGY
from rhythmid.record.braking import braking_roles
from rhythmid.record.cleaning import cleaned
from rhythmid.record.inventory import Inventory, inventory
from rhythmid.record.read import LARGEST, load_records, read_record
from rhythmid.record.record import Record
from rhythmid.record.rest_at_ends import rests_of, use_line
from rhythmid.record.signals import Clock, Signals
from rhythmid.record.standstill import standstill
from rhythmid.record.unsigned import WHY as WITHOUT_SIGN
from rhythmid.record.unsigned import unsigned_roles
from rhythmid.start.correction import corrected
from rhythmid.start.force_unit import MODELLED
from rhythmid.start.free_parts import free_parts
from rhythmid.start.levels import stepped
from rhythmid.start.listed_joints import with_listed_joints
from rhythmid.start.meaning import driving_unit_of, meaning_of
from rhythmid.start.named_joints import with_joints
from rhythmid.start.no_motion import NoMotionError
from rhythmid.start.nominal import Nominal, nominal_of, per_inertia, units_of
from rhythmid.start.one_force_unit import by_command_alone
from rhythmid.start.other_effort import by_other_effort
from rhythmid.start.poses import with_numbers_as_joints, without_quaternions
from rhythmid.start.role_choice import Ask, Choice
from rhythmid.start.roles import Roles, first_answer, guess_roles
from rhythmid.start.sides import with_sides
from rhythmid.start.stated import DRIVES, NOTHING, Stated
from rhythmid.start.untold_motion import by_simpler_motion
from rhythmid.start.yaml_text import GUESSED, as_guessed, clock_of, doubt_of_sign, model_yaml, signals_yaml
from rhythmid.units import ROTATIONAL, TRANSLATIONAL, Units

MOST_CORRECTIONS = 3  # sign, unit and zero of the channels, one after the other


@dataclass(frozen=True, eq=False)
class Guess:
    """Content of a source, the guessed roles, the text of signals.yaml, its clock with the reason, and whether the machine
    moves in the source."""

    inventory: Inventory
    roles: Roles
    signals: str
    clock: Clock
    clock_reason: str
    moves: bool = True

    def changed(self, roles: Roles, use: str) -> "Guess":
        """The guess with other roles, and the line `use` of signals.yaml, empty where there is none."""
        clock, reason = self.clock, self.clock_reason
        if self.inventory.is_bag and {*map(_channel, roles.choices.values())} != {
            *map(_channel, self.roles.choices.values())
        }:
            clock, reason = clock_of(self.inventory, roles)
        text = signals_yaml(self.inventory, roles, _units(roles), clock, reason, use)
        return replace(self, roles=roles, signals=text, clock=clock, clock_reason=reason)

    def to_dict(self) -> dict[str, Any]:
        """The guesses as plain values for JSON."""
        joint = self.roles.joint
        return {
            "roles": {role: choice.to_dict() for role, choice in self.roles.choices.items()},
            "input_kind": self.roles.input_kind,
            "output_kind": self.roles.output_kind,
            "joint": joint.name or None,
            "other_joints": joint.others,
            "moves": self.moves,
            "notes": [*self.inventory.notes, *self.roles.notes],
        }

    def lines(self) -> list[str]:
        """The guesses in plain text, one line each."""
        choices = self.roles.choices.items()
        found = [f"{role}: {choice.recorded}: {choice.reason}" for role, choice in choices]
        found += [f"CHECK {role}: {doubt}" for role, choice in choices for doubt in choice.doubts]
        found += [
            f"CHECK {role}: {doubt_of_sign(choice.recorded.sign_bit)}"
            for role, choice in choices
            if choice.recorded.sign_bit is not None
        ]
        found += [f"CHECK {note}" for note in (*self.inventory.notes, *self.roles.notes)]
        if self.roles.joint.others:
            found.append(f"joint: {self.roles.joint.name} (others: {', '.join(self.roles.joint.others)})")
        return found


@dataclass(frozen=True, eq=False)
class Start:
    """The guess, the nominal model, the text of model.yaml, and a line on each unused recording."""

    guess: Guess
    nominal: Nominal
    model: str
    remarks: tuple[str, ...] = ()

    @property
    def signals(self) -> str:
        """The text of signals.yaml."""
        return self.guess.signals

    def to_dict(self) -> dict[str, Any]:
        """The guesses as plain values for JSON."""
        values = self.nominal.model.parameters
        return {
            **self.guess.to_dict(),
            "remarks": [*self.remarks, *self.nominal.remarks],
            "nominal": {name: {"value": one.value, "unit": one.unit} for name, one in values.items()},
            "reasons": self.nominal.reasons,
            "doubts": self.nominal.doubts,
        }

    def lines(self) -> list[str]:
        """The guesses in plain text, one line each."""
        elements = ", ".join(term.label for term in self.nominal.model.terms)
        doubts = [f"CHECK {label}: {doubt}" for label, doubt in self.nominal.doubts.items()]
        return [*self.remarks, *self.guess.lines(), f"nominal model: inertia, {elements}", *doubts]


@threadpool_limits.wrap(limits=1)  # many small matrices: threads would wait for each other
@as_guessed()
def guess(
    source: str | Path,
    joint: str | None = None,
    rate: float | None = None,
    ask: Ask = first_answer,
    beside: Sequence[str | Path] = (),
    stated: Stated = NOTHING,
) -> Guess:
    """Inspect one recording and guess the roles of its channels; parameters and errors as for `start`. What is constant in
    it may change from one to the next of the recordings `beside` it."""
    found = with_joints(
        with_sides(with_listed_joints(with_numbers_as_joints(without_quaternions(_inventory(source, rate)))))
    )
    found = stated.told(found)
    roles = guess_roles(found, joint, ask)
    if (
        beside
        and not any(role in roles.choices for role in MODELLED)
        and (steps := stepped(found, beside, rate))
    ):
        roles = guess_roles(found, joint, ask, steps)
    tried = _tried(source, found, roles)
    others = tried.roles.joint.others if joint is None and "output" not in stated.roles else []
    first = tried.refused
    while (
        first and tried.refused and others
    ):  # a guess that cannot be used gives way to the joint that moves next
        tried = _tried(source, found, guess_roles(found, others.pop(0), ask))
    if first and tried.refused:
        raise InputError(f"{first}; {_other_choice(found, joint)}")
    roles, text, record, clock, reason = tried.roles, tried.text, tried.record, tried.clock, tried.reason
    assert record is not None
    if first:
        note = f"joint {roles.joint.name} is taken, because that which moves most cannot be used: {first}"
        roles = replace(roles, notes=(*roles.notes, note))
        text = signals_yaml(found, roles, _units(roles), clock, reason)
    clean = cleaned(record).record
    still = standstill(clean)
    doubts = [one for one in (still, wraps_of(record), *rests_of(clean)) if one is not None]
    if doubts:
        output = roles.choices["output"]
        output = replace(output, doubts=(*output.doubts, *doubts))
        roles = replace(roles, choices={**roles.choices, "output": output})
    if unsigned := unsigned_roles(clean):
        roles = _doubted_of(roles, unsigned, WITHOUT_SIGN)
    if doubts or unsigned:
        text = signals_yaml(found, roles, _units(roles), clock, reason, maybe=use_line(clean))
    return Guess(found, roles, text, clock, reason, still is None)


@dataclass(frozen=True, eq=False)
class _Tried:
    """Roles with the text of their signals.yaml, the record and its clock; or why the output is `refused`."""

    roles: Roles
    text: str
    clock: Clock
    reason: str
    record: Record | None
    refused: str = ""


def _tried(source: str | Path, found: Inventory, roles: Roles) -> _Tried:
    """The record with these roles. Raises InputError where it cannot be read for a reason other than its output."""
    units = _units(roles)
    clock, reason = clock_of(found, roles)
    text = signals_yaml(found, roles, units, clock, reason)
    try:
        record = read_record(source, Signals.from_text(text, GUESSED))
    except InputError as error:
        if clock.kind != "header":
            raise
        clock, reason = Clock("receive"), f"the stamps do not serve: {error}"
        text = signals_yaml(found, roles, units, clock, reason)
        record = read_record(source, Signals.from_text(text, GUESSED))
    try:
        cleaned(record)
    except InputError as error:
        return _Tried(roles, text, clock, reason, None, str(error))
    return _Tried(roles, text, clock, reason, record)


def _other_choice(found: Inventory, joint: str | None) -> str:
    """How to choose another output than the guessed one."""
    told = [one for one in (meaning_of(each).joint for each in found.recorded) if one]
    names = ", ".join(dict.fromkeys(one for one in told if one != joint))
    return (
        f"another joint is chosen with --joint NAME ({names})"
        if names
        else "another output is chosen with --role output=CHANNEL"
    )


def _guess_of_moving(
    sources: Sequence[str | Path], joint: str | None, rate: float | None, ask: Ask, stated: Stated
) -> tuple[Guess, Sequence[str | Path]]:
    """The guess for the first recording in which the machine moves, and the recordings before it; for the first
    one, and none, where it moves in none. Raises NoMotionError where no recording has a motion."""
    first, none = None, None
    for number, source in enumerate(sources):
        try:
            found = guess(source, joint, rate, ask, [one for one in sources if one != source], stated)
        except NoMotionError as error:  # what does not move in one recording may move in another
            none = none or error
            continue
        if found.moves:
            return found, sources[:number]
        first = first or found
    if first is None:
        raise none or InputError("no recording is given")
    return first, ()


def _inventory(source: str | Path, rate: float | None) -> Inventory:
    """Inventory of a source; for a bag without measurements including the vehicle's pose."""
    found = _bounded(inventory(source, rate))
    may_be_motion = (meaning for meaning in map(meaning_of, found.recorded) if meaning.quantity != "effort")
    if not found.is_bag or any(meaning.commanded is not True for meaning in may_be_motion):
        return found
    return _bounded(inventory(source, rate, vehicle=True))


def _bounded(found: Inventory) -> Inventory:
    """The inventory without numbers beyond all bounds, which tell nothing of a channel; a record that holds them is refused later."""
    held = (
        replace(one, value=np.where(np.abs(one.value) <= LARGEST, one.value, np.nan))
        for one in found.recorded
    )
    return replace(found, recorded=type(found.recorded)(held))


@threadpool_limits.wrap(limits=1)
@as_guessed()
def start(
    sources: Sequence[str | Path],
    joint: str | None = None,
    rate: float | None = None,
    ask: Ask = first_answer,
    catalogue: Catalogue | None = None,
    stated: Stated = NOTHING,
) -> Start:
    """Inspect recordings of one layout and guess the roles of their channels and a nominal model.

    Parameters
    ----------
    sources : bags or tables; roles are guessed from the first in which the machine moves, the nominal model from
        all in which it does.
    joint : the joint to identify; by default the one that moves most.
    rate : of a table without a time [Hz].
    ask : called where several candidates are close; by default the best is taken.
    stated : roles and units of channels that need no guess.

    Raises InputError, one line, where a source cannot be read, or contains no possible motion.
    """
    guessed, resting = _guess_of_moving(sources, joint, rate, ask, stated)
    remarks = tuple(f"{one}: the machine stands still, so that it is not used here" for one in resting)
    moving = [one for one in sources if one not in resting]
    known = load_catalogue() if catalogue is None else catalogue

    use, told = free_parts(sources, Signals.from_text(guessed.signals, GUESSED))
    if use:
        guessed = guessed.changed(_doubted(guessed.roles, told), use)

    def tried(roles: Roles) -> Nominal:
        changed = guessed if roles is guessed.roles else guessed.changed(roles, use)
        return _nominal(moving, changed.signals, roles, known)

    roles, nominal = guessed.roles, tried(guessed.roles)
    if not DRIVES & set(stated.roles):
        roles, nominal = by_other_effort(guessed.inventory, roles, nominal, tried)
        roles, nominal = by_command_alone(roles, nominal, tried)
    roles, nominal = by_simpler_motion(roles, nominal, tried)
    for _ in range(MOST_CORRECTIONS):
        if nominal.corrections:
            roles = corrected(roles, nominal.corrections)
            nominal = tried(roles)
    if roles is not guessed.roles:
        guessed = guessed.changed(roles, use)
    if braking := braking_roles(read_record(moving[0], Signals.from_text(guessed.signals, GUESSED))):
        guessed = guessed.changed(_doubted_of(guessed.roles, braking, TAKES_ENERGY), use)
    units = _units(roles)
    text = model_yaml(nominal, guessed.roles, units, units not in (TRANSLATIONAL, ROTATIONAL))
    Model.from_text(text, "model.yaml", known)
    return Start(guessed, nominal, text, remarks)


def _channel(choice: Choice) -> str:
    return str(choice.recorded)


def _doubted(roles: Roles, doubts: Sequence[str]) -> Roles:
    """The roles with further doubts about the output."""
    output = roles.choices["output"]
    return replace(
        roles, choices={**roles.choices, "output": replace(output, doubts=(*output.doubts, *doubts))}
    )


def _doubted_of(roles: Roles, told: Sequence[str], doubt: str) -> Roles:
    """The roles with a doubt about what drives the machine in those that are `told`."""
    known = {role: roles.choices[role] for role in told if role in roles.choices}
    return replace(
        roles,
        choices={
            **roles.choices,
            **{role: replace(one, doubts=(*one.doubts, doubt)) for role, one in known.items()},
        },
    )


def _nominal(sources: Sequence[str | Path], signals: str, roles: Roles, catalogue: Catalogue) -> Nominal:
    """The nominal model of recordings with these roles, of those in which the machine moves."""
    records = [cleaned(one).record for one in load_records(sources, Signals.from_text(signals, GUESSED))]
    records = [one for one in records if standstill(one) is None] or records
    return nominal_of(records, roles, _units(roles), catalogue)


def _units(roles: Roles) -> Units:
    """Units of the machine's force, position and inertia."""
    forces = [roles.choices[role] for role in MODELLED if role in roles.choices]
    if roles.input_kind != "force" or not forces:
        return per_inertia(units_of(roles, ""))
    return units_of(roles, driving_unit_of(forces[0].recorded))
