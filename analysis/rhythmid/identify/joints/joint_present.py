"""An identification of several joints as a report."""

import numpy as np

from rhythmid.body.machine import Machine
from rhythmid.body.robot_tree import parents_of
from rhythmid.identify.inverse_dynamics.balance import Balance
from rhythmid.identify.inverse_dynamics.estimate import EffortFit
from rhythmid.identify.joints.joint_identification import MachineIdentification
from rhythmid.model import Model
from rhythmid.report.joint_identification import IdentifiedEffort, joint_identification_page
from rhythmid.report.page import Page
from rhythmid.report.robot_figure import DrawnJoint


def present_identified(found: MachineIdentification, given: Machine, source: str, command: str = "") -> Page:
    """Report page of an identification. `given` is the machine before it, `source` names model and records,
    `command` is the command line."""
    faults = dict.fromkeys(found.worse, "worse than given") | dict.fromkeys(
        found.not_identified, "not identified"
    )
    parents = parents_of(given.body)
    robot = [
        DrawnJoint(name, parents[name], joint.rotational, faults.get(name, ""), True)
        for name, joint in given.body.joints.items()
    ]
    efforts = {
        joint: _effort(balance, model, fit, given.body.joints[joint].rotational)
        for joint, (balance, model, fit) in found.fits.items()
    }
    models = {"Given machine": given.to_yaml(), "Identified machine": found.machine.to_yaml()}
    return joint_identification_page(found.to_dict(), source, robot, efforts, command, models)


def _effort(balance: Balance, model: Model, fit: EffortFit, turns: bool) -> IdentifiedEffort:
    """A joint's effort over the stretch with the most rows."""
    counts = [len(one) for one in balance.places]
    longest = int(np.argmax(counts))
    rows = slice(sum(counts[:longest]), sum(counts[: longest + 1]))
    measured = balance.measured[rows]
    return IdentifiedEffort(
        balance.motions[longest].time[np.asarray(balance.places[longest], dtype=int)],
        measured,
        balance.predicted(model)[rows],
        measured + fit.residual[rows],
        "N*m" if turns else "N",
    )
