"""A link with a wrong mass or inertia or with a payload, and the machine with the corrected value."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from rhythmid.body.body import BODY
from rhythmid.body.inertial_parameter import CENTRE, MASS, PAYLOAD, TURNING, split
from rhythmid.body.machine import Machine
from rhythmid.diagnose.answer.result import Estimate
from rhythmid.diagnose.joints.joint_case import JointResult
from rhythmid.diagnose.joints.link_centre import centre_instead
from rhythmid.diagnose.joints.link_evidence import shared_estimate
from rhythmid.diagnose.joints.payload_place import placed_payload
from rhythmid.identify.joints.joint_motion import JointBalances
from rhythmid.record.joint_record import JointRecord
from rhythmid.report.quantity import rounded

AXES = ("x", "y", "z")


@dataclass(frozen=True, eq=False)
class WrongLink:
    """The wrong quantity of a link.

    `parameter` is the body's, as "link.mass", "link.inertia" or "link.payload". `values` are "mass" [kg], or "inertia" [kg*m^2]
    about the centre of mass along the axis of the link's joint; for a payload also its place "x", "y", "z" [m] in the link's
    frame; for "link.centre_of_mass" only its place. `shown` is the joint that shows it best, `label` the parameter that was freed
    there. `alike` are the other quantities of the link that explain the records as well.
    """

    parameter: str
    values: Mapping[str, Estimate]
    shown: JointResult
    label: str
    alike: tuple[str, ...] = ()

    def put_right(self, machine: Machine) -> Machine:
        """The machine with these values."""
        link, kind = split(self.parameter)
        if kind in (PAYLOAD, CENTRE):
            place = np.array([self.values[axis].value for axis in AXES])
        if kind == CENTRE:
            return machine.with_centre(link, place)
        if kind == PAYLOAD:
            return machine.with_payload(link, self.values[MASS].value, place)
        return machine.with_inertial({self.parameter: self.values[kind].value})

    def beside(self, machine: Machine) -> str:
        """One sentence with the machine's value and the corrected one."""
        link, kind = split(self.parameter)
        if kind == CENTRE:
            before = ", ".join(f"{one:.3g}" for one in machine.body.own(link).centre)
            now = ", ".join(f"{rounded(one.value, one.std)} ± {one.std:.2g}" for one in self.values.values())
            return f"{self.parameter}: ({before}) m in the nominal model, ({now}) m in the records"
        new = self.values[MASS if kind == PAYLOAD else kind]
        said = f"{self.parameter}: {machine.body.parameters[self.parameter]:.4g} {new.unit} in the nominal model, "
        return f"{said}{rounded(new.value, new.std)} ± {new.std:.2g} {new.unit} in the records"


def wrong_link(
    balances: JointBalances,
    records: Sequence[JointRecord],
    found: Mapping[str, JointResult],
    parameter: str,
    shown: JointResult,
) -> WrongLink:
    """Correct values of a link's mass, inertia or payload, which the search at a joint has found to be wrong.

    It is the link's centre of mass instead where the joints that feel the link give this decisively more.
    """
    wrong = _of_parameter(balances, records, found, parameter, shown)
    link, _ = split(parameter)
    if link in balances.machine.body.centres:
        return wrong
    corrected = JointBalances.of(wrong.put_right(balances.machine), records, balances)
    centre = centre_instead(balances, records, found, link, corrected)
    if centre.better:
        return replace(wrong, parameter=f"{link}.{CENTRE}", values=centre.values)
    return replace(wrong, alike=(f"link_{CENTRE}",)) if centre.as_good else wrong


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
