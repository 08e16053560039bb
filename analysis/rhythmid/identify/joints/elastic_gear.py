"""A gear that yields under the torque it transmits, between an encoder on the motor's side and the link.

The link is where the encoder is, less the torque of the gear times its compliance (M. W. Spong, J. Dyn. Sys. Meas. Control 109 (1987) 310). With
damping, the angle of the gear follows that with a lag of damping over stiffness.
The rotor and the losses of the joint's path are on the motor's side. The torque of the gear is the joint's effort less what these take. It
is measured, so that no resonance has to be integrated. The angle of the gear passes the filter of the motion and is differentiated like it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.signal import lfilter

from rhythmid.identify.inverse_dynamics.motion import low_pass
from rhythmid.identify.joints.body_motion import BodyMotion
from rhythmid.model import INERTIA, Model

if TYPE_CHECKING:
    from rhythmid.identify.joints.joint_motion import JointBalances

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class ElasticGear:
    """The `compliance` of a joint's gear [rad/(N m), or m/N], the `path` of the joint, with what its `rotor` differs from the body's
    [kg m^2, or kg], and the time [s] with which the gear follows its torque (`lag`)."""

    compliance: float
    path: Model
    rotor: float
    lag: float = 0.0

    def turned(self, torque: Array, period: float) -> Array:
        """Angle (n,) of the gear under a torque (n,)."""
        angle = self.compliance * torque
        if self.lag <= 0.0:
            return angle
        whole = 2.0 * self.lag + period  # the trapezoidal rule
        before, after = np.array([period, period]) / whole, np.array([1.0, (period - 2.0 * self.lag) / whole])
        return np.asarray(lfilter(before, after, angle, zi=(1.0 - before[:1]) * angle[0])[0])


def deflected(
    balances: "JointBalances", rigid: Sequence[BodyMotion], gears: Mapping[str, ElasticGear]
) -> list[BodyMotion]:
    """The motions of the links behind these gears, from those of the encoders."""
    torque = {joint: transmitted(balances, joint, gear) for joint, gear in gears.items()}
    bodies = []
    for place, one in enumerate(rigid):
        turned = {joint: gear.turned(torque[joint][place], one.period) for joint, gear in gears.items()}
        bodies.append(_behind(balances, one, turned) if turned else one)
    return bodies


def transmitted(balances: "JointBalances", joint: str, gear: ElasticGear) -> list[Array]:
    """Torque (n,) of the gear of a joint along each motion: its effort less what rotor, losses and actuator of its path take of it."""
    balance, inertia = balances.balance(joint), balances.models[joint].mass.value
    rotor = balances.machine.body.parameters[f"{joint}.armature"]
    given = {name: taken for name, (taken, _) in balance.motions[0].links.items()}
    known = {name: value for name, value in given.items() if name in gear.path.parameters}
    path = gear.path.with_values({INERTIA: inertia + gear.rotor, **known})
    found = []
    for motion, required in zip(balance.motions, balance.required(path), strict=True):
        assert motion.coupling is not None  # each joint has the rest of the body
        lost = required - motion.coupling - inertia * motion.acceleration
        found.append(motion.effort - lost - rotor * motion.acceleration)
    return found


def _behind(balances: "JointBalances", rigid: BodyMotion, turned: Mapping[str, Array]) -> BodyMotion:
    """A motion whose links are behind their encoders by these angles (n,), with the forces that this requires."""
    body = balances.machine.body
    pose, rate, acceleration = rigid.pose.copy(), rigid.rate.copy(), rigid.acceleration.copy()
    for joint, angle in turned.items():
        own = body.joints[joint]
        behind = CubicSpline(rigid.time, low_pass(angle, rigid.period, balances.cut))
        pose[:, own.position] -= behind(rigid.time)
        rate[:, own.velocity] -= behind(rigid.time, 1)
        acceleration[:, own.velocity] -= CubicSpline(rigid.time, behind(rigid.time, 1))(rigid.time, 1)
    force = body.inverse(pose, rate, acceleration)
    for joint in turned:  # the rotor stays with the encoder
        own, rotor = body.joints[joint].velocity, body.parameters[f"{joint}.armature"]
        force[:, own] += rotor * (rigid.acceleration[:, own] - acceleration[:, own])
    return replace(rigid, pose=pose, rate=rate, acceleration=acceleration, force=force, rigid=rigid)
