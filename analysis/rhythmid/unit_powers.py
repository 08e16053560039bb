"""Units as products of powers: rad/s^2*s^2/rad is 1.

A library of units takes half a second to import, and refuses units that it does not know, such as px, duty or %.
"""

import re
from collections.abc import Iterator

NAME = r"[^\W\d_]+|%"
TOKEN = re.compile(rf"({NAME}|1)(?:\^(-?\d+))?|([*/()](?!\^))")


def reduced(unit: str) -> str:
    """The unit with every name only once. A text that is not a product of powers is returned unchanged."""
    names = re.findall(NAME, unit)
    powers = _powers(unit)
    if powers is None or len(set(names)) == len(names):
        return unit
    over = [_power(name, power) for name, power in powers.items() if power > 0]
    under = [_power(name, -power) for name, power in powers.items() if power < 0]
    below = "*".join(under)
    return ("*".join(over) or "1") + (f"/({below})" if len(under) > 1 else f"/{below}" if under else "")


def are_same(first: str, second: str) -> bool:
    """Whether two units are the same product of powers, however they are written: 1*s/rad and s/rad."""
    powers = _powers(first)
    return first == second or (powers is not None and powers == _powers(second))


def is_product(unit: str) -> bool:
    """Whether a text is a product of powers of names."""
    return _powers(unit) is not None


def _power(name: str, power: int) -> str:
    return name if power == 1 else f"{name}^{power}"


def _powers(unit: str) -> dict[str, int] | None:
    """The power of each name, in order; None if the text is not a product of names."""
    found: dict[str, int] = {}
    signs = [1]  # of what stands in each pair of brackets that is open
    sign, factor = 1, True  # of the next factor, and whether one is due
    for name, power, mark in _tokens(unit):
        if name and factor:
            if name != "1":
                found[name] = found.get(name, 0) + signs[-1] * sign * int(power or 1)
            factor = False
        elif mark == "(" and factor:
            signs.append(signs[-1] * sign)
            sign = 1
        elif mark == ")" and not factor and len(signs) > 1:
            signs.pop()
        elif mark in ("*", "/") and not factor:
            sign, factor = (1 if mark == "*" else -1), True
        else:
            return None
    return found if not factor and len(signs) == 1 else None


def _tokens(unit: str) -> Iterator[tuple[str, str, str]]:
    """Name, power and mark of each part; an invalid mark if the text is not a unit."""
    at = 0
    while at < len(unit):
        match = TOKEN.match(unit, at)
        if match is None:
            yield "", "", "?"
            return
        yield match.group(1) or "", match.group(2) or "", match.group(3) or ""
        at = match.end()
