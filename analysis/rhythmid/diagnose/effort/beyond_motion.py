"""Share of a time-dependent effect that no law of the motion reproduces.

If the motion goes forth and back only once, a later time is also another direction: a fading actuator and a friction that
differs by direction are then equivalent. Only a repeated motion separates time from direction.
"""

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rhythmid.diagnose.evidence import Linearised
from rhythmid.diagnose.static_law import INSTANTS, SAME
from rhythmid.elements.element import Element
from rhythmid.identify.inverse_dynamics.balance import Balance
from rhythmid.identify.least_squares import column_norms
from rhythmid.model import Model
from rhythmid.simulation.effect import Path, effect_along

Array = NDArray[np.float64]


def beyond_motion(balance: Balance, model: Model, label: str, plain: Linearised, mapped: Linearised) -> float:
    """Share of an effect on the effort that no free map of the motion reproduces.

    Ratio of two mean squares: what the fit with a free map leaves of the effect over what the nominal parameters leave of
    it. Infinite for an effect that does not change with time.

    Parameters
    ----------
    balance, model, label
        The rows, the fitted model and the effect's label.
    plain, mapped
        The nominal fit, and the same fit with a free map beside its parameters.
    """
    term = model.term(label)
    if term is None or not changes_with_time(term.element, term.numbers, model):
        return math.inf
    effect = balance.predicted(model) - balance.predicted(model.pruned(label))
    rest, beyond = (_beyond(effect, one.jacobian) for one in (plain, mapped))
    return beyond / rest if rest > 0.0 else math.inf


def changes_with_time(element: Element, values: dict[str, float], model: Model) -> bool:
    """Whether the output of an element without memory depends on time."""
    if element.kernel is None or element.own or element.history or element.states or element.memories:
        return False
    rng = np.random.default_rng(0)
    drawn = [rng.uniform(-1.0, 1.0, INSTANTS) for _ in range(5)]
    path = Path(np.linspace(0.0, 1.0, INSTANTS), *drawn)
    first = effect_along(element, values, model, path)
    again = effect_along(element, values, model, replace(path, time=path.time + 1.0))
    return bool(np.abs(again - first).max() > SAME * np.abs(first).max())


def _beyond(effect: Array, columns: Array) -> float:
    """Mean square of an effect (n,) after projecting columns (n, p) out of it."""
    norms = column_norms(columns)
    scaled = columns / norms
    return float(np.mean((effect - scaled @ np.linalg.lstsq(scaled, effect, rcond=1e-9)[0]) ** 2))
