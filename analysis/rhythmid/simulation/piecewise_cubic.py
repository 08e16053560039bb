"""Piecewise cubic signals inside a compiled simulation, where their knots are passed in order.

Coefficients are stored as in `scipy.interpolate.PPoly`, but with the lowest power first: one row for a held signal,
else four. The text of these functions is compiled once into its own module, which all generated modules import.
"""
# pyright: reportMissingParameterType=false, reportUnknownParameterType=false


def piece_at(knots, i, t):
    """Index of the piece at time t, searched from piece i on."""
    while knots[i + 1] <= t:
        i += 1
    return i


def value_at(knots, c, i, t):
    """Value of piece i at time t."""
    if c.shape[0] == 1:
        return c[0, i]
    x = t - knots[i]
    return ((c[3, i] * x + c[2, i]) * x + c[1, i]) * x + c[0, i]


def slope_at(knots, c, i, t):
    """Derivative of piece i at time t."""
    if c.shape[0] == 1:
        return 0.0
    x = t - knots[i]
    return (3.0 * c[3, i] * x + 2.0 * c[2, i]) * x + c[1, i]
