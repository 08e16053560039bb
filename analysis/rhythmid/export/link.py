"""The link that a joint moves, alone in a world with gravity along -z: mass, inertia and axis with the joint's inertia and weight.

A revolute link under a gravity torque G = m g l hangs below a horizontal axis. Only G and the inertia J about the axis are known;
the mass on its lever takes half of J, so m l^2 = J / 2, and the inertia about the centre of mass the other half.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from rhythmid.errors import InputError
from rhythmid.export.joint import Joint

STANDARD_GRAVITY = 9.81  # [m/s^2] if no joint determines the gravity; the default of MuJoCo
MASS_ON_AXIS = 1.0  # [kg] of a revolute link without weight: any mass on its axis is valid
PRISMATIC_INERTIA = 1.0  # [kg*m^2] of a link that does not turn: any value is valid
Vector = tuple[float, float, float]


@dataclass(frozen=True)
class Link:
    """Mass [kg], centre of mass [m] in the joint's frame, inertia [kg*m^2] about the centre of mass, unit vector of the axis."""

    mass: float
    centre: Vector
    inertia: float
    axis: Vector


def world_gravity(joints: Sequence[Joint]) -> float:
    """Gravity [m/s^2] that gives all joints their weight. Raises InputError if they need different ones."""
    asked = {abs(joint.gravity) for joint in joints if joint.gravity}
    asked |= {STANDARD_GRAVITY for joint in joints if joint.weight_moment}
    if len(asked) > 1:
        raise InputError(
            f"the joints ask for different gravities ({', '.join(f'{one:g}' for one in sorted(asked))} m/s^2); export them one by one"
        )
    return asked.pop() if asked else STANDARD_GRAVITY


def link_of(joint: Joint) -> Link:
    """The link that gives the joint its inertia and its weight."""
    if not joint.rotational:
        vertical = (0.0, 0.0, math.copysign(1.0, joint.gravity))
        return Link(
            joint.inertia, (0.0, 0.0, 0.0), PRISMATIC_INERTIA, vertical if joint.gravity else (1.0, 0.0, 0.0)
        )
    axis = (0.0, 1.0, 0.0)
    if not joint.weight_moment:
        return Link(MASS_ON_AXIS, (0.0, 0.0, 0.0), joint.inertia, axis)
    lever = 0.5 * joint.inertia * STANDARD_GRAVITY / joint.weight_moment
    mass = 0.5 * joint.inertia / lever**2
    centre = (
        lever * math.sin(joint.hanging_position),
        0.0,
        -lever * math.cos(joint.hanging_position),
    )
    return Link(mass, centre, 0.5 * joint.inertia, axis)
