"""Means of a held signal over the steps of an integration, the same whether they are asked for all at once or in parts."""

import numpy as np

from rhythmid.body.body import Array


def held_means(knots: Array, level: Array, edges: Array, before: float = 0.0) -> Array:
    """Mean over each step of a signal that keeps `level` (k,) from its knot (k,) [s] on, and is `before` until the first.

    `edges` (n + 1,) [s] are the begins of the steps and the last one's end. Shape (n,). Every step is computed from what
    lies in it alone.
    """
    inside = knots[(knots > edges[0]) & (knots < edges[-1])]
    points = np.union1d(edges, inside)
    number = np.searchsorted(knots, points[:-1], side="right") - 1
    value = np.where(number < 0, before, np.append(level, before)[number])
    first = np.searchsorted(points, edges[:-1])
    whole = (
        np.diff(np.append(first, len(points) - 1)) == 1
    )  # steps without a knot inside keep the level itself
    mean = np.add.reduceat(value * np.diff(points), first) / np.diff(edges)
    return np.where(whole, value[first], mean)
