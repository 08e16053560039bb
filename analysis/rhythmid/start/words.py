"""The words of a name, also where they are written as one: `jointPos`, `joint_pos` and `jointpos`."""

import re
import unicodedata
from functools import cache

from rhythmid.start.vocabulary import (
    COMMANDED,
    COUNTED,
    GAUGES,
    IGNORED,
    LETTERS,
    MECHANICAL,
    PLACES,
    WITH_MEANING,
)

ARRAY_OF_NAMES = re.compile(r"\b[A-Za-z]\[\d+\]\.")
SHORTEST = 3  # letters of a word within another: of two, almost every word consists
KNOWN = frozenset(
    word for word in WITH_MEANING | PLACES | IGNORED | COUNTED | GAUGES | MECHANICAL if len(word) >= SHORTEST
)
LINKS = ("", "s", "es", "n", "en")  # letters between the parts of a German compound
# words at the end of a compound, which say what it is whatever stands before: Gelenkwinkel, wheelspeed; without those with which
# other words end, too (rectangle, composition, recurrent)
HEADS = tuple(
    "winkel geschwindigkeit drehzahl beschleunigung drehmoment moment kraft strom spannung torque velocity speed acceleration".split()
)
BEFORE_NAME = ("soll", "ist")  # before a part that is a name: Sollgelenkwinkel
SYMBOL = re.compile(
    "(["
    + "".join(sorted(LETTERS))
    + "])("
    + "|".join(sorted(w for w in COMMANDED if len(w) >= SHORTEST))
    + ")"
)


def words_of(text: str) -> list[str]:
    """Words of a name in lower case and without accents: split at capitals, digits, dots, slashes and underscores, and
    where words with a meaning are written as one.

    The letter of an array whose elements have names, such as `Y` in `Y[2].voltage`, is no word.
    """
    plain = unicodedata.normalize("NFKD", text.replace("ß", "ss"))
    bare = ARRAY_OF_NAMES.sub(" ", "".join(one for one in plain if not unicodedata.combining(one)))
    apart = re.sub(r"([a-z0-9])([A-Z])", r"\1 \2", bare)
    return [part for word in re.findall(r"[a-z]+|\d+", apart.lower()) for part in parts_of(word)]


@cache
def parts_of(word: str) -> tuple[str, ...]:
    """The words that are written as one in `sollmoment`, `motorcurrent`, `qdes` or `gelenkwinkel`; the word itself
    where there are none."""
    if word in KNOWN or len(word) <= SHORTEST:
        return (word,)
    if symbol := SYMBOL.fullmatch(word):
        return symbol.groups()
    return _compound(word) or _named(word) or (word,)


@cache
def _compound(word: str) -> tuple[str, ...]:
    """The fewest words with a meaning of which a word consists; empty where it does not."""
    if word in KNOWN:
        return (word,)
    found: list[tuple[str, ...]] = []
    for end in range(SHORTEST, len(word) - SHORTEST + 1):
        if word[:end] not in KNOWN:
            continue
        rest = word[end:]
        parts = (_compound(rest[len(link) :]) for link in LINKS if rest.startswith(link))
        found += [(word[:end], *part) for part in parts if part]
    return min(found, key=len, default=())


def _named(word: str) -> tuple[str, ...]:
    """A name and the word behind it that says what it is; empty where there is none."""
    head = next((one for one in HEADS if word.endswith(one) and len(word) >= len(one) + SHORTEST), None)
    if head is None:
        return ()
    name = word[: -len(head)]
    first = next(
        (one for one in BEFORE_NAME if name.startswith(one) and len(name) >= len(one) + SHORTEST), ""
    )
    return (*([first] if first else []), name[len(first) :], head)
