"""Linear restoring force: a structure to refit wherever nothing in a model brings the position back.

No score test shows it there. A score is linear in the missing effect, along the motion of the model without it. A force that depends on
the position decides whether that position wanders at all: along a run that wanders, even the sign of the score is arbitrary.
"""

from collections.abc import Iterator

import numpy as np

from rhythmid.diagnose.search.trial import Proposal, propose
from rhythmid.elements.catalogue import Catalogue
from rhythmid.identify.output_error import Fit
from rhythmid.identify.record_scales import scales

SPRING = "linear_spring"
SHIFT = 1e-2  # share of the motion by which the position is shifted
# share of that shift's change of speed on a spring that holds the mass in the dominant motion, below which nothing restores it
HELD = 1e-3
STIFFNESSES = (1.0, 0.2, 0.05)  # first guesses, as shares of the inertia's own stiffness m ω²


def restoring_force(fit: Fit, catalogue: Catalogue, added: tuple[str, ...]) -> Iterator[Proposal]:
    """The fitted model with a linear spring, if the catalogue holds one, nothing restores the position, and the motion comes back.

    `added` are the labels of the effects that the model has beyond the nominal one.
    """
    if SPRING not in catalogue or not fit.run.series:
        return
    sizes = scales(fit.run.series, fit.model)
    if not sizes.comes_back or is_restored(fit):
        return
    guesses = [{"stiffness": share * sizes.stiffness, "rest_length": sizes.centre} for share in STIFFNESSES]
    yield propose(fit.model, catalogue[SPRING], guesses, added, fit.chi2)


def is_restored(fit: Fit) -> bool:
    """Whether a shift of the position changes the speed of the fitted model along any of its series."""
    sizes = scales(fit.run.series, fit.model)
    shift = SHIFT * sizes.position
    usual = shift * (sizes.stiffness / sizes.mass) ** 0.5
    for index, start in enumerate(fit.starts):
        moved = start.copy()
        moved[0] += shift
        before, after = (fit.run.rows(fit.model, index, one) for one in (start, moved))
        if before is None or after is None:
            return True  # it is unstable: the score tests decide
        if float(np.abs(after[:, 1] - before[:, 1]).max()) > HELD * usual:
            return True
    return False
