"""Other kinds of explanation beside the search's effects: a wrong fixed value, a longer delay, an effect in another place.

A mass that is given wrongly is missed like physics, and a lag is one law wherever in the path it sits, though the catalogue may
have it in one place only. Kin of a chosen effect (the other lags, the other laws of friction) explain the same by other means.
Each is a hypothesis like any other, fitted and scored in the same way.
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
from rhythmid.model import INERTIA, Model, Term
from rhythmid.progress import Tell, silent
from rhythmid.simulation.generated_source import DRIVES
from rhythmid.simulation.transport import INPUT_DELAY

Array = NDArray[np.float64]
SIGNALS: tuple[Slot, ...] = ("command", "actuator", "sensor")  # what a law with times acts on
CLOCKS: tuple[Slot, ...] = ("command", "timing")  # what has a delay that may drift
LONGER = (2.0, 5.0, 12.0, 30.0)  # samples, at which a longer delay is sought


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
    """Fitted trials of other kinds, for the nominal model and in the place of the chosen effects.

    `known` is the chosen run, `rounds` are the search's scores, and `weighed` the models that are hypotheses already. One whose chi2 would not
    come to `reach` is not carried to convergence.
    """
    sizes = scales(series, chosen.model)
    freed: list[Proposal] = list(_freed(nominal))
    moved: list[Proposal] = []
    kin: list[Proposal] = []
    for label in chosen.added:
        beside = _base(chosen, tuple(name for name in chosen.added if name != label))
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
        tuple(sorted(one.added)): (one, kind) for kind, group in made.items() for one in group
    }
    if not kept:
        return []
    given = [one for one, _ in kept.values()]
    trials, _ = run_trials(given, series, Origin.of(chosen), noise, step, reach=reach, tell=tell)
    return [(trial, kept[tuple(sorted(trial.added))][1]) for trial in trials]


def _reduced(chosen: Trial, weighed: Sequence[Trial]) -> Iterator[Proposal]:
    """Models that fit better than the chosen one, without each of their effects in turn: one effect may carry all the gain, and
    have found its deepest minimum only beside another."""
    known = {tuple(sorted(trial.added)) for trial in weighed}
    for trial in weighed:
        if len(trial.added) < 2 or trial.chi2 >= chosen.chi2:
            continue
        for label in trial.added:
            slim = trial.model.pruned(label)
            rest = tuple(name for name in trial.added if slim.term(name) is not None)
            if rest and tuple(sorted(rest)) not in known:
                known.add(tuple(sorted(rest)))
                yield Proposal(rest, slim, ({},))


def _kin(base: Trial, term: Term, rounds: Sequence[Round], weighed: Sequence[Trial]) -> Iterator[Proposal]:
    """The model with another element of the same family in the place of an effect, as far as one has scored in any round and
    is no hypothesis yet; beginning where the family's other members have ended, too."""
    family = term.element.family
    scored: dict[str, list[Score]] = {}
    for one in sorted((s for r in rounds for s in (*r.scores, *r.local)), key=lambda s: -s.statistic):
        if one.statistic > 0.0 and one.element.family == family != "":
            scored.setdefault(one.element.name, []).append(one)
    places = {
        label: trial
        for trial in weighed
        for label in trial.added
        if sorted(trial.added) == sorted((*base.added, label)) and trial.model.term(label) is not None
    }
    there = {other.element.name for other in base.model.terms} | set(places) | {term.element.name}
    for name, scores in scored.items():
        if name in there:
            continue
        made = propose(base.model, scores[0].element, [one.start for one in scores[:2]], base.added)
        own = made.added[-1]
        ends = [
            {_renamed(key, label, own): value.value for key, value in trial.model.parameters.items()}
            for label, trial in places.items()
            if trial.element(label).family == family
        ]
        known = set(made.model.parameters)
        nearer = tuple({key: value for key, value in end.items() if key in known} for end in ends)
        yield replace(made, guesses=(*made.guesses, *nearer))


def _renamed(parameter: str, label: str, own: str) -> str:
    """A parameter's name with another label in the place of an effect's."""
    term, _, name = parameter.rpartition(".")
    return f"{own}.{name}" if term == label else parameter


def _base(chosen: Trial, rest: tuple[str, ...]) -> Trial:
    """The chosen trial with only these of its effects, and of them those that need no other one, as a place to start from."""
    model = chosen.model
    for label in chosen.added:
        if label not in rest:
            model = model.pruned(label)
    return replace(chosen, added=tuple(label for label in rest if model.term(label) is not None), model=model)


def _freed(base: Trial) -> Iterator[Proposal]:
    for name in fixed_values(base.model, base.added):
        freed = base.model.with_parameters({name: replace(base.model.parameters[name], fixed=False)})
        yield Proposal((*base.added, name), freed, ({},))


def fixed_values(model: Model, effects: Sequence[str] = ()) -> list[str]:
    """Parameters of the nominal model that are held fixed because its author says so, not by their nature, and are not zero."""
    names = [INERTIA] if model.mass.fixed else []
    for term in model.terms:
        for key, value in term.values.items():
            if value.fixed and value.value != 0.0 and not term.element.parameter(key).fixed:
                names.append(f"{term.label}.{key}")
    return [name for name in names if name.rpartition(".")[0] not in effects]


def _longer_delay(base: Trial, series: Sequence[Series]) -> Iterator[Proposal]:
    """The model with its input's delay no longer held near the sample that a nuisance may take."""
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
    """The chosen model with a free map in the place of several effects that are laws of the same quantity."""
    for (slot, quantity), laws in laws_of(chosen, sizes).items():
        name = {"actuator": "effort", "sensor": "signal"}.get(slot, quantity)
        if len(laws) < SERIES or name not in FREE_MAPS:
            continue
        base = _base(chosen, tuple(label for label in chosen.added if label not in laws))
        guess = first_guess(np.concatenate(values_of(known, name)))
        yield propose(base.model, FREE_MAPS[name], [guess], base.added)


def _free_places(element: Element, catalogue: Catalogue) -> Iterator[Slot]:
    """Other places where the element would make sense, and where the catalogue has none of its family."""
    for place in _places(element):
        there = [one for one in catalogue.values() if one.slot == place and one.candidate]
        if place != element.slot and element.family not in {one.family for one in there if one.family}:
            yield place


def _places(element: Element) -> tuple[Slot, ...]:
    """Places where the law of the element would make sense, its own among them: only effects that know times or rates of them
    but no sizes have the same parameters in every place."""
    units = {parameter.unit for parameter in element.parameters}
    if element.delay is not None and units == {"1"}:
        return CLOCKS
    plain = (
        element.kernel is not None
        and element.acts == Element.acts
        and not element.memories
        and not element.history
    )
    if plain and element.slot in SIGNALS and units == {"s"}:
        return SIGNALS
    return ()


def moved_name(name: str, place: Slot) -> str:
    """What the law of an element is called in another place than its own."""
    return f"{name}_of_the_{place}"


def _moved(base: Trial, term: Term, place: Slot) -> Proposal:
    """The model with one of its effects in another place."""
    measured = place == "sensor"
    element = replace(
        term.element,
        name=moved_name(term.element.name, place),
        slot=place,
        initial=lambda x, v, f, **_: (x if measured else f,) * len(term.element.own),
    )
    values = term.numbers
    return propose(base.model, element, [values], base.added)
