"""Recursion that propagates small changes of state and force along a trajectory, compiled once.

The text of this function is copied unchanged into its own module.
"""
# pyright: reportMissingParameterType=false, reportUnknownParameterType=false

import numpy as np


def run(maps, direct, force, response):
    """Fill the change (n,) of an output due to a force (n,), linear between its values, and return n.

    `maps` (n - 1, q + 1, q + 2) map, over each interval, the change of the state and the force at both ends to the
    change of the state and of the output; `direct` is the direct effect of the force on the first output.
    """
    count = maps.shape[1] - 1
    state = np.zeros(count)
    following = np.zeros(count)
    response[0] = direct * force[0]
    for k in range(maps.shape[0]):
        for i in range(count + 1):
            total = maps[k, i, count] * force[k] + maps[k, i, count + 1] * force[k + 1]
            for j in range(count):
                total += maps[k, i, j] * state[j]
            if i < count:
                following[i] = total
            else:
                response[k + 1] = total
        for i in range(count):
            state[i] = following[i]
    return force.shape[0]
