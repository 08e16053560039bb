"""Static laws: effects whose force, or change of a signal, is a curved function of one quantity of the instant.

The sum of several of them in one quantity is one law again, and may be one that the catalogue lacks, as powers of x are any
smooth spring: then a free map of that quantity is another hypothesis in their place.
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
INSTANTS = 400  # instants at which an effect is tried
SPREAD = 3.0  # standard deviations of velocity and force that they cover
MOSTLY = 0.3  # change, as a share of the effect, below which other quantities only correct it, as the damping of a stop
SAME = 1e-9  # share of the effect below which what is left of it is rounding


def curved(effect: Array, *quantities: Array) -> Array:
    """The effect (n,) without its best straight line in the quantities (n,)."""
    straight = np.column_stack(
        [np.ones(len(effect)), *(one / (np.abs(one).max() or 1.0) for one in quantities)]
    )
    return effect - straight @ np.linalg.lstsq(straight, effect, rcond=None)[0]


def law_of(
    element: Element, values: Mapping[str, float], model: Model, sizes: Scales
) -> tuple[str, Array] | None:
    """The one quantity of which the effect is a curved function: position, velocity, effort (the actuator's force) or
    signal (what enters a command, actuator or sensor element), and the curved part of it (INSTANTS,), at the same instants
    for every effect. None where the effect is straight, remembers, or takes several quantities. Raises nothing of its own.

    `values` and `sizes` are in SI units (those of the sensor for a sensor element), the curved part in the unit of the
    effect. A quantity is the one if exchanging all others between the instants leaves most of the effect as it was."""
    if element.kernel is None or element.own or element.history:
        return None
    rng = np.random.default_rng(0)
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
    """The static laws among a model's added effects: their curved parts by label, by (slot, quantity)."""
    found: dict[tuple[str, str], dict[str, Array]] = {}
    for label in trial.added:
        term = trial.model.term(label)
        assert term is not None
        values = term.numbers
        law = law_of(term.element, values, trial.model, sizes)
        if law is not None:
            found.setdefault((term.element.slot, law[0]), {})[label] = law[1]
    return found
