"""Noise of the measured motion in the effort that a model requires.

Derivatives amplify the noise of a measured position, so that the required effort contains noise of its own. A free function of
the same noisy motion predicts part of it, as regression on noisy quantities is biased towards their mean (R. J. Carroll et al.,
Measurement Error in Nonlinear Models, 2006, ch. 3). What such a function explains is evidence only beyond this noise.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rhythmid.identify.inverse_dynamics.balance import Balance
from rhythmid.identify.inverse_dynamics.bandwidth import QUARTER, noise_of_output
from rhythmid.identify.inverse_dynamics.motion import motion_of, stretches
from rhythmid.model import Model
from rhythmid.record.record import Record

Array = NDArray[np.float64]


def noise_power(balance: Balance, records: Sequence[Record], model: Model) -> float:
    """Mean square of the noise in the effort that a model requires at the rows of a balance.

    The required effort is computed again with as much noise added to the measured output as it contains: white noise of the spectrum's
    floor. The change is one draw of the noise.

    Parameters
    ----------
    balance, records : the balance, and the records from which it was made.
    model : the fitted model.
    """
    chosen, rng = balance.bandwidth, np.random.default_rng(0)
    raw = stretches(records, model, QUARTER / chosen.effort)
    noisy = [
        replace(one, output=one.output + rng.normal(0.0, noise_of_output(one), len(one.output)))
        for one in raw
    ]
    motions = tuple(motion_of(one, model, chosen.motion, chosen.low) for one in noisy)
    again = replace(balance, motions=motions, _forces={}, _sensitive={})
    return float(np.mean((_error(again, model) - _error(balance, model)) ** 2))


def _error(balance: Balance, model: Model) -> Array:
    """Required less given effort (rows,); the effort of a machine that is driven by its base is computed from the motion, too."""
    return balance.predicted(model) - balance.rows([motion.effort for motion in balance.motions])
