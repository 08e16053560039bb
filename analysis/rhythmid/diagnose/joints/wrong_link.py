"""A link whose mass is wrong or that carries a payload, and the machine with that put right."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from rhythmid.body.body import BODY
from rhythmid.body.inertial_parameter import PAYLOAD, split
from rhythmid.body.machine import Machine
from rhythmid.diagnose.answer.result import Estimate
from rhythmid.diagnose.joints.joint_case import JointResult
from rhythmid.diagnose.joints.payload_place import placed_payload
from rhythmid.identify.joints.joint_motion import JointBalances
from rhythmid.record.joint_record import JointRecord

AXES = ("x", "y", "z")


@dataclass(frozen=True, eq=False)
class WrongLink:
    """What is wrong with a link: the body's `parameter`, as "link.mass" or "link.payload", its `values` ("mass" [kg]; of a payload its place
    "x", "y", "z" [m] in the link's frame as well), and the joint that has `shown` it best."""

    parameter: str
    values: Mapping[str, Estimate]
    shown: JointResult

    def put_right(self, machine: Machine) -> Machine:
        """The machine with these values."""
        link, kind = split(self.parameter)
        mass = self.values["mass"].value
        if kind == PAYLOAD:
            return machine.with_payload(link, mass, np.array([self.values[axis].value for axis in AXES]))
        return machine.with_inertial({self.parameter: mass})


def wrong_link(
    balances: JointBalances,
    records: Sequence[JointRecord],
    found: Mapping[str, JointResult],
    parameter: str,
    shown: JointResult,
) -> WrongLink:
    """The values of a link's mass or payload, which the search at a joint has found to be wrong."""
    link, kind = split(parameter)
    if kind == PAYLOAD:
        payload = placed_payload(balances, records, found, link, shown.joint)
        values = {"mass": Estimate(payload.mass, payload.mass_std, "kg")}
        for axis, place, std in zip(AXES, payload.place, payload.place_std, strict=True):
            values[axis] = Estimate(float(place), float(std), "m")
        return WrongLink(parameter, values, shown)
    label = f"{BODY}.{parameter}"
    value = shown.result.chosen.model.parameters[label]
    return WrongLink(
        parameter,
        {"mass": Estimate(value.value, shown.result.chosen.std().get(label, 0.0), value.unit)},
        shown,
    )
