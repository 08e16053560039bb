"""What an answer states: the fit of each joint's path with these effects alone, and the machine with all of them and the corrected values of the body."""

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

from rhythmid.body.body import BODY
from rhythmid.body.machine import Machine
from rhythmid.diagnose.answer.compose_effort import effort_parameters
from rhythmid.diagnose.answer.result import Estimate
from rhythmid.diagnose.effort.fitted import Fitted
from rhythmid.diagnose.effort.run import EffortResult
from rhythmid.diagnose.joints.joint_case import JointResult
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


def stated_fit(result: EffortResult, stated: Sequence[str]) -> Fitted:
    """The nominal path's fit if nothing is stated, else the fit with these labels.

    The chosen hypothesis may contain effects whose probability is too low to be stated. Then the search's fit with the stated effects alone is
    used, because its values do not depend on the others. If the search has none, the others are removed from the chosen fit.
    """
    if not stated:
        return result.nominal
    chosen, known = result.chosen, result.nominal.fit.model
    further = {
        label
        for label in chosen.elements
        if label not in stated and chosen.fit.model.term(label) is not None and known.term(label) is None
    }
    if not further:
        return chosen
    for one in result.search.hypotheses:
        if set(one.elements) == set(stated):
            return one
    model = chosen.fit.model
    kept = replace(model, terms=tuple(term for term in model.terms if term.label not in further))
    return replace(chosen, fit=replace(chosen.fit, model=kept))


def stated_parameters(result: EffortResult, stated: Sequence[str]) -> dict[str, Estimate]:
    """Values at a joint, by name: those of the fit with the stated labels, beside which no other effect holds a part of their size; of effects that
    are not stated, those of the chosen hypothesis.

    The standard deviations of the chosen hypothesis hold more than those of its fit: the choice of the model and small effects that
    it lacks. Those of the stated values hold the same.
    """
    found = effort_parameters(result.chosen)
    if not stated:
        return found
    fitted = stated_fit(result, stated)
    told = effort_parameters(fitted)
    if set(fitted.elements) != set(result.chosen.elements):
        beyond = _beyond_the_fit(result)
        told = {name: _wider(one, beyond.get(name, 0.0)) for name, one in told.items()}
    return {**found, **told}


def _beyond_the_fit(result: EffortResult) -> dict[str, float]:
    """What the standard deviations of the chosen hypothesis hold beyond those of its fit, by parameter."""
    of_fit: dict[str, float] = {}
    for one in result.search.hypotheses:
        if set(one.elements) == set(result.chosen.elements):
            of_fit = one.std()
    whole = result.chosen.std()
    return {
        name: math.sqrt(max(std**2 - of_fit[name] ** 2, 0.0)) for name, std in whole.items() if name in of_fit
    }


def _wider(found: Estimate, std: float) -> Estimate:
    """The estimate with a further standard deviation; one that is fixed or not determined is as it was."""
    return replace(found, std=math.hypot(found.std, std)) if found.std else found
