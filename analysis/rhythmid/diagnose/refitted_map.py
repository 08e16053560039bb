"""A free map refitted beside the nominal model: what one unknown law of one quantity would predict.

The maps of location.py are changes to first order at a fit. Where what is missing is large, or where names have bent the model's
own parameters in order to stand in for it, they understate what another law would predict. The map of the quantity on which the
nominal model's residual depends most is therefore fitted like any other model. What it predicts is a measure of what the names
leave; it is no name itself.
"""

from collections.abc import Sequence

import numpy as np

from rhythmid.diagnose.contenders import Contender, Rows, contend
from rhythmid.diagnose.free_functions import SPLINED, values_of
from rhythmid.diagnose.free_map import FREE_MAPS, first_guess
from rhythmid.diagnose.location import Dependence
from rhythmid.diagnose.search.refit import run_trials
from rhythmid.diagnose.search.score_tests import Trajectories
from rhythmid.diagnose.search.trial import Origin, Trial, propose
from rhythmid.identify.series import Series


def refitted_map(
    nominal: Trial,
    before: Sequence[Dependence],
    known: Trajectories,
    series: Sequence[Series],
    rows: Rows,
    step: float,
) -> tuple[str, Contender] | None:
    """The free map on whose quantity the nominal model's residual depends most, fitted beside it; and that quantity.

    `before` are the dependences at the nominal fit, `known` is its run. None where no free function of one quantity predicts
    anything, or the model diverges with it.
    """
    best = max(
        (one for one in before if one.quantity in SPLINED), key=lambda one: one.explained, default=None
    )
    if best is None or best.explained <= 0.0:
        return None
    name = SPLINED[best.quantity]
    proposal = propose(
        nominal.model, FREE_MAPS[name], [first_guess(np.concatenate(values_of(known, name)))], nominal.added
    )
    trials, _ = run_trials([proposal], series, Origin.of(nominal), rows.noise, step)
    made = contend([(trial, "free_map") for trial in trials], series, rows, step)
    return (best.quantity, made[0]) if made else None
