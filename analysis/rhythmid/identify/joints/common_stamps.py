"""The alignment of effort and motion at joints whose efforts were recorded together.

One recorder stamps the efforts and positions of all joints, so that none is misaligned by more than the others are. A lag or a delay at one joint
would otherwise be taken for a misalignment of up to two samples.
"""

import math
from dataclasses import replace

from threadpoolctl import threadpool_limits

from rhythmid.errors import InputError
from rhythmid.identify.inverse_dynamics.estimate import ALIGNED, ROUGH, fit_effort
from rhythmid.identify.joints.joint_motion import JointBalances


@threadpool_limits.wrap(limits=1)
def with_common_stamps(balances: JointBalances) -> JointBalances:
    """The balances in which the alignment of a joint has as standard deviation the largest one that another joint shows, at most a sample.

    Another joint that lacks something may show a large one; then nothing is known of this joint.
    """
    shown: dict[str, float] = {}
    for joint, model in balances.models.items():
        if joint in balances.computed:
            continue
        try:
            fit = fit_effort(balances.balance(joint), model)
        except InputError:
            continue  # too little motion
        shown[joint] = math.hypot(fit.alignment, float(fit.std[0]), ROUGH * balances.period)
    known = {
        joint: min(max(others), ALIGNED * balances.period)
        for joint in shown
        if (others := [size for other, size in shown.items() if other != joint])
    }
    return replace(balances, aligned=known)
