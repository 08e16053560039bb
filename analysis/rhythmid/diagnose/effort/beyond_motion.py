"""What an effect that changes with time does to the effort beyond any law of the motion.

Where a motion is made once there and once back, what comes later also turns the other way: a fading actuator and a friction that differs by
direction are then the same. The motion has to come again for time to be told from it.
"""

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rhythmid.diagnose.evidence import Linearised
from rhythmid.diagnose.static_law import INSTANTS, SAME
from rhythmid.elements.element import Element
from rhythmid.identify.inverse_dynamics.balance import Balance
from rhythmid.model import Model
from rhythmid.simulation.effect import Path, effect_along

Array = NDArray[np.float64]


def beyond_motion(balance: Balance, model: Model, label: str, plain: Linearised, mapped: Linearised) -> float:
    """Mean square of what an effect does to the effort that no free map of the motion does, as a share of what the parameters of the
    model do not; infinite for an effect that does not change with time.

    Parameters
    ----------
    balance, model, label
        The rows, the fitted model and the effect's label.
    plain, mapped
        The nominal fit, and the same with a free map beside its parameters.
    """
    term = model.term(label)
    if term is None or not changes_with_time(term.element, term.numbers, model):
        return math.inf
    effect = balance.predicted(model) - balance.predicted(model.pruned(label))
    rest, beyond = (_beyond(effect, one.jacobian) for one in (plain, mapped))
    return beyond / rest if rest > 0.0 else math.inf


def changes_with_time(element: Element, values: dict[str, float], model: Model) -> bool:
    """Whether an element without memory does something else at another time."""
    if element.kernel is None or element.own or element.history or element.states or element.memories:
        return False
    rng = np.random.default_rng(0)
    drawn = [rng.uniform(-1.0, 1.0, INSTANTS) for _ in range(5)]
    path = Path(np.linspace(0.0, 1.0, INSTANTS), *drawn)
    first = effect_along(element, values, model, path)
    again = effect_along(element, values, model, replace(path, time=path.time + 1.0))
    return bool(np.abs(again - first).max() > SAME * np.abs(first).max())


def _beyond(effect: Array, columns: Array) -> float:
    """Mean square of what columns (n, p) leave of an effect (n,)."""
    norms = np.linalg.norm(columns, axis=0)
    norms[norms == 0.0] = 1.0
    scaled = columns / norms
    return float(np.mean((effect - scaled @ np.linalg.lstsq(scaled, effect, rcond=1e-9)[0]) ** 2))
