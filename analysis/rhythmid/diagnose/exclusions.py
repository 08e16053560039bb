"""Candidates that could not even be scored because the simulation blows up with them: said, not passed over."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np

from rhythmid.diagnose.search.forward import Search
from rhythmid.diagnose.search.score_tests import change_of_output, guesses, sizes_along, trajectories
from rhythmid.elements.catalogue import Catalogue


def unscored(found: Search, catalogue: Catalogue, pool: ThreadPoolExecutor | None = None) -> list[str]:
    """A sentence about each element of the catalogue that makes the simulation diverge whatever its size."""
    fit = found.nominal
    scored = {score.element.name for score in found.rounds[0].scores}
    known = trajectories(fit)
    left = [case for case in guesses(catalogue, fit.model, sizes_along(known)) if case[0].name not in scored]
    if not left:
        return []

    def diverges(case) -> bool:
        with np.errstate(all="ignore"):
            outputs = change_of_output(known, *case)
        return outputs is None or not all(np.isfinite(one).all() for one in outputs)

    results = list(pool.map(diverges, left)) if pool else [diverges(case) for case in left]
    names = dict.fromkeys(element.name for element, _ in left)
    return [
        f"{name}: the simulation diverges with it from every first guess"
        for name in names
        if all(result for (element, _), result in zip(left, results) if element.name == name)
    ]
