"""Kernel of all first-order lags, of the command, the actuator and the sensor.

A lag shorter than one integration step h is computed with the time constant h and a direct share 1 - time_constant / h,
whose transfer function agrees to first order in frequency. So the effect vanishes exactly without a time constant, grows
smoothly from there, and is stable.
"""


def kernel(signal, t, time_constant, step, lagged):
    relaxation = max(time_constant, step)
    return signal + (time_constant / relaxation) * (lagged - signal), (signal - lagged) / relaxation
