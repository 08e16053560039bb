"""The recursion by which small changes of state and force travel along a trajectory, compiled once.

The text of this function goes, as it stands here, into a module of its own.
"""
# pyright: reportMissingParameterType=false, reportUnknownParameterType=false

import numpy as np


def run(maps, direct, force, response):
    """Fill the change (n,) of an output that a force (n,), straight between its values, makes, and return n.

    `maps` (n - 1, q + 1, q + 2) lead over each interval from the change of the state and the force at both ends to that of the state and
    of the output; `direct` is what the force does to the first output.
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
