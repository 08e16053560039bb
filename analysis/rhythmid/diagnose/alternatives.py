"""Explanations other than the search's effects: a wrong fixed value, a longer delay, an effect in another slot.

A wrong fixed mass looks like missing physics. A lag obeys the same law anywhere in the signal path, though the
catalogue may hold it in one slot only. Other elements of a chosen effect's family (other lags, other friction laws)
may explain the same mismatch. Each alternative is fitted and scored like any other hypothesis.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rhythmid.diagnose.constants import LONGEST_DELAY, SERIES
from rhythmid.diagnose.free_functions import values_of
from rhythmid.diagnose.free_map import FREE_MAPS, first_guess
from rhythmid.diagnose.hypothesis import Kind
from rhythmid.diagnose.search.order import CHAINS, passes_on
from rhythmid.diagnose.search.refit import run_trials
from rhythmid.diagnose.search.round import Round
from rhythmid.diagnose.search.score_tests import Score, Trajectories
from rhythmid.diagnose.search.trial import Origin, Proposal, Trial, propose
from rhythmid.diagnose.static_law import laws_of
from rhythmid.elements.catalogue import Catalogue
from rhythmid.elements.element import Element, Scales, Slot
from rhythmid.identify.noise import NoiseModel
from rhythmid.identify.record_scales import scales
from rhythmid.identify.series import Series, dominant_frequency
from rhythmid.model import Model, Term
from rhythmid.progress import Tell, silent
from rhythmid.simulation.right_hand_side import DRIVES
from rhythmid.simulation.transport import INPUT_DELAY

Array = NDArray[np.float64]
CLOCKS: tuple[Slot, ...] = ("command", "timing")  # slots for a delay that may drift
LONGER = (2.0, 5.0, 12.0, 30.0)  # [samples] first guesses of a longer delay


def alternatives(
    nominal: Trial,
    chosen: Trial,
    series: Sequence[Series],
    catalogue: Catalogue,
    noise: NoiseModel,
    step: float,
    known: Trajectories,
    rounds: Sequence[Round],
    weighed: Sequence[Trial],
    reach: float = math.inf,
    tell: Tell = silent,
) -> list[tuple[Trial, Kind]]:
    """Fit models of other kinds: alternatives to the nominal model and replacements for the chosen effects.

    `known` is the run of the chosen model, `rounds` are the search's scores, and `weighed` are the models that are
    hypotheses already. A trial whose chi2 would not reach `reach` is not carried to convergence.
    """
    sizes = scales(series, chosen.model)
    freed: list[Proposal] = list(_freed(nominal))
    moved: list[Proposal] = []
    kin: list[Proposal] = []
    for label in chosen.added:
        beside = chosen.without(label)
        if beside.added:
            freed += _freed(beside)
        term = chosen.model.term(label)
        assert term is not None
        kin += _kin(beside, term, rounds, weighed)
        for place in _free_places(term.element, catalogue):
            if not (place == "command" and series[0].kind not in DRIVES):
                moved.append(_moved(beside, term, place))
    made: dict[Kind, list[Proposal]] = {
        "freed_value": freed,
        "delay": list(_longer_delay(nominal, series)),
        "location": moved,
        "free_map": list(_one_law(chosen, known, sizes)),
        "effects": [*kin, *_reduced(chosen, weighed)],
    }
    kept: dict[tuple[str, ...], tuple[Proposal, Kind]] = {
        one.key: (one, kind) for kind, group in made.items() for one in group
    }
    known_keys = {trial.key for trial in weighed}
    given = [one for one, _ in kept.values() if one.key not in known_keys]
    if not given:
        return []
    trials, _ = run_trials(given, series, Origin.of(chosen), noise, step, reach=reach, tell=tell)
    return [(trial, kept[trial.key][1]) for trial in trials]


def _reduced(chosen: Trial, weighed: Sequence[Trial]) -> Iterator[Proposal]:
    """Models that fit better than the chosen one, with each of their effects removed in turn.

    One effect may carry the whole gain, but the fit may have found its deepest minimum only beside another effect.
    """
    known = {trial.key for trial in weighed}
    for trial in weighed:
        if len(trial.added) < 2 or trial.chi2 >= chosen.chi2:
            continue
        for label in trial.added:
            slim = trial.without(label)
            if slim.added and slim.key not in known:
                known.add(slim.key)
                yield Proposal(slim.added, slim.model)


def _kin(base: Trial, term: Term, rounds: Sequence[Round], weighed: Sequence[Trial]) -> Iterator[Proposal]:
    """The base model with elements related to that of `term` in its place: of its family, or declared to be confusable with it.

    Only elements that scored in some round, that are no hypothesis yet and that need nothing that the base model lacks are
    proposed. The first guesses include the fitted values of the other related elements, and those of the element alone:
    it may need other values of the model's own parameters. A spring, for example, contains a pendulum's gravity.
    """
    scored: dict[str, list[Score]] = {}
    for one in sorted((s for r in rounds for s in (*r.scores, *r.local)), key=lambda s: -s.statistic):
        if one.statistic > 0.0 and _related(one.element, term.element):
            scored.setdefault(one.element.name, []).append(one)
    places = {
        label: trial
        for trial in weighed
        for label in trial.added
        if sorted(trial.added) == sorted((*base.added, label)) and trial.model.term(label) is not None
    }
    there = {other.element.name for other in base.model.terms} | set(places) | {term.element.name}
    for name, scores in scored.items():
        element = scores[0].element
        if name in there or base.model.lacking(element) is not None:
            continue
        made = propose(base.model, element, [one.start for one in scores[:2]], base.added)
        own = made.added[-1]
        known_ends = [
            (label, trial) for label, trial in places.items() if _related(trial.element(label), element)
        ]
        known_ends += [(trial.added[0], trial) for trial in weighed if trial.names == (name,)]
        ends = [
            {_renamed(key, label, own): value.value for key, value in trial.model.parameters.items()}
            for label, trial in known_ends
        ]
        known = set(made.model.parameters)
        nearer = tuple({key: value for key, value in end.items() if key in known} for end in ends)
        yield replace(made, guesses=(*made.guesses, *nearer))


def _related(one: Element, other: Element) -> bool:
    """Whether two elements are of one family, or one is declared to be confusable with the other."""
    same = one.family == other.family != ""
    return same or one.name in other.confusable or other.name in one.confusable


def _renamed(parameter: str, label: str, own: str) -> str:
    """A parameter's name with the label of its effect replaced by `own`."""
    term, _, name = parameter.rpartition(".")
    return f"{own}.{name}" if term == label else parameter


def _freed(base: Trial) -> Iterator[Proposal]:
    for name in fixed_values(base.model, base.added):
        freed = base.model.with_parameters({name: replace(base.model.parameters[name], fixed=False)})
        yield Proposal((*base.added, name), freed)


def fixed_values(model: Model, effects: Sequence[str] = ()) -> list[str]:
    """Nonzero parameters that the author of the nominal model has fixed, and that are not fixed by their nature."""
    names = (name for name in model.held if model.value(name) != 0.0)
    return [name for name in names if name.rpartition(".")[0] not in effects]


def _longer_delay(base: Trial, series: Sequence[Series]) -> Iterator[Proposal]:
    """The model with its input delay freed from the prior and the bounds of a nuisance delay."""
    delay = base.model.parameters.get(INPUT_DELAY)
    if delay is None or delay.prior is None:
        return
    period = max(one.period for one in series)
    most = LONGEST_DELAY / max(dominant_frequency(one) for one in series)
    free = base.model.with_parameters(
        {INPUT_DELAY: replace(delay, value=0.0, prior=None, bounds=(delay.bounds[0], most))}
    )
    guesses = tuple({INPUT_DELAY: n * period} for n in LONGER if n * period < most)
    if guesses:
        yield Proposal((*base.added, INPUT_DELAY), free, guesses)


def _one_law(chosen: Trial, known: Trajectories, sizes: Scales) -> Iterator[Proposal]:
    """The chosen model with one free map instead of several effects that are laws of the same quantity."""
    for (slot, quantity), laws in laws_of(chosen, sizes).items():
        name = {"actuator": "effort", "sensor": "signal"}.get(slot, quantity)
        if len(laws) < SERIES or name not in FREE_MAPS:
            continue
        base = chosen.without(*laws)
        guess = first_guess(np.concatenate(values_of(known, name)))
        yield propose(base.model, FREE_MAPS[name], [guess], base.added)


def _free_places(element: Element, catalogue: Catalogue) -> Iterator[Slot]:
    """Other slots in which the element makes sense and for which the catalogue has no element of its family."""
    for place in _places(element):
        there = [one for one in catalogue.values() if one.slot == place and one.candidate]
        if place != element.slot and element.family not in {one.family for one in there if one.family}:
            yield place


def _places(element: Element) -> tuple[Slot, ...]:
    """Slots in which the element's law makes sense, its own among them.

    Only laws whose parameters are times or rates of time, and not sizes, have the same parameters in every slot.
    """
    units = {parameter.unit for parameter in element.parameters}
    if element.delay is not None and units == {"1"}:
        return CLOCKS
    plain = not element.memories and not element.history
    if plain and passes_on(element) and units == {"s"}:
        return CHAINS
    return ()


def moved_name(name: str, place: Slot) -> str:
    """Name of an element's law in a slot other than its own."""
    return f"{name}_of_the_{place}"


def _moved(base: Trial, term: Term, place: Slot) -> Proposal:
    """The model with one of its effects moved to another slot."""
    measured = place == "sensor"
    element = replace(
        term.element,
        name=moved_name(term.element.name, place),
        slot=place,
        initial=lambda x, v, f, **_: (x if measured else f,) * len(term.element.own),
    )
    values = term.numbers
    return propose(base.model, element, [values], base.added)
