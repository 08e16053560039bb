"""A free map refitted beside the nominal model: the prediction of one unknown law of one quantity.

The maps of location.py are first-order changes at a fit. They understate what another law would predict where the missing effect is
large, or where named effects have biased the model's own parameters to compensate for it. The map of the quantity on which the
nominal model's residual depends most is therefore fitted like any other model. Its prediction measures what the names leave
unexplained; the map itself is not a name.
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
    """Fit the free map of the quantity on which the nominal model's residual depends most.

    Parameters
    ----------
    nominal : the fitted nominal model.
    before : dependences of its residual on each quantity.
    known : its run.
    series, rows, step : the fitted series, the scored rows, and the largest integration step [s].

    Returns the quantity and the fitted model, or None where no free function of one quantity predicts anything or the model
    diverges with it.
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
