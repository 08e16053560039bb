"""A link with a wrong mass or inertia or with a payload, and the machine with the corrected value."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from rhythmid.body.body import BODY
from rhythmid.body.inertial_parameter import CENTRE, LOAD, MASS, MOMENT, PAYLOAD, TURNING, split
from rhythmid.body.machine import Machine
from rhythmid.diagnose.answer.result import Estimate
from rhythmid.diagnose.joints.joint_case import JointResult
from rhythmid.diagnose.joints.link_centre import NUMBERS, PLACES, Load, centre_instead, load_instead
from rhythmid.diagnose.joints.link_evidence import shared_estimate
from rhythmid.diagnose.joints.payload_place import placed_payload
from rhythmid.diagnose.rejections import decisive
from rhythmid.identify.joints.joint_motion import JointBalances
from rhythmid.record.joint_record import JointRecord
from rhythmid.report.quantity import rounded

AXES = ("x", "y", "z")


@dataclass(frozen=True, eq=False)
class WrongLink:
    """The wrong quantity of a link.

    `parameter` is the body's, as "link.mass", "link.inertia" or "link.payload". `values` are "mass" [kg], or "inertia" [kg*m^2]
    about the centre of mass along the axis of the link's joint; for a payload also its place "x", "y", "z" [m] in the link's
    frame; for "link.centre_of_mass" only its place. `load` is the mass and the centre of the link where the centre was fitted. `shown` is the joint that shows it best, `label` the parameter that was freed
    there. `alike` are the other quantities of the link that explain the records as well.
    """

    parameter: str
    values: Mapping[str, Estimate]
    shown: JointResult
    label: str
    alike: tuple[str, ...] = ()
    load: Load | None = None

    def put_right(self, machine: Machine) -> Machine:
        """The machine with these values."""
        link, kind = split(self.parameter)
        if self.load is not None and kind == CENTRE:
            return machine.with_centre(link, self.load.place)
        if self.load is not None:
            return machine.with_load(link, self.load.ten)
        if kind == PAYLOAD:
            place = np.array([self.values[axis].value for axis in AXES])
            return machine.with_payload(link, self.values[MASS].value, place)
        return machine.with_inertial({self.parameter: self.values[kind].value})

    def beside(self, machine: Machine) -> str:
        """One sentence with the machine's value and the corrected one."""
        link, kind = split(self.parameter)
        if self.load is not None:
            own = machine.body.own(link)
            before = replace(self.load, ten=own.ten)
            said = [_change(before.first_moment, self.values[MOMENT])] if MOMENT in self.values else []
            if MASS in self.values:
                said.insert(0, _change(before.mass_value, self.values[MASS]))
            if "x" in self.values:
                places = ", ".join(f"{one:.3g}" for one in own.centre)
                now = ", ".join(f"{rounded(v.value, v.std)} ± {v.std:.2g}" for v in map(self.values.__getitem__, AXES))
                said.append(f"({places}) m in the nominal model, ({now}) m in the records")
            return f"{self.parameter}: {'; '.join(said)}"
        new = self.values[MASS if kind == PAYLOAD else kind]
        return f"{self.parameter}: {_change(replace(new, value=machine.body.parameters[self.parameter]), new)}"


def _change(before: Estimate, after: Estimate) -> str:
    """A value of the nominal model and that of the records, in words."""
    return (
        f"{before.value:.4g} {after.unit} in the nominal model, "
        f"{rounded(after.value, after.std)} ± {after.std:.2g} {after.unit} in the records"
    )


def wrong_link(
    balances: JointBalances,
    records: Sequence[JointRecord],
    found: Mapping[str, JointResult],
    parameter: str,
    shown: JointResult,
) -> WrongLink:
    """Correct values of a link's mass, inertia or payload, which the search at a joint has found to be wrong.

    It is the link's centre of mass instead, or mass and centre together, where the joints that feel the link give this decisively more.
    """
    wrong = _of_parameter(balances, records, found, parameter, shown)
    link, kind = split(parameter)
    if link in balances.machine.body.centres:
        return wrong
    corrected = JointBalances.of(wrong.put_right(balances.machine), records, balances)
    centre = centre_instead(balances, records, found, link, corrected)
    both = load_instead(balances, records, found, link, corrected)
    simpler = max(decisive(NUMBERS), centre.weight + decisive(NUMBERS - PLACES) if centre.better else 0.0)
    if both.weight > simpler and (both.mass_moved or both.moved):
        return _of_load(wrong, link, LOAD, both)
    if centre.better:
        return _of_load(wrong, link, CENTRE, centre)
    if not centre.as_good:
        return wrong
    values = wrong.values
    if kind == MASS:  # one joint feels mass times distance: the mass is as uncertain as the distance
        own = values[MASS]
        wide = replace(own, std=math.hypot(own.std, both.mass_value.std))
        values = {MASS: wide, MOMENT: both.first_moment}
    return replace(wrong, values=values, alike=(f"link_{CENTRE}",))


def _of_load(wrong: WrongLink, link: str, kind: str, load: Load) -> WrongLink:
    """The wrong link with this mass and centre, and in its values what the records determine of them."""
    values = dict(load.values)
    if kind == LOAD:
        values = {MASS: load.mass_value, **values, MOMENT: load.first_moment}
    return replace(wrong, parameter=f"{link}.{kind}", values=values, load=load)


def _of_parameter(
    balances: JointBalances,
    records: Sequence[JointRecord],
    found: Mapping[str, JointResult],
    parameter: str,
    shown: JointResult,
) -> WrongLink:
    link, kind = split(parameter)
    if kind == PAYLOAD:
        payload = placed_payload(balances, records, found, link, shown.joint)
        values = {"mass": Estimate(payload.mass, payload.mass_std, "kg")}
        for axis, place, std in zip(AXES, payload.place, payload.place_std, strict=True):
            values[axis] = Estimate(float(place), float(std), "m")
        return WrongLink(parameter, values, shown, f"{BODY}.{parameter}")
    label, chosen = f"{BODY}.{parameter}", shown.result.chosen
    value = chosen.model.parameters[label]
    size, mass = value.value, f"{BODY}.{link}.{MASS}"
    if (
        kind == TURNING and mass in chosen.elements
    ):  # the search changed the mass together with the inertia of its shape
        known = shown.case.nominal
        size += known.value(label) * (chosen.model.value(mass) / known.value(mass) - 1.0)
    own = Estimate(size, chosen.std().get(label, 0.0), value.unit)
    return WrongLink(parameter, {kind: shared_estimate(balances, found, parameter, shown, own)}, shown, label)
