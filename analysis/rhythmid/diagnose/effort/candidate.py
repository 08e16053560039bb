"""Possible additions to a model that explain an effort: elements of the catalogue, freed values, a longer delay."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rhythmid.diagnose.constants import LONGEST_DELAY
from rhythmid.diagnose.hypothesis import Kind
from rhythmid.elements.candidates import candidates
from rhythmid.elements.catalogue import Catalogue
from rhythmid.elements.element import Element, Scales
from rhythmid.elements.first_guess import rescaled
from rhythmid.identify.inverse_dynamics.balance import Balance
from rhythmid.identify.inverse_dynamics.estimate import Alignment, EffortFit, linearise, size_of
from rhythmid.identify.least_squares import orthonormal
from rhythmid.identify.student import weights_of
from rhythmid.model import INERTIA, Model
from rhythmid.simulation.transport import INPUT_DELAY
from rhythmid.value import Prior

Array = NDArray[np.float64]
SEEN = ("force", "actuator")  # slots whose elements show in the effort balance
# the same where a controller computes the effort from its reference
SEEN_BY_REFERENCE = (*SEEN, "command")
NO_MOTOR = "it acts on the force of an actuator, and the effort that was recorded is zero: no motor acts"


@dataclass(frozen=True)
class Start:
    """One first guess of an addition: the `values` of an element, or of the one parameter that is freed."""

    kind: Kind
    name: str
    element: Element | None
    values: Mapping[str, float]


@dataclass(frozen=True)
class Screened:
    """A first guess, the reduction of its parent's cost if only its size were fitted, and the factor for that size."""

    start: Start
    gain: float
    factor: float


def starts_of(catalogue: Catalogue, model: Model, sizes: Scales, balance: Balance) -> list[Start]:
    """First guesses of all possible additions that show in the effort."""
    found: list[Start] = []
    driven = any(motion.driven_by_base for motion in balance.motions)
    for element, values in candidates(catalogue.within(sizes), model.setting, sizes).tried:
        if not _seen(element, balance):
            continue
        if (driven or balance.undriven) and element.slot == "actuator":
            continue
        if driven and element.acts == "drive":
            continue
        found.append(Start("effects", element.name, element, values))
    found += [
        Start("freed_value", name, None, {name: model.value(name)}) for name in fixed_values(balance, model)
    ]
    if not (driven or balance.undriven):
        found.append(Start("delay", INPUT_DELAY, None, {}))
    return found


def _seen(element: Element, balance: Balance) -> bool:
    """Whether the effort balance shows an element. A delay, which has no kernel, shows where a reference is known."""
    if (
        element.slot not in (SEEN_BY_REFERENCE if balance.by_reference else SEEN)
        or element.acts == "feedback"
    ):
        return False
    if element.slot == "command" and element.acts in ("leg", "observation"):
        return element.kernel is not None or element.delay is not None
    return element.kernel is not None and not element.history


def not_tried(catalogue: Catalogue, model: Model, sizes: Scales, balance: Balance) -> dict[str, str]:
    """Candidates that are not tried, by name, with the reason.

    The model or the motion rules them out, or they do not show in the effort balance, as elements of commands, sensors
    and clocks do not.
    """
    reasons = dict(candidates(catalogue.within(sizes), model.setting, sizes).not_tried)
    for element in catalogue.values():
        if not element.candidate:
            continue
        if _seen(element, balance):
            if balance.undriven and element.slot == "actuator":
                reasons[element.name] = NO_MOTOR
            continue
        if element.slot not in SEEN:
            reasons[element.name] = f"it acts in the {element.slot} path, which the effort does not show"
        elif element.history:
            reasons[element.name] = (
                "it acts on past values, which the balance of effort at one instant does not contain"
            )
    return reasons


def fixed_values(balance: Balance, model: Model) -> list[str]:
    """Fixed values of the model that the effort can determine.

    Left out are choices of form (an exponent, a side) and zeros of elements, which the file may not have meant. A link's
    zero payload is kept, because it is meant. Where no motor acts, the forces of the body balance one another, and no effort tells their
    size: there masses that are freed one after another make all of them vanish, and links are left to the joints that are driven.
    """
    links = balance.motions[0].links
    meant = (n for n in model.held if (not balance.undriven if n in links else model.value(n) != 0.0))
    freed = {name for name in meant if name != INERTIA}
    names = [name for name in balance.estimated(with_freed(model, freed)) if name in freed]
    if model.mass.fixed and not any(motion.driven_by_base for motion in balance.motions):
        names.insert(0, INERTIA)
    return names


def with_freed(model: Model, names: set[str] | Sequence[str]) -> Model:
    """The model with these parameters free."""
    parameters = model.parameters
    return model.with_parameters({name: replace(parameters[name], fixed=False) for name in names})


def extended(model: Model, start: Start, factor: float = 1.0) -> tuple[Model, str]:
    """The model with the addition, scaled to `factor` times the guess, and the label of the addition."""
    if start.element is None:
        return (with_freed(model, [start.name]) if start.kind == "freed_value" else model), start.name
    element = start.element
    values = start.values if element.clock else rescaled(element, start.values, factor)
    grown = model.with_element(element, values)
    label = grown.terms[-1].label
    if element.clock:  # all ticks of the record depend on the period: it is one of the usual values, and no descent finds another
        own = f"{label}.{element.clock}"
        grown = grown.with_parameters({own: replace(grown.parameters[own], fixed=True)})
    return (_alone(grown, element) if element.acts == "constraint" else grown), label


def _alone(model: Model, constraint: Element) -> Model:
    """The model with the laws that a constraint contains set to zero effect: a simulator's joint has one dry friction."""
    absent = {}
    for term in model.terms:
        element = term.element
        if constraint.name in element.special_case_of and element.size:
            name = f"{term.label}.{element.size}"
            absent[name] = replace(model.parameters[name], value=element.absent, fixed=True)
    return model.with_parameters(absent)


def screen(balance: Balance, parent: EffortFit, starts: Sequence[Start]) -> list[Screened]:
    """Score test in terms of the effort: the best first guess of every addition to a fitted model, best addition first.

    Parameters at a bound are not projected out. They stay there beside a small addition, though their columns may be
    parallel to that of the addition.
    """
    weight = weights_of(parent.residual, parent.scale) / parent.scale**2
    root = np.sqrt(weight)
    # priors are additional rows
    inside = ~parent.at_limit
    rows = np.vstack([parent.jacobian * root[:, None], np.diag(np.sqrt(parent.precision))])
    basis = orthonormal(rows[:, inside])
    target = np.concatenate([parent.residual * root, np.sqrt(parent.precision) * parent.departure])
    left = target - basis @ (basis.T @ target)
    base = balance.predicted(parent.model, parent.alignment)
    best: dict[tuple[str, str], Screened] = {}
    for start in starts:
        if start.kind == "delay":
            best[start.kind, start.name] = Screened(start, math.inf, 1.0)  # sought by a scan of its own
            continue
        column = _column(balance, parent, start, base)
        if not _says_something(column):
            continue
        change = np.concatenate([column * root, np.zeros(len(parent.precision))])
        raw = float(change @ change)
        change = change - basis @ (basis.T @ change)
        strength = float(change @ change)
        if strength < 1e-8 * raw:
            continue
        factor = -float(change @ left) / strength
        if start.element is not None and start.element.clock:
            factor = 1.0
        gain = -factor * float(change @ left) - 0.5 * factor**2 * strength
        if start.element is not None and start.element.forbids(start.values, factor):
            gain = 0.0
        one = Screened(start, gain, factor)
        key = (start.kind, start.name)
        if key not in best or best[key].gain < gain:
            best[key] = one
    return sorted(best.values(), key=lambda one: -one.gain)


def columns_of(balance: Balance, parent: EffortFit, starts: Sequence[Start]) -> Array:
    """Changes (n, m) of the predicted effort by additions, without those that are zero or not finite."""
    base = balance.predicted(parent.model, parent.alignment)
    seen = list(filter(_says_something, (_column(balance, parent, start, base) for start in starts)))
    return np.column_stack(seen) if seen else np.zeros((len(base), 0))


def _says_something(column: Array) -> bool:
    return bool(np.isfinite(column).all() and column.any())


def _column(balance: Balance, parent: EffortFit, start: Start, base: Array) -> Array:
    """Change (n,) of the predicted effort by an addition."""
    if start.element is None:
        value = parent.model.value(start.name)
        step = 1e-3 * (abs(value) or 1.0)
        moved = parent.model.with_values({start.name: value + step})
        return (balance.predicted(moved, parent.alignment) - base) / step
    grown, _ = extended(parent.model, start)
    return balance.predicted(grown, parent.alignment) - base


def late_start(balance: Balance, parent: EffortFit) -> tuple[Alignment, float]:
    """Allowed range of a longer delay, and the delay [s] that fits best with the parent's parameters to first order.

    A delay is not negative: an effort that was recorded after the motion, such as a filtered one, is no effect of the machine.
    """
    most = max(LONGEST_DELAY / balance.bandwidth.dominant, 2.0 * balance.period)
    required = balance.required(parent.model)
    weight = weights_of(parent.residual, parent.scale) / parent.scale**2
    root = np.sqrt(weight)
    basis = orthonormal(parent.jacobian[:, 1:] * root[:, None]) if parent.names else np.zeros((len(root), 0))
    best, place = math.inf, parent.alignment
    for late in np.linspace(0.0, most, 1 + min(60, math.ceil(2.0 * most / balance.period))):
        rows = balance.rows(required, balance.later(parent.model, float(late)))
        error = root * (balance.with_moved(rows, parent.model, float(late)) - balance.measured)
        error = error - basis @ (basis.T @ error)
        if float(error @ error) < best:
            best, place = float(error @ error), float(late)
    return Alignment(most, 0.0, most), place


def widest(balance: Balance, column: Array) -> float:
    """Change of a parameter that changes the effort by the effort's own size; `column` (n,) is the effect per unit."""
    strength = float(np.sqrt(np.mean(column**2)))
    return size_of(balance) / strength if strength > 0.0 else math.inf


def priors_of_effect(balance: Balance, model: Model, label: str, alignment: float) -> dict[str, Prior]:
    """Priors of an effect's parameters in a model: a change of any of them may change the effort by at most the effort's size."""
    term = model.term(label)
    assert term is not None
    names = [name for name in model.free if name.startswith(f"{label}.")]
    _, columns = linearise(balance, model, names, alignment)
    found: dict[str, Prior] = {}
    for name, column in zip(names, columns[:, 1:].T, strict=True):
        value, mean = model.parameters[name], model.value(name)
        if name == f"{label}.{term.element.size}" and math.isfinite(term.element.absent):
            mean = term.element.absent
        spread = widest(balance, column)
        width = value.bounds[1] - value.bounds[0]
        found[name] = Prior(mean, min(spread, width if width > 0.0 else spread))
    return found
