"""By how much later than its stamp a controller's reference acts, where the effort is made from it and the controller's gains."""

import numpy as np

from rhythmid.errors import InputError
from rhythmid.identify.inverse_dynamics.estimate import fit_effort
from rhythmid.identify.joints.joint_motion import JointBalances

LONGEST = 0.1  # [s] in which a reference acts at the latest
COARSE = 2.0  # samples between the delays that are tried first
STEPS = 3  # of a fit at each of them: the parameters are nearly linear


def reference_delay(balances: JointBalances, joint: str) -> float:
    """The delay [s] at which the joint's path, its free parameters fitted, predicts the effort best; to a tenth of a sample.

    What a missing effect does like a delay, such as a lag, is in it. Raises InputError where too little of motion was recorded.
    """
    model, period = balances.models[joint], balances.period

    def cost(late: float) -> float:
        return fit_effort(balances.balance(joint, late), model, steps=STEPS).error

    tried = np.arange(0.0, LONGEST, COARSE * period)
    errors = [cost(float(late)) for late in tried]
    if not np.isfinite(errors).all():
        raise InputError(f"the joint {joint!r} cannot be fitted: its motion holds too little")
    best = int(np.argmin(errors))
    low, high = tried[max(best - 1, 0)], tried[min(best + 1, len(tried) - 1)]
    while high - low > 0.1 * period:  # golden section (J. Kiefer, Proc. AMS 4 (1953) 502)
        span = 0.381966 * (high - low)
        first, second = low + span, high - span
        low, high = (low, second) if cost(float(first)) < cost(float(second)) else (first, high)
    return float(0.5 * (low + high))
