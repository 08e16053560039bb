"""Whether records can come from one machine and be in the same units."""

import math
from collections.abc import Sequence

import numpy as np

from rhythmid.errors import InputError
from rhythmid.identify.series import Series


def check_comparable(series: Sequence[Series]) -> None:
    """Raise InputError when records cannot come from one machine in the same units.

    The unit shows in how much the outputs vary, and in how fast they change: a machine moves far less at a high frequency
    than at a low one, but hardly as much more slowly. The levels alone do not show it: multi-turn counters and encoders
    with another zero shift them by any amount, which `record_zeros` estimates.
    """
    spread = [float(np.std(one.averaged)) for one in series]
    level = [float(np.mean(one.averaged)) for one in series]
    pace = [float(np.std(np.diff(one.averaged))) / (one.period * one.block) for one in series]
    for one in series:
        if np.ptp(one.averaged) == 0.0:
            raise InputError(f"{one.name}: the output never changes; nothing can be learnt from it")
    for i, one in enumerate(series):
        for j in range(i):
            decades = [abs(math.log10(max(abs(a), 1e-300) / max(abs(b), 1e-300))) for a, b in
                       ((spread[i], spread[j]), (level[i], level[j]), (pace[i], pace[j]))]  # fmt: skip
            thousand = all(2.5 < one < 3.5 for one in decades[:2]) and decades[2] > 2.0
            far = all(max(one[i], one[j]) > 2000.0 * min(one[i], one[j]) for one in (spread, pace))
            if thousand or far:
                raise InputError(
                    f"{series[j].name} and {one.name} do not look like one machine in one unit (outputs "
                    f"{level[j]:.3g} ± {spread[j]:.3g} and {level[i]:.3g} ± {spread[i]:.3g}); check units and files"
                )
