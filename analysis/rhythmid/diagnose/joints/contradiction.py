"""Whether the joints that feel a link's value contradict it, with as few searches as decide this.

A joint whose effort contradicts the value with the effects that are known there may lack an effect beside it, which only a search with the
value shows. The joint that contradicts it most is searched first. As soon as the joints that were searched outweigh those that agree, the
value is refuted, even if all others could be reconciled with it; their results are kept.
"""

from collections.abc import Callable, Mapping, Sequence

from rhythmid.diagnose.joints.joint_case import JointResult
from rhythmid.diagnose.joints.link_evidence import weight_of_joints, weight_of_values
from rhythmid.diagnose.rejections import decisive
from rhythmid.identify.joints.joint_motion import JointBalances

Searched = tuple[dict[str, JointResult], dict[str, str]]


def contradicted(
    found: Mapping[str, JointResult],
    before: JointBalances,
    after: JointBalances,
    joints: Sequence[str],
    search: Callable[..., Searched],
) -> tuple[bool, Searched]:
    """Whether the joints refute the value of a link with which `after` was made, and the results of those that were searched with it.

    Parameters
    ----------
    found : results of the joints with the values of `before`.
    joints : those that feel the link.
    search : searches a list of joints with the value, while a number of others are `waiting` for the time that is left.
    """
    weight = {joint: weight_of_values(found, before, after, [joint]) for joint in joints if joint in found}
    better: dict[str, JointResult] = {}
    refused: dict[str, str] = {}
    doubted = sorted((joint for joint in weight if weight[joint] < 0.0), key=lambda joint: weight[joint])
    told = sum(one for one in weight.values() if one >= 0.0)
    for place, joint in enumerate(doubted):
        now, why = search([joint], waiting=len(joints) - place - 1)
        better, refused = {**better, **now}, {**refused, **why}
        told += weight_of_joints(found, now, [joint])
        if told < -decisive(1):
            return True, (better, refused)
    return False, (better, refused)
