"""A link with a wrong mass or inertia or with a payload, and the machine with the corrected value."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from rhythmid.body.body import BODY
from rhythmid.body.inertial_parameter import MASS, PAYLOAD, TURNING, split
from rhythmid.body.machine import Machine
from rhythmid.diagnose.answer.result import Estimate
from rhythmid.diagnose.joints.joint_case import JointResult
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
    frame. `shown` is the joint that shows it best.
    """

    parameter: str
    values: Mapping[str, Estimate]
    shown: JointResult

    def put_right(self, machine: Machine) -> Machine:
        """The machine with these values."""
        link, kind = split(self.parameter)
        if kind == PAYLOAD:
            place = np.array([self.values[axis].value for axis in AXES])
            return machine.with_payload(link, self.values[MASS].value, place)
        return machine.with_inertial({self.parameter: self.values[kind].value})

    def beside(self, machine: Machine) -> str:
        """One sentence with the machine's value and the corrected one."""
        _, kind = split(self.parameter)
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
    """Correct values of a link's mass, inertia or payload, which the search at a joint has found to be wrong."""
    link, kind = split(parameter)
    if kind == PAYLOAD:
        payload = placed_payload(balances, records, found, link, shown.joint)
        values = {"mass": Estimate(payload.mass, payload.mass_std, "kg")}
        for axis, place, std in zip(AXES, payload.place, payload.place_std, strict=True):
            values[axis] = Estimate(float(place), float(std), "m")
        return WrongLink(parameter, values, shown)
    label, chosen = f"{BODY}.{parameter}", shown.result.chosen
    value = chosen.model.parameters[label]
    size, mass = value.value, f"{BODY}.{link}.{MASS}"
    if (
        kind == TURNING and mass in chosen.elements
    ):  # the search changed the mass together with the inertia of its shape
        known = shown.case.nominal
        size += known.value(label) * (chosen.model.value(mass) / known.value(mass) - 1.0)
    own = Estimate(size, chosen.std().get(label, 0.0), value.unit)
    return WrongLink(parameter, {kind: shared_estimate(balances, found, parameter, shown, own)}, shown)
