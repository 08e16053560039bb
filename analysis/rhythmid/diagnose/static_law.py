"""Static laws: effects whose force, or change of a signal, is a curved function of one quantity at the same instant.

Several of them in one quantity together form one law, which the catalogue may lack: a sum of powers of x, for example, approximates
any smooth spring. A free map of that quantity is therefore another hypothesis in their place.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rhythmid.diagnose.search.trial import Trial
from rhythmid.elements.element import Element, Scales
from rhythmid.model import Model
from rhythmid.simulation.effect import Path, effect_along

Array = NDArray[np.float64]
INSTANTS = 400  # random instants at which an effect is evaluated
SPREAD = 3.0  # their range of velocity and force, in standard deviations
MOSTLY = 0.3  # share of the effect by which other quantities may change it, as the damping of a stop does
SAME = 1e-9  # share of the effect below which a remainder is rounding


def curved(effect: Array, *quantities: Array) -> Array:
    """The effect (n,) without its best linear fit in the quantities (n,)."""
    straight = np.column_stack(
        [np.ones(len(effect)), *(one / (np.abs(one).max() or 1.0) for one in quantities)]
    )
    return effect - straight @ np.linalg.lstsq(straight, effect, rcond=None)[0]


def law_of(
    element: Element, values: Mapping[str, float], model: Model, sizes: Scales
) -> tuple[str, Array] | None:
    """The one quantity of which the effect is a curved function, and the curved part of the effect.

    Parameters
    ----------
    element, model : the element, and the model to which it belongs.
    values, sizes : its parameters and the scales of the records, in SI units.

    Returns
    -------
    tuple or None
        The quantity: position, velocity, effort (the actuator's force) or signal (the input of a command, actuator or sensor
        element). The curved part (INSTANTS,) in the unit of the effect, at the same instants for every effect. None where the
        effect is straight, has memory, or depends on several quantities. An effect depends on one quantity if exchanging the
        values of all others between the instants leaves most of the effect unchanged.
    """
    if element.kernel is None or element.own or element.history:
        return None
    rng = np.random.default_rng(0)
    sizes = sizes.seen_in(element.slot)
    width = {"velocity": SPREAD * sizes.velocity, "effort": SPREAD * sizes.effort, "leg": sizes.force}
    drawn = {name: rng.uniform(-half, half, INSTANTS) for name, half in width.items()}
    drawn["position"] = rng.uniform(sizes.low, sizes.high, INSTANTS)
    drawn["signal"] = drawn["position" if element.slot == "sensor" else "effort"]
    path = Path(time=np.linspace(0.0, sizes.duration, INSTANTS), **drawn)
    effect = effect_along(element, values, model, path)
    size = float(np.abs(effect).max())
    for name in ("signal",) if element.slot != "force" else ("position", "velocity", "effort"):
        others = {other: rng.permutation(value) for other, value in drawn.items() if other != name}
        again = effect_along(element, values, model, replace(path, time=rng.permutation(path.time), **others))
        if np.std(again - effect) > MOSTLY * np.std(effect):
            continue
        bent = curved(effect, drawn[name])
        return (name, bent) if np.abs(bent).max() > SAME * size else None
    return None


def laws_of(trial: Trial, sizes: Scales) -> dict[tuple[str, str], dict[str, Array]]:
    """The static laws among a model's added effects: curved parts by label, grouped by (slot, quantity)."""
    found: dict[tuple[str, str], dict[str, Array]] = {}
    for label in trial.added:
        term = trial.model.term(label)
        assert term is not None
        values = term.numbers
        law = law_of(term.element, values, trial.model, sizes)
        if law is not None:
            found.setdefault((term.element.slot, law[0]), {})[label] = law[1]
    return found
