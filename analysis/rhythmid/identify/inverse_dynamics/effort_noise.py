"""Noise of the recorded effort, beside that of the measured motion.

A free run is driven by the recorded effort. Noise of this effort is then an error of the input: the run responds to it, the machine does not, and
damping or friction of the model is biased towards what suppresses the response (errors in variables; T. Söderström, Automatica 43 (2007)
939). Where the effort is predicted from the motion, the same noise is an error of the output and biases nothing. The noise of the motion is
an error of the output in a free run only. So the larger of the two decides how to score.
"""

from collections.abc import Sequence

import numpy as np
from scipy.signal import welch

from rhythmid.identify.inverse_dynamics.balance import Balance
from rhythmid.identify.inverse_dynamics.bandwidth import ABOVE, SEGMENTS, noise_floor
from rhythmid.identify.inverse_dynamics.motion import effort_channel
from rhythmid.identify.inverse_dynamics.motion_noise import noise_power
from rhythmid.model import Model
from rhythmid.record.record import Channel, Record
from rhythmid.record.timing import nominal_period


def effort_is_noisier(balance: Balance, records: Sequence[Record], model: Model) -> bool:
    """Whether the noise of the recorded effort is clearly above that of the measured motion, both in the effort's unit and band.

    The noise of the effort is its white floor, but no more than what the motion leaves unexplained: an excitation that is itself
    white is no noise, because it moves the machine. Where much more than the floor is unexplained, noise is not the cause, and the
    answer is False.

    Parameters
    ----------
    balance, records : the balance, and the records from which it was made.
    model : a model that was fitted to the balance.
    """
    unexplained = balance.bandwidth.unexplained
    recorded = [channel for one in records if (channel := effort_channel(one, model)) is not None]
    floor = balance.bandwidth.effort * float(np.mean([_floor(channel) for channel in recorded]))
    if unexplained > ABOVE * floor:
        return False
    return min(floor, unexplained) > ABOVE * noise_power(balance, records, model)


def _floor(channel: Channel) -> float:
    """Floor of the channel's power spectral density [unit^2/Hz]."""
    rate = 1.0 / nominal_period(np.diff(channel.time))
    _, power = welch(
        channel.value, rate, nperseg=max(min(len(channel.value), 64), len(channel.value) // SEGMENTS)
    )
    return noise_floor(power)
