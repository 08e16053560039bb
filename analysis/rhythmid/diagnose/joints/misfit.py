"""Joints whose efforts the body's file hardly fits, whatever effects are named there, and efforts that come after the motion."""

from collections.abc import Iterator, Mapping

from rhythmid.body.machine import Machine
from rhythmid.diagnose.answer.result import Diagnosis
from rhythmid.diagnose.constants import BLIND, HOPELESS
from rhythmid.diagnose.joints.joint_case import JointResult
from rhythmid.identify.joints.effort_power import braking_note
from rhythmid.report.quantity import NONE


def misfits(answers: Mapping[str, Diagnosis], braking: Mapping[str, str]) -> Iterator[str]:
    """One sentence on what to check for each joint with a poor fit; `braking` are those about joints whose efforts fall with the speed.

    There the refitted nominal model hardly predicts the effort better than no model does, and the named effects leave more of
    the effort than an identified model leaves.
    """
    for joint, answer in answers.items():
        nominal, named = answer.refitted_nominal.error, answer.augmented.error
        if nominal < HOPELESS or named < BLIND:
            continue
        if joint in braking:
            yield braking[joint]
            continue
        yield (
            f"{joint}: the refitted nominal model misses {100.0 * nominal:.0f} % of the effort, and {100.0 * named:.0f} % with what was fitted "
            "beside it: the body's file or the channels are probably wrong; check that the file's inertias are those about the centres of mass, the "
            "order and the signs of the joints, and the units"
        )


def braking(found: Mapping[str, JointResult], machine: Machine) -> dict[str, str]:
    """What to check at joints whose recorded efforts fall with their speeds, by joint."""
    told = {
        joint: braking_note(
            joint, one.result.search.balance, one.case.nominal, machine.body.joints[joint].rotational
        )
        for joint, one in found.items()
    }
    return {joint: note for joint, note in told.items() if note is not None}


def late_efforts(found: Mapping[str, JointResult]) -> Iterator[str]:
    """One sentence where the efforts of most joints fit best after the motion, beyond the uncertainty of the stamps: no machine moves before it is driven."""
    fits = {joint: one.result.chosen.fit for joint, one in found.items() if not one.by_reference}
    late = [joint for joint, fit in fits.items() if fit.at_limit[0] and fit.alignment < 0.0]
    if len(late) > max(0.5 * len(fits), 1):
        by = min(-1e3 * fits[joint].alignment for joint in late)
        yield (
            f"the efforts of {', '.join(late)} fit best {by:.3g} ms or more after the motion, which is impossible: they were filtered or stamped "
            "late, and this may be what is left there; record them without a filter, or the positions with the same one"
        )


def left_in_words(verdict: str, share: float, significant: bool, error: float | None) -> str:
    """What is left of a joint's mismatch, in words; a dash where there is no mismatch.

    A remainder in which no test finds a cause is noise only where the augmented model's `error` (share of the effort) is that of a model that is
    identified.
    """
    if verdict == "consistent":
        return NONE
    if significant:
        return f"{100.0 * share:.0f} % of the mismatch"
    return "noise" if error is None or error < BLIND else "not explained"
