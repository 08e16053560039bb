"""Joints whose efforts the body of the file hardly fits, whatever else is named there."""

from collections.abc import Iterator, Mapping

from rhythmid.diagnose.answer.result import Diagnosis, FitQuality
from rhythmid.diagnose.constants import BLIND, HOPELESS


def misfits(answers: Mapping[str, Diagnosis]) -> Iterator[str]:
    """What to check, in one sentence for each joint at which the refitted nominal model predicts the effort hardly better than nothing does,
    and the named effects leave more of it than an identified model does."""
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
    """Error of the effort as a share of it, on held-out data where there are any."""
    return quality.train_nrmse if quality.heldout_nrmse is None else quality.heldout_nrmse
