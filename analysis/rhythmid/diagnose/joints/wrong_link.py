"""A link with a wrong mass or inertia or with a payload, and the machine with the corrected value."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from rhythmid.body.body import BODY
from rhythmid.body.inertial_parameter import CENTRE, LOAD, MASS, MOMENT, PAYLOAD, TURNING, split
from rhythmid.body.link_inertia import Principal
from rhythmid.body.machine import Machine
from rhythmid.diagnose.answer.result import Estimate
from rhythmid.diagnose.constants import CONTRADICTS
from rhythmid.diagnose.joints.joint_case import JointResult
from rhythmid.diagnose.joints.link_centre import NUMBERS, PLACES, Load, refitted_link
from rhythmid.diagnose.joints.link_evidence import shared_estimate
from rhythmid.diagnose.joints.link_group import Together, masses_alike
from rhythmid.diagnose.joints.payload_place import AXES, placed_payload
from rhythmid.diagnose.rejections import decisive
from rhythmid.identify.joints.joint_motion import JointBalances
from rhythmid.record.joint_record import JointRecord
from rhythmid.report.quantity import with_std


@dataclass(frozen=True, eq=False)
class WrongLink:
    """The wrong quantity of a link.

    `parameter` is the body's, as "link.mass", "link.inertia" or "link.payload". `values` are "mass" [kg], or "inertia" [kg*m^2]
    about the centre of mass along the axis of the link's joint; for a payload also its place "x", "y", "z" [m] in the link's
    frame; for "link.centre_of_mass" only its place. `load` is the inertia of the link where its centre was fitted, `given` the file's where its mass and centre may not be separated. `together`
    are the links whose masses the records do not separate from this one. `shown` is the joint that shows it best, `label` the parameter that was freed
    there. `alike` are the other quantities of the link that explain the records as well.
    """

    parameter: str
    values: Mapping[str, Estimate]
    shown: JointResult
    label: str
    alike: tuple[str, ...] = ()
    load: Load | None = None
    given: Principal | None = None
    together: Together | None = None

    @property
    def told(self) -> dict[str, Estimate]:
        """The values that the records determine: without a mass that they do not separate from its distance if the file's is within its
        interval."""
        if self.together is not None:
            return {"mass_together": self.together.mass}
        given, mass = self.given, self.values.get(MASS)
        if given is None or mass is None or abs(mass.value - given.mass) > CONTRADICTS * (mass.std or 0.0):
            return dict(self.values)
        return {name: one for name, one in self.values.items() if name != MASS}

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
            before, told = replace(self.load, ten=own.ten), self.told
            said = [
                _change(old, told[name])
                for name, old in ((MASS, before.mass_value), (MOMENT, before.first_moment))
                if name in told
            ]
            if "x" in told:
                places = ", ".join(f"{one:.3g}" for one in own.centre)
                now = ", ".join(with_std(one.value, one.std) for one in (told[axis] for axis in AXES))
                said.append(f"({places}) m in the nominal model, ({now}) m in the records")
            return f"{self.parameter}: {'; '.join(said)}"
        if self.together is not None:
            links = ", ".join((link, *self.together.links))
            return f"mass of {links} together: {_change(self.together.given, self.together.mass)}"
        if kind not in self.told and MOMENT in self.told:
            moment = self.told[MOMENT]
            return f"{link}.{MOMENT}: {with_std(moment.value, moment.std)} {moment.unit} in the records"
        new = self.values[MASS if kind == PAYLOAD else kind]
        return (
            f"{self.parameter}: {_change(replace(new, value=machine.body.parameters[self.parameter]), new)}"
        )


def _change(before: Estimate, after: Estimate) -> str:
    """A value of the nominal model and that of the records, in words."""
    return (
        f"{before.value:.4g} {after.unit} in the nominal model, "
        f"{with_std(after.value, after.std)} {after.unit} in the records"
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
    centre, both = (
        refitted_link(balances, records, found, link, corrected, centre_only) for centre_only in (True, False)
    )
    # its ten numbers were fitted to these efforts: each one beyond those of the simpler cause has to be worth the odds
    price = decisive(1) * np.array([NUMBERS - 1, NUMBERS - PLACES])
    simpler = max(price[0], centre.weight + price[1] if centre.better else 0.0)
    if both.weight > simpler and (both.mass_moved or both.moved or both.moment_moved):
        return _of_load(wrong, link, LOAD, both)
    if centre.better:
        return _of_load(wrong, link, CENTRE, centre)
    if kind == MASS and (
        alike := masses_alike(
            corrected, found, parameter, wrong.values[MASS], balances.machine.body.own(link).mass
        )
    ):
        wrong = replace(wrong, together=alike)
    if not centre.as_good:
        return wrong
    values = wrong.values
    if kind == MASS:  # one joint feels mass times distance: the mass is as uncertain as the distance
        own = values[MASS]
        wide = replace(own, std=math.hypot(own.std or 0.0, both.mass_value.std or 0.0))
        values = {MASS: wide, MOMENT: both.first_moment}
    return replace(
        wrong, values=values, alike=(f"link_{CENTRE}",), given=both.given if kind == MASS else None
    )


def _of_load(wrong: WrongLink, link: str, kind: str, load: Load) -> WrongLink:
    """The wrong link with this mass and centre, and in its values what the records determine of them."""
    values = dict(load.values)
    if kind == LOAD:
        places = values if load.moved else {}
        values = {MASS: load.mass_value, **places, MOMENT: load.first_moment}
    return replace(wrong, parameter=f"{link}.{kind}", values=values, load=load, given=load.given)


def _of_parameter(
    balances: JointBalances,
    records: Sequence[JointRecord],
    found: Mapping[str, JointResult],
    parameter: str,
    shown: JointResult,
) -> WrongLink:
    link, kind = split(parameter)
    if kind == PAYLOAD:
        values = placed_payload(balances, records, found, link, shown.joint)
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
