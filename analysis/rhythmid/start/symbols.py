"""Symbols with a common subscript: `Vr` beside `Wr` is a voltage beside a speed."""

import re
from collections.abc import Sequence

from rhythmid.record.inventory import Recorded
from rhythmid.start.role_choice import Known
from rhythmid.start.vocabulary import Quantity

SYMBOL = re.compile(r"([VUIWTF])_?([a-z]?\d?)")
OF: dict[str, Quantity] = {
    "V": "effort", "U": "effort", "I": "effort", "T": "effort", "F": "effort", "W": "velocity",
}  # fmt: skip


def with_symbols(known: Sequence[Known]) -> list[Known]:
    """The numbers, where no word says what any of them is, with the quantities of symbols that share a subscript, one
    of a drive and one of a motion."""
    if any(one.meaning.certain or one.one.topic for one in known):
        return list(known)
    symbols = [_symbol(one.one) for one in known]
    quantities: dict[str, set[Quantity]] = {}
    for letter, subscript in filter(None, symbols):
        quantities.setdefault(subscript, set()).add(OF[letter])
    told = {subscript for subscript, of in quantities.items() if of == {"effort", "velocity"}}
    return [
        one.taken_for(
            OF[symbol[0]], f"{symbol[0]!r} beside another symbol with its subscript stands for that"
        )
        if symbol is not None and symbol[1] in told
        else one
        for one, symbol in zip(known, symbols, strict=True)
    ]


def _symbol(one: Recorded) -> tuple[str, str] | None:
    found = SYMBOL.fullmatch(one.said)
    return None if found is None or one.unit else (found[1], found[2])
