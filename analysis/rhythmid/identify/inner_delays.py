"""Dead times inside the machine: which of them the records tell, and which sums of delays where they do not.

Without a controller all that drives the machine comes later by a dead time of its actuator, and so does the motion: nothing
recorded tells it from a measurement delay. Inside a controller's loop it moves the loop's own poles, which shows; then forcing,
reference and loop show three sums of the four delays τ_u, τ_a, τ_f and τ_y. What is not determined is told by the null space
of the Fisher information, whatever the machine.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from rhythmid.identify.harmonic_likelihood import DELAYS
from rhythmid.identify.identification import Delays, Estimate, InnerDelay
from rhythmid.identify.output_error import Fit
from rhythmid.identify.undetermined import Direction, sum_beside, sum_of
from rhythmid.model import Model

OPPOSITE = 0.05  # of a direction's largest step, within which two steps cancel
UNKNOWN = Estimate(None, None, "s")


def dead_times(model: Model) -> dict[str, str]:
    """Parameters that are dead times inside the machine, with the labels of their elements."""
    return {f"{t.label}.{t.element.dead_time}": t.label for t in model.terms if t.element.history}


def with_inner_delays(found: Delays, fit: Fit, directions: Sequence[Direction]) -> Delays:
    """The answer about the delays with those inside the machine; without a value what only a sum is known of."""
    inside = {name: label for name, label in dead_times(fit.model).items() if name in fit.names}
    if not inside:
        return found
    among = (*inside, *(name for name in DELAYS if name in fit.names))
    steps = [direction.steps(among) for direction in directions]
    hidden = {
        name for one in steps for name, step in zip(among, one) if abs(step) > OPPOSITE * np.abs(one).max()
    }
    inner: dict[str, InnerDelay] = {}
    for name, label in inside.items():
        if name not in hidden:
            inner[label] = InnerDelay(sum_of(fit, name), True, "", {})
            continue
        sums = _sums(name, among, steps)
        inner[label] = InnerDelay(
            UNKNOWN,
            False,
            _reason(name, sums),
            {other.split(".")[0]: sum_beside(fit, name, other) for other in sums},
        )
    lost = [
        which
        for which, name in zip(("input", "measurement"), DELAYS)
        if name in hidden and hidden & set(inside)
    ]
    if not lost or not found.separable:
        return replace(found, inner=inner)
    refused: Mapping[str, Estimate] = dict.fromkeys((*lost, "sum"), UNKNOWN)
    words = "; ".join(one.reason for one in inner.values() if not one.separable)
    return replace(found, **refused, separable=False, assumption=words, inner=inner)


def _sums(name: str, among: Sequence[str], steps: Sequence[np.ndarray]) -> list[str]:
    """The delays of which the sum with `name` is the same however far one goes in an undetermined direction."""
    place = among.index(name)
    return [
        other
        for at, other in enumerate(among)
        if at != place and all(abs(one[place] + one[at]) <= OPPOSITE * np.abs(one).max() for one in steps)
    ]


def _reason(name: str, sums: Sequence[str]) -> str:
    """Why a dead time has no value, in words."""
    label = name.split(".")[0]
    if not sums:
        return f"nothing in the records determines {label}, nor its sum with another delay"
    others = " and with ".join(other.split(".")[0] for other in sums)
    return f"only the sum of {label} with {others} shows, not how it divides"
