"""Derivatives by name: `angle_first_derivative`, `position_dot`, `d_theta`, `dd_x`, `jerk` are no positions."""

from collections.abc import Collection, Sequence

DERIVATIVE = frozenset("derivative derivatives deriv derivada derivata derivee ableitung dot".split())
ORDERS = {
    2: frozenset("second 2nd segunda seconda seconde deuxieme zweite double 2".split()),
    3: frozenset("third 3rd tercera terza troisieme dritte triple 3".split()),
}  # of the derivative; without such a word it is the first
FIRST = frozenset("first 1st primera prima premiere erste 1 of".split())
DOTS = {"ddot": 2, "dotdot": 2, "dddot": 3, "jerk": 3, "ruck": 3}
PREFIXES = {"d": 1, "dd": 2, "ddd": 3}  # before the name of a motion
NAMED = frozenset({*DERIVATIVE, *DOTS})


def order_of(words: Sequence[str], motion: Collection[str]) -> tuple[int, str]:
    """Order of the derivative that the words of a name state, and the word that does; 0 where none does. `motion` are
    the words for motions, of which a `d` before says so."""
    for word in words:
        if word in DOTS:
            return DOTS[word], word
    said = [word for word in words if word in DERIVATIVE]
    if said:
        order = next((order for order, own in ORDERS.items() if own & set(words)), 1)
        return max(order, len(said)), said[0]
    for word, after in zip(words, words[1:]):
        if word in PREFIXES and after in motion:
            return PREFIXES[word], word
    return 0, ""


def words_of_order(words: Sequence[str]) -> frozenset[str]:
    """The words of a name that only state a derivative and its order."""
    if not NAMED & set(words):
        return frozenset()
    return NAMED | FIRST | ORDERS[2] | ORDERS[3]
