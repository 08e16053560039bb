"""Elsewhere: whether an effect on a signal does as well in another place of the path, where the catalogue has nothing like it.

A lag is one law, whether the command, the actuator or the sensor has it, and so is a drift of a delay, the command's or the
measurement's; what it does to a recording differs by little. Where the catalogue lacks it in one place, the one that it has
in another stands in for it, down to the noise nearly.
"""

from collections.abc import Iterator
from dataclasses import replace

from rhythmid.diagnose.search.forward import WORTH, Search
from rhythmid.diagnose.search.refit import Proposal, propose, run_trials
from rhythmid.elements.catalogue import Catalogue
from rhythmid.elements.element import Element, Slot
from rhythmid.model import Term
from rhythmid.simulation.compiled import compile_model
from rhythmid.simulation.generated_source import DRIVES

PLACES: dict[Slot, str] = {
    "command": "in the command path",
    "actuator": "in the actuator",
    "sensor": "between the mass and the measurement",
    "timing": "in the measurement's time",
}
SIGNALS: tuple[Slot, ...] = ("command", "actuator", "sensor")  # what a law with times acts on
CLOCKS: tuple[Slot, ...] = ("command", "timing")  # what has a delay that may drift


def elsewhere(found: Search, catalogue: Catalogue) -> list[str]:
    """A sentence about each chosen effect that explains the records as well in another place.

    Only effects that have the same parameters in every place can be moved: those that know times or rates of them, but no sizes.
    """
    series = found.fit.run.series
    tied = series[0].observer is not None  # which takes the measurement for the motion
    known = compile_model(found.best.model).layout.states
    said: list[str] = []
    for label in found.best.added:
        term = found.best.model.term(label)
        assert term is not None
        moved = [
            proposal
            for place in _free_places(term.element, catalogue)
            if not (tied and place == "sensor") and not (place == "command" and series[0].kind not in DRIVES)
            for proposal in _moved(found, term, place)
        ]
        if not moved:
            continue
        trials, _ = run_trials(moved, series, found.best.starts, known, found.noise, found.fit.run.max_step)
        if trials and trials[0].bic() < found.best.bic() + WORTH:
            place = trials[0].element(trials[0].added[-1]).slot
            said.append(
                f"what {term.element.name.replace('_', ' ')} does explains the records as well {PLACES[place]}, "
                "where the catalogue has nothing like it"
            )
    return said


def _free_places(element: Element, catalogue: Catalogue) -> Iterator[Slot]:
    """Other places where the element would make sense, and where the catalogue has none of its family."""
    for place in _places(element):
        there = [one for one in catalogue.values() if one.slot == place and one.candidate]
        if place != element.slot and element.family not in {one.family for one in there if one.family}:
            yield place


def _places(element: Element) -> tuple[Slot, ...]:
    """Places where the law of the element would make sense, its own among them."""
    units = {parameter.unit for parameter in element.parameters}
    if element.delay is not None and units == {"1"}:
        return CLOCKS
    plain = element.kernel is not None and element.acts == Element.acts and not element.memories
    if plain and element.slot in SIGNALS and units == {"s"}:
        return SIGNALS
    return ()


def _moved(found: Search, term: Term, place: Slot) -> Iterator[Proposal]:
    """The chosen model with one of its effects in another place; and without any one of the others, that may only have made
    up for the wrong place."""
    measured = place == "sensor"
    element = replace(
        term.element,
        name=f"{term.element.name}_of_the_{place}",
        slot=place,
        initial=lambda x, v, f, **_: (x if measured else f,) * len(term.element.own),
    )
    values = {name: value.value for name, value in term.values.items()}
    others = [label for label in found.best.added if label != term.label]
    for idle in (None, *others):
        rest = tuple(label for label in others if label != idle)
        base = found.best.model.without(term.label)
        base = base if idle is None else base.without(idle)
        yield propose(base, element, [values], rest)
