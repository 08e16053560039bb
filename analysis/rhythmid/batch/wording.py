"""Numbers of a comparison in words."""

from rhythmid.batch.agreement import Agreement
from rhythmid.report.quantity import NONE, number, plus_minus, pretty_unit, scaled, with_unit

SMALLEST = 1e-4  # smaller p-values are only stated to be below this


def p_value(p: float | None) -> str:
    """A p-value to two digits."""
    if p is None:
        return NONE
    return "<\u00a00.0001" if p < SMALLEST else number(p, 2)


def trend_words(one: Agreement) -> str:
    """The slope with its interval and p-value."""
    slope = one.slope
    if slope is None:
        return NONE
    factor, unit = scaled(max(abs(slope.value), slope.half), one.unit)
    change = with_unit(
        plus_minus(factor * slope.value, factor * slope.half), f"{pretty_unit(unit) or '1'}/{one.per}"
    )
    return f"{change}, p\u00a0{p_value(slope.p_value)}"
