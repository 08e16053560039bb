"""The order of effects in a chain: a limit before a lag and a limit behind it are different machines.

In the command path, the actuator and the sensor each effect acts on the output of the one before; forces just add. A new effect
is first placed behind the others, because its score does not depend on the order.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

from rhythmid.deadline import time_is_up
from rhythmid.diagnose.search.refit import run_trials
from rhythmid.diagnose.search.trial import Origin, Proposal, Trial
from rhythmid.elements.element import Element, Slot
from rhythmid.identify.noise import NoiseModel
from rhythmid.identify.series import Series
from rhythmid.model import Model

CHAINS: tuple[Slot, ...] = ("command", "actuator", "sensor")


def in_best_order(trial: Trial, series: Sequence[Series], noise: NoiseModel, step: float) -> Trial:
    """The trial, or the same effects with the newest one moved along its chain where that fits better."""
    others = [Proposal(trial.added, model) for model in other_orders(trial.model, trial.added[-1])]
    if not others or time_is_up():
        return trial
    moved, _ = run_trials(others, series, Origin.of(trial), noise, step)
    return min([trial, *moved], key=lambda one: one.chi2)


def other_orders(model: Model, label: str) -> Iterator[Model]:
    """The model with the term called `label` at each other place of its chain; none if it is alone or in no chain."""
    moving = model.term(label)
    if moving is None or not passes_on(moving.element):
        return
    slot = moving.element.slot
    rest = [term for term in model.terms if term is not moving]
    chain = [term for term in rest if term.element.slot == slot and passes_on(term.element)]
    now = sum(model.terms.index(term) < model.terms.index(moving) for term in chain)
    for place in range(len(chain) + 1):
        if place == now:
            continue
        at = rest.index(chain[place]) if place < len(chain) else len(rest)
        yield replace(model, terms=(*rest[:at], moving, *rest[at:]))


def passes_on(element: Element) -> bool:
    """Whether an element is a link of its slot's chain. Delays are not, because they commute; controllers are not, either."""
    return element.slot in CHAINS and element.kernel is not None and element.acts == Element.acts
