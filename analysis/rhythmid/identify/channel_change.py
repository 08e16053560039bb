"""Wrong declarations of a record's channels: the likely ones, the corrected record, and advice in words."""

import math
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from rhythmid.model import Model
from rhythmid.record.record import Channel, Record
from rhythmid.report.quantity import number

Role = Literal["output", "input", "forcing", "exchange"]
NAMED = 0.15  # relative distance of an estimated gain from a unit's factor within which the unit is named
DEGREE = math.pi / 180.0
THOUSAND = (1e-3, 1e3)
MOTIONS = ("reference", "base_displacement")  # kinds of input that have the unit of the position
# name of the unit in which a quantity seems to be recorded, by the factor that converts it
UNITS = {
    "rad": {DEGREE: "degrees", 1e-3: "milliradians", 1.0 / DEGREE: "radians that were taken for degrees"},
    "m": {1e-3: "millimetres", 1e3: "kilometres"},
    "N": {1e-3: "millinewtons", 1e3: "kilonewtons"},
    "N*m": {1e-3: "millinewton metres", 1e3: "kilonewton metres"},
}


@dataclass(frozen=True)
class Change:
    """A correction of a record's channels: one channel times `factor`, or input and output exchanged."""

    role: Role
    factor: float = 1.0

    def applied(self, record: Record) -> Record | None:
        """The corrected record; None where the record has no such channel."""
        if self.role == "exchange":
            if record.input is None or record.input_kind != "force" or np.ptp(record.input.value) == 0.0:
                return None  # a constant signal is no motion
            return replace(record, output=record.input, input=record.output)
        channel: Channel | None = getattr(record, self.role)
        if channel is None or np.ptp(channel.value) == 0.0:
            return None
        law = record.forcing_law
        if self.role == "forcing" and law is not None:
            law = replace(law, amplitude=self.factor * law.amplitude)
        changed = replace(channel, value=self.factor * channel.value)
        return replace(record, forcing_law=law, **{self.role: changed})


def likely_changes(record: Record, model: Model) -> list[Change]:
    """Changes of unit or sign that the record's channels may need. Of two with the same effect, the likelier is first."""
    position = model.units.position
    degrees = (DEGREE, 1.0 / DEGREE) if position == "rad" else ()
    found = [Change("output", factor) for factor in (*degrees, *THOUSAND)]
    motion = record.input_kind in MOTIONS
    found += [Change("input", factor) for factor in (-1.0, *(degrees if motion else ()), *THOUSAND)]
    found += [Change("output", -1.0)]
    found += [Change("forcing", factor) for factor in (-1.0, *THOUSAND)]
    return [*found, Change("exchange")]


def instruction(change: Change) -> str:
    if change.role == "exchange":
        return "exchange 'input:' and 'output:' in signals.yaml"
    factor = next((f for f in (DEGREE, 1.0 / DEGREE) if abs(change.factor / f - 1.0) < 1e-9), None)
    told = f"{float(f'{change.factor:.3g}'):g}" if factor is None else f"{factor:.6g}"
    return f"give it scale: {told} under '{change.role}:' in signals.yaml"


def guess(change: Change, record: Record, model: Model) -> str:
    """What the channel seems to contain, in words."""
    if change.role == "exchange":
        return "input and output seem to be exchanged"
    if change.factor == -1.0:
        return f"the {change.role} seems to have its sign turned round"
    motion = change.role == "output" or (change.role == "input" and record.input_kind in MOTIONS)
    wanted = model.units.position if motion else model.units.force
    known = [
        name for factor, name in UNITS.get(wanted, {}).items() if abs(change.factor / factor - 1.0) < NAMED
    ]
    if known:
        return f"the {change.role} looks like {known[0]}, where {wanted} is declared"
    size = abs(change.factor)
    said = f"the {change.role} seems to be in units about {number(max(size, 1.0 / size), 2)} times too {'small' if size < 1.0 else 'large'}"
    if change.factor < 0.0:
        said += " with its sign turned round"
    if change.role == "input" and wanted in ("N", "N*m"):
        said += f", such as a motor's current in A where {wanted} is declared"
    return said
