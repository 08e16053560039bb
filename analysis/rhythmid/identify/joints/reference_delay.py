"""By how much later than its stamp a controller's reference acts, where the effort is made from it and the controller's gains."""

import math
from collections.abc import Sequence

import numpy as np
from threadpoolctl import threadpool_limits

from rhythmid.errors import InputError
from rhythmid.identify.inverse_dynamics.estimate import fit_effort
from rhythmid.identify.joints.joint_motion import JointBalances

LONGEST_REFERENCE_DELAY = 0.1  # [s] in which a reference acts at the latest
COARSE = 2.0  # samples between the delays that are tried first
STEPS = 2  # of a fit at each of them: the parameters are nearly linear


@threadpool_limits.wrap(limits=1)
def reference_delay(balances: JointBalances, joints: Sequence[str]) -> float:
    """The delay [s] at which the paths of these joints, their free parameters fitted, predict the efforts best; to a tenth of a sample.

    One delay for all: their references come in one message. By one joint alone it could not be told from the rotor's inertia. What a
    missing effect of all joints does like a delay, such as a lag, is in it. Raises InputError where too little of motion was recorded.
    """

    def cost(late: float) -> float:
        fits = [fit_effort(balances.balance(one, late), balances.models[one], steps=STEPS) for one in joints]
        return sum(math.log(max(fit.error, 1e-300)) for fit in fits)

    tried = np.arange(0.0, LONGEST_REFERENCE_DELAY, COARSE * balances.period)
    costs: list[float] = []
    for late in tried:
        costs.append(cost(float(late)))
        if costs[-1] > min(costs) and len(costs) - 1 - int(np.argmin(costs)) >= 2:
            break  # it has risen twice
    if not np.isfinite(costs).all():
        raise InputError("the joints cannot be fitted: their motion holds too little")
    best = int(np.argmin(costs))
    low, high = tried[max(best - 1, 0)], tried[min(best + 1, len(tried) - 1)]
    while high - low > 0.2 * balances.period:  # golden section (J. Kiefer, Proc. AMS 4 (1953) 502)
        span = 0.381966 * (high - low)
        first, second = low + span, high - span
        low, high = (low, second) if cost(float(first)) < cost(float(second)) else (first, high)
    return float(0.5 * (low + high))
