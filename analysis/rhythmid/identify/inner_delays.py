"""Dead times inside the machine: which are identifiable, and otherwise which sums of delays are.

Without a controller, a dead time of the actuator delays every force that drives the machine, and so the motion.
Nothing in the record distinguishes it from a measurement delay. Inside a controller's loop a dead time moves the
poles of the loop, which is observable. Forcing, reference and loop then show three sums of the four delays τ_u,
τ_a, τ_f and τ_y. The sensitivities show what is not identifiable, for any machine.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rhythmid.identify.dead_times import dead_times
from rhythmid.identify.harmonic_likelihood import DELAYS
from rhythmid.identify.identification import Delays, Estimate, InnerDelay
from rhythmid.identify.output_error import Fit
from rhythmid.identify.undetermined import sum_beside, sum_of

Array = NDArray[np.float64]
OPPOSITE = 0.05  # share of a direction's largest step within which steps count as cancelling
# share of the delays' largest sensitivity below which the rest of a direction is an error of integration and differences
UNNOTICED = 5e-3
UNKNOWN = Estimate(None, None, "s")


def with_inner_delays(found: Delays, fit: Fit) -> Delays:
    """The delays with dead times inside the machine added; a delay has no value where only a sum is identifiable."""
    inside = {name: label for name, label in dead_times(fit.model).items() if name in fit.names}
    if not inside:
        return found
    among = (*inside, *(name for name in DELAYS if name in fit.names))
    directions = unnoticed(fit, among)
    inner: dict[str, InnerDelay] = {}
    for name, label in inside.items():
        moved = any(abs(one[among.index(name)]) > OPPOSITE for one in directions)
        inner[label] = _refused(fit, name, among, directions) if moved else InnerDelay(sum_of(fit, name))
    mixed = [one for one in directions if np.any(np.abs(one[: len(inside)]) > OPPOSITE)]
    lost = [
        which
        for which, name in zip(("input", "measurement"), DELAYS)
        if name in among and any(abs(one[among.index(name)]) > OPPOSITE for one in mixed)
    ]
    if not lost:
        return replace(found, inner=inner)
    words = "; ".join(dict.fromkeys(one.reason for one in inner.values() if not one.separable))
    kept = {
        which: UNKNOWN if which in lost else sum_of(fit, name)
        for which, name in zip(("input", "measurement"), DELAYS)
        if name in among
    }
    return replace(
        found, **kept, sum=UNKNOWN, separable=False, assumption=words, intervals=None, aliases=(), inner=inner
    )


def unnoticed(fit: Fit, among: Sequence[str]) -> Array:
    """Directions (d, n) in the space of these delays, with largest step 1, whose effect other parameters can absorb
    completely."""
    places = np.array([name in among for name in fit.names])
    order = [fit.names.index(name) for name in among]
    columns, others = fit.linearisation.jacobian[:, order], fit.linearisation.jacobian[:, ~places]
    others = others / np.maximum(np.linalg.norm(others, axis=0), 1e-150)
    left = columns - others @ np.linalg.lstsq(others, columns, rcond=1e-10)[0] if others.shape[1] else columns
    _, felt, directions = np.linalg.svd(left, full_matrices=False)
    lost = directions[felt < UNNOTICED * np.linalg.norm(columns, axis=0).max()]
    return lost / np.maximum(np.abs(lost).max(axis=1, keepdims=True), 1e-150)


def _refused(fit: Fit, name: str, among: Sequence[str], directions: Array) -> InnerDelay:
    """A dead time without a value, with the sums that stay constant along the undetermined directions."""
    place = among.index(name)
    groups = [(place, at) for at in range(len(among)) if at != place]
    same = [one for one in groups if _cancels(directions[:, one])] or [
        one for one in (tuple(range(len(among))),) if _cancels(directions)
    ]
    label = name.split(".")[0]
    sums = {
        " + ".join(among[at].split(".")[0] for at in one if at != place): sum_beside(
            fit, [among[at] for at in one]
        )
        for one in same
    }
    reason = (
        f"only the sum of {label} with {' and with '.join(sums)} is identifiable"
        if sums
        else f"nothing in the records determines {label}, nor its sum with other delays"
    )
    return InnerDelay(UNKNOWN, False, reason, sums)


def _cancels(steps: Array) -> bool:
    """Whether the steps (d, n) of each direction sum to zero."""
    return bool(np.all(np.abs(steps.sum(axis=1)) <= OPPOSITE))
