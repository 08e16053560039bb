"""Joints whose efforts the body's file hardly fits, whatever effects are named there."""

from collections.abc import Iterator, Mapping

from rhythmid.diagnose.answer.result import Diagnosis, FitQuality
from rhythmid.diagnose.constants import BLIND, HOPELESS


def misfits(answers: Mapping[str, Diagnosis]) -> Iterator[str]:
    """One sentence on what to check for each joint with a poor fit.

    There the refitted nominal model hardly predicts the effort better than no model does, and the named effects leave more of
    the effort than an identified model leaves.
    """
    for joint, answer in answers.items():
        nominal, named = _error(answer.fit["refitted_nominal"]), _error(answer.fit["augmented"])
        if nominal < HOPELESS or named < BLIND:
            continue
        yield (
            f"{joint}: the refitted nominal model misses {100.0 * nominal:.0f} % of the effort, and {100.0 * named:.0f} % with what was fitted "
            "beside it: the body's file or the channels hardly fit; check that the file's inertias are those about the centres of mass, the "
            "order and the signs of the joints, and the units"
        )


def _error(quality: FitQuality) -> float:
    """Relative error of the effort, on held-out data if there are any."""
    return quality.train_nrmse if quality.heldout_nrmse is None else quality.heldout_nrmse
