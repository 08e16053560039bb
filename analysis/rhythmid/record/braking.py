"""Detects a driving force that takes energy out of a motion which goes on.

What drives a machine replaces the energy that friction takes. A recorded force whose power is negative nearly all the time
does the opposite: its sign is opposite to the motion's, as that of the force which a damper exerts on a load cell, or the machine is
driven by something that was not recorded, against which this force holds.
"""

import numpy as np
from numpy.typing import NDArray

from rhythmid.record.record import Record

Array = NDArray[np.float64]
# share of the power's size that its mean has to reach: three quarters of the power are then taken out
TAKEN = -0.5
# least share of the time in either direction: a machine that is slowed down once moves in one
EACH_WAY = 0.25
GOES_ON = 0.7  # ratio of the motion's size in the last third to that in the first, below which it dies away
LEAST_SAMPLES = 100  # of a record that is judged, as for efforts without a sign
WHY = (
    "it takes energy out of a motion that goes on: its sign is opposite to the motion's (scale: -1), as that of a force which the machine "
    "exerts, or what drives the machine was not recorded"
)


def braking_notes(record: Record) -> list[str]:
    """A line on each force of a record that takes energy out of its motion."""
    return [f"{role}: {WHY}" for role in braking_roles(record)]


def braking_roles(record: Record) -> list[str]:
    """The roles of the forces of a record that take energy out of its motion."""
    output = record.output
    if record.output_kind == "acceleration" or len(output.time) < LEAST_SAMPLES:
        return []
    speed = output.value if record.output_kind == "velocity" else np.gradient(output.value, output.time)
    given = (("input", record.input if record.input_kind == "force" else None), ("effort", record.effort))
    return [
        role
        for role, one in given
        if one is not None and takes_energy(speed, np.interp(output.time, one.time, one.value))
    ]


def takes_energy(speed: Array, force: Array) -> bool:
    """Whether a force (n,), without its mean, takes energy out of a motion with this speed (n,), which reverses and goes on."""
    if not (np.isfinite(speed).all() and np.isfinite(force).all()):
        return False
    moves = speed - speed.mean()
    if min(np.mean(speed > 0.0), np.mean(speed < 0.0)) < EACH_WAY:
        return False
    parts = np.array_split(moves, 3)
    power = (force - force.mean()) * moves
    size = float(np.abs(power).sum())
    return (
        float(np.std(parts[2])) >= GOES_ON * float(np.std(parts[0]))
        and size > 0.0
        and float(power.sum()) <= TAKEN * size
    )
