"""A link with a wrong mass, inertia or centre of mass or with a payload, and the machine with the corrected value."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhythmid.body.inertial_parameter import CENTRE, LOAD, MASS, MOMENT, PAYLOAD, TURNING, split
from rhythmid.body.link_inertia import Principal
from rhythmid.body.machine import Machine
from rhythmid.body.mujoco_body import MujocoBody
from rhythmid.diagnose.answer.result import Estimate
from rhythmid.diagnose.constants import CONTRADICTS
from rhythmid.diagnose.joints.link_group import Together
from rhythmid.report.quantity import with_std

Array = NDArray[np.float64]
AXES = ("x", "y", "z")
MATTERS = 0.02  # smallest change of a mass or an inertia that an effort balance resolves, as a share of it


@dataclass(frozen=True, eq=False)
class WrongLink:
    """The wrong quantity of a link, as it fits the efforts of all joints.

    `parameter` is the body's, as "link.mass", "link.inertia" or "link.payload". `values` are "mass" [kg], or "inertia" [kg*m^2]
    about the centre of mass along the axis of the link's joint; for a payload also its place "x", "y", "z" [m] in the link's
    frame; for "link.centre_of_mass" only its place; for "link.mass_and_centre" also the "first_moment" [kg*m]. `corrected` is the machine with them.
    `probability` is that of the cause, `shown` the joint that shows it best, and `share` what it explains of that joint's mismatch. `alike` are other
    quantities of the link that explain the records as well, `together` the links whose masses the records do not separate from this one.
    """

    parameter: str
    values: Mapping[str, Estimate]
    corrected: Machine
    probability: float
    weight: float
    shown: str
    share: float
    alike: tuple[str, ...] = ()
    together: Together | None = None

    @property
    def words(self) -> str:
        """The finding as one clause, while the joints are searched."""
        link, kind = split(self.parameter)
        return f"{kind.replace('_', ' ')} of {link}: all joints together give it {self.weight:.0f} nat"

    def told(self, given: MujocoBody) -> dict[str, Estimate]:
        """The values that the records determine: without a mass that they do not separate from its distance if that of the `given` body is within its
        interval."""
        if self.together is not None:
            return {"mass_together": self.together.mass}
        link, kind = split(self.parameter)
        mass = self.values.get(MASS)
        open_ = kind in (MASS, LOAD) and MOMENT in self.values
        if (
            not open_
            or mass is None
            or abs(mass.value - given.own(link).mass) > CONTRADICTS * (mass.std or 0.0)
        ):
            return dict(self.values)
        return {name: one for name, one in self.values.items() if name != MASS}

    def _added(self, own: Principal) -> list[str]:
        """What the link carries beyond its own inertia in the nominal model, in words, if a body can have that."""
        more = self.corrected.body.own(split(self.parameter)[0]).ten - own.ten
        if more[0] <= MATTERS * own.mass or not Principal.from_ten(more).possible:
            return []
        places = ", ".join(f"{one:.3g}" for one in more[1:4] / more[0])
        return [f"that is a body of {more[0]:.3g} kg at ({places}) m on the link"]

    def beside(self, machine: Machine) -> str:
        """One sentence with the machine's value and the corrected one."""
        link, kind = split(self.parameter)
        own, told = machine.body.own(link), self.told(machine.body)
        if kind in (CENTRE, LOAD):
            distance = float(np.linalg.norm(own.centre - origin_of(machine.body, link)))
            before = {MASS: own.mass, MOMENT: own.mass * distance}
            said = [_change(old, told[name]) for name, old in before.items() if name in told]
            if "x" in told:
                places = ", ".join(f"{one:.3g}" for one in own.centre)
                now = ", ".join(with_std(one.value, one.std) for one in (told[axis] for axis in AXES))
                said.append(f"({places}) m in the nominal model, ({now}) m in the records")
            return f"{self.parameter}: {'; '.join((*said, *self._added(own)))}"
        if self.together is not None:
            links = ", ".join((link, *self.together.links))
            return f"mass of {links} together: {_change(self.together.given.value, self.together.mass)}"
        if kind not in told and MOMENT in told:
            moment = told[MOMENT]
            return f"{link}.{MOMENT}: {with_std(moment.value, moment.std)} {moment.unit} in the records"
        new = self.values[MASS if kind == PAYLOAD else kind]
        return f"{self.parameter}: {_change(machine.body.parameters[self.parameter], new)}"


def _change(before: float, after: Estimate) -> str:
    """A value of the nominal model and that of the records, in words."""
    return f"{before:.4g} {after.unit} in the nominal model, {with_std(after.value, after.std)} {after.unit} in the records"


def origin_of(body: MujocoBody, link: str) -> Array:
    """The point (3,) [m] from which the first moment of a link is taken: on the hinge that rotates it."""
    hinge = body.hinges.get(link)
    return np.zeros(3) if hinge is None else hinge.place


def first_moment(body: MujocoBody, link: str, mass: float, centre: Array, covariance: Array) -> Estimate:
    """Mass times distance of the centre: what a single joint feels, so that it may be known where mass and centre are not; `covariance` (4, 4) is
    that of both."""
    arm = centre - origin_of(body, link)
    far = max(float(np.linalg.norm(arm)), 1e-12)
    slope = np.concatenate([[far], mass * arm / far])
    return Estimate(mass * far, math.sqrt(max(float(slope @ covariance @ slope), 0.0)), "kg*m")


def values_of(
    body: MujocoBody, corrected: MujocoBody, link: str, kind: str, covariance: Array
) -> dict[str, Estimate]:
    """The values of a link that were changed in a `corrected` body; the `covariance` (k, k) is that of the numbers of the change."""
    own, now = body.own(link), corrected.own(link)
    std = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    if kind == MASS:
        return {MASS: Estimate(now.mass, own.mass * float(std[0]), "kg")}
    if kind == TURNING:
        name = f"{link}.{TURNING}"
        before = body.parameters[name]
        return {TURNING: Estimate(corrected.parameters[name], before * float(std[0]), "kg*m^2")}
    place = corrected.ends[link] if kind == PAYLOAD else now.centre
    places = {
        axis: Estimate(float(at), float(one), "m")
        for axis, at, one in zip(AXES, place, std[-3:] if kind != LOAD else std[1:4], strict=True)
    }
    if kind == CENTRE:
        return places
    if kind == PAYLOAD:
        return {MASS: Estimate(corrected.parameters[f"{link}.{PAYLOAD}"], float(std[0]), "kg"), **places}
    part = np.diag([own.mass, 1.0, 1.0, 1.0])
    of_mass = part @ covariance[:4, :4] @ part
    moved = bool(np.any(np.abs(now.centre - own.centre) > CONTRADICTS * std[1:4]))
    mass = Estimate(now.mass, own.mass * float(std[0]), "kg")
    return {
        MASS: mass,
        **(places if moved else {}),
        MOMENT: first_moment(corrected, link, now.mass, now.centre, of_mass),
    }
