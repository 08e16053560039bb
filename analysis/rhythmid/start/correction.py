"""Corrections of a recorded channel that the balance of forces shows: its sign, its unit, or its zero. `init` writes
them, with a CHECK comment, so that the values that it writes are those of the signals that it writes."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from rhythmid.record.record import Record
from rhythmid.start.role_choice import Choice
from rhythmid.start.roles import Roles

# least ratio of a driving signal's mean to its range, and of the same ratio to that of the motion, for a zero that is
# elsewhere: a machine that is held against a load of five times the range of its drive is rare, and asked for
FAR = 5.0
CERTAIN = 0.99  # share of the samples that makes up the range: single ones may be disturbed
DIGITS = 0.02  # share of the range to which an offset is rounded
OF_LOAD = ("N", "N*m")  # units of efforts in which a constant may as well be a weight


@dataclass(frozen=True)
class Correction:
    """A channel's value is `scale` times that as recorded, plus `offset`; `why` as a CHECK comment. `offsets` are those of single
    records, by name, in place of `offset`."""

    role: str
    why: str
    scale: float = 1.0
    offset: float = 0.0
    offsets: Mapping[str, float] = field(default_factory=dict)

    def of(self, choice: Choice) -> Choice:
        """The choice for the role with the correction added to its own."""
        offset = self.scale * choice.offset + self.offset
        own = {name: self.scale * one + self.offset for name, one in choice.offsets.items()}
        own |= {name: offset + one for name, one in self.offsets.items()}
        return replace(
            choice,
            scale=self.scale * choice.scale,
            offset=offset,
            offsets=own,
            doubts=(*choice.doubts, self.why),
        )


def corrected(roles: Roles, corrections: Sequence[Correction]) -> Roles:
    """The roles with corrected channels."""
    choices = dict(roles.choices)
    for one in corrections:
        choices[one.role] = one.of(choices[one.role])
    return replace(roles, choices=choices)


def offset_of(records: Sequence[Record], driver: str, unit: str, kind: str) -> Correction | None:
    """The zero of a driving signal that lies far outside its range while the motion is centred elsewhere; None where it
    does not, or where it may be the weight that an effort carries. `kind` is that of the restoring force."""
    if kind == "free" or (kind == "constant" and unit in OF_LOAD):
        return None
    given = [one.effort if driver == "effort" else one.input for one in records]
    drive = np.concatenate([one.value for one in given if one is not None])
    motion = np.concatenate([one.output.value for one in records])
    (level, span), (place, travel) = _range(drive), _range(motion)
    if span == 0.0 or abs(level) < FAR * span or abs(level) * travel < FAR * span * abs(place):
        return None
    step = 10.0 ** math.floor(math.log10(DIGITS * span))
    offset = -round(level / step) * step
    why = (
        f"it stays within {span:.2g} {unit} about {-offset:.6g} {unit}, as the motion does not, so that its zero seems to be there: offset: "
        f"{offset:.6g} is written; where the machine is held by so much, delete it"
    )
    return Correction(driver, why, offset=offset)


def _range(value: np.ndarray) -> tuple[float, float]:
    """Mean and range of nearly all values (n,)."""
    low, high = np.quantile(value, [0.5 * (1.0 - CERTAIN), 0.5 * (1.0 + CERTAIN)])
    return float(value.mean()), float(high - low)
