"""Numbers of a comparison in words."""

from rhythmid.batch.agreement import Agreement
from rhythmid.report.quantity import NONE, number, plus_minus, with_unit

SMALLEST = 1e-4  # p-value below which only that is told


def p_value(p: float | None) -> str:
    """A p-value to two digits."""
    if p is None:
        return NONE
    return f"< {number(SMALLEST, 1)}" if p < SMALLEST else number(p, 2)


def trend_words(one: Agreement) -> str:
    """The slope with its interval and p-value."""
    if one.slope is None:
        return NONE
    unit = "" if one.unit in ("1", "-") else one.unit
    slope = with_unit(
        plus_minus(one.slope.value, one.slope.half), f"{unit}/{one.per}" if unit else f"1/{one.per}"
    )
    return f"{slope} (p {p_value(one.slope.p_value)})"
