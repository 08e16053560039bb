"""Parts of a law that a refit has driven to the end of its range, as a structure of its own to refit.

A law that is the sum of others within a range leaves their ratio beyond it. A friction that differs by direction is a friction and a
constant force, while that force is the smaller one. Where it is the larger one the law ends where it acts in one direction only.
"""

import math
from collections.abc import Iterator, Sequence

from rhythmid.diagnose.constants import EDGE
from rhythmid.diagnose.search.round import Round
from rhythmid.diagnose.search.score_tests import Score
from rhythmid.diagnose.search.trial import Proposal, Trial, propose
from rhythmid.model import Term


def in_parts(here: Trial, now: Round, found: Sequence[Trial]) -> Iterator[Proposal]:
    """The model with the parts of each law that was found at the end of its range in its place, from their sizes there.

    Only laws of which the round has scored all parts: the others are in the model, or do the same as one of its parameters.
    """
    scored: dict[str, Score] = {}
    for one in now.scores:
        scored.setdefault(one.element.name, one)
    for trial in found:
        term = trial.model.term(trial.added[-1])
        if term is None or not _ends(term) or any(name not in scored for name in term.element.beyond):
            continue
        sizes = dict(term.element.moving_as(**term.numbers)) if term.element.moving_as else {}
        own = {name: trial.model.value(name) for name in here.model.free}
        model, added, made = here.model, now.added, None
        for name in term.element.beyond:
            made = propose(
                model, scored[name].element, [_guess(scored[name], term, sizes)], added, here.chi2, [own]
            )
            model, added = made.model, made.added
        if made is not None:
            yield made


def _guess(one: Score, term: Term, sizes: dict[str, float]) -> dict[str, float]:
    """A part's first guess: what it has in common with the law, as fitted, and its own size there."""
    element = one.element
    shared = {p.name: term.numbers[p.name] for p in element.parameters if p.name in term.numbers}
    size = {element.size: sizes[element.name]} if element.name in sizes else {}
    return {**one.start, **shared, **size}


def _ends(term: Term) -> bool:
    """Whether a parameter of a law that has parts is at one of the two ends of its range."""
    ranges = {p.name: p.bounds for p in term.element.parameters if all(map(math.isfinite, p.bounds))}
    return bool(term.element.beyond) and any(
        min(abs(term.numbers[name] - end) for end in ends) <= EDGE * (ends[1] - ends[0])
        for name, ends in ranges.items()
    )
