"""The machine that an answer leaves: with the fitted paths, the stated effects and the corrected values of the body."""

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

from rhythmid.body.body import BODY
from rhythmid.body.machine import Machine
from rhythmid.diagnose.effort.fitted import Fitted
from rhythmid.diagnose.joints.joint_case import JointResult
from rhythmid.diagnose.joints.stated_fit import stated_fit
from rhythmid.model import INERTIA, Model
from rhythmid.simulation.transport import INPUT_DELAY


def augmented(
    machine: Machine,
    found: Mapping[str, JointResult],
    stated: Mapping[str, Sequence[str]],
    corrected: Collection[str],
) -> Machine:
    """The machine with the fitted paths and the stated effects; values of links that were `corrected` keep those of the answer."""
    inertial: dict[str, float] = {}
    spreads: dict[str, float] = {}
    for joint, one in found.items():
        fitted = stated_fit(one.result, stated[joint])
        path = machine.paths[joint]
        adopted = {
            *stated[joint],
            *one.result.nominal.fit.names,
        }  # without values that were freed but are not stated
        if INERTIA in adopted:
            rotor = fitted.model.mass.value - path.mass.value
            before = machine.body.parameters[f"{joint}.armature"]
            inertial[f"{joint}.armature"] = max(before + rotor, 0.0)
        for (
            label,
            std,
        ) in (
            fitted.std().items()
        ):  # a free mass takes the value of the joint with the smallest standard deviation
            link = label.removeprefix(f"{BODY}.")
            free = label.startswith(f"{BODY}.") and label in adopted and link not in corrected
            if free and std < spreads.get(link, math.inf):
                inertial[link], spreads[link] = fitted.model.value(label), std
        machine = machine.with_path(joint, _without_body(_with_delay(one, fitted), path))
    return machine.with_inertial(inertial) if inertial else machine


def _with_delay(one: JointResult, fitted: Fitted) -> Model:
    """A joint's fitted path; if it has a delay and the effort was computed from the reference, with the reference's whole delay."""
    model = fitted.model
    if not one.by_reference or INPUT_DELAY not in model.parameters or model.parameters[INPUT_DELAY].fixed:
        return model
    late = model.value(INPUT_DELAY) + one.late + fitted.fit.alignment
    return model.with_values({INPUT_DELAY: max(late, 0.0)})


def _without_body(model: Model, path: Model) -> Model:
    """A joint's fitted path without the term for the body and with its own inertia."""
    kept = tuple(term for term in model.terms if term.label != BODY)
    behind = tuple(
        t for t in path.terms if t.label not in {term.label for term in kept}
    )  # elements behind the measured effort
    return replace(model, mass=path.mass, terms=(*kept, *behind))
