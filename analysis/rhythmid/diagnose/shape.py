"""Shape of a fitted effect: whether it still acts as its name says.

Three cases are detected. An effect that is curved only where the motion has never been, such as a gap whose edges are never reached, is
just a constant or a spring. An effect at a bound of its parameters is about to become another effect. A vibration, or a resonance as
narrow as a spectral line, at a multiple of the forcing's frequency is equivalent to any change in the path of the forcing; at the
frequency of a free motion it is equivalent to another damping or stiffness.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rhythmid.diagnose.constants import FAR_RANGES, REACH
from rhythmid.diagnose.search.score_tests import Trajectories
from rhythmid.diagnose.size_error import departure
from rhythmid.diagnose.static_law import INSTANTS, SAME, curved
from rhythmid.elements.element import Element, Scales
from rhythmid.elements.first_guess import NoGuess
from rhythmid.model import Model, Term
from rhythmid.simulation.effect import Path, effect_along

Array = NDArray[np.float64]


def shape_of(model: Model, added: Sequence[str], known: Trajectories, sizes: Scales) -> dict[str, float]:
    """The smallest statistic of the effects with the labels `added`, by the name of the rule that uses it.

    `known` is a fitted run of the same records; its motion is used for all models.
    """
    found: dict[str, float] = {}
    for label in added:
        term = model.term(label)
        if term is None:
            continue
        each = {
            "within_bounds": within_bounds(term, sizes),
            "acts_within_records": _acts_within(known, model, term),
            "own_frequency": own_frequency(term.element, term.numbers, sizes),
        }
        found = {name: min(value, found.get(name, math.inf)) for name, value in each.items()}
    return found


def _acts_within(known: Trajectories, model: Model, term: Term) -> float:
    """0 if an effect is curved only beyond the range of the motion; infinite if it is curved within it or straight."""
    element = term.element
    if element.kernel is None or element.own or element.history:
        return math.inf
    values = term.numbers
    bent: list[float] = []
    for times in (REACH, FAR_RANGES):
        path = _instants(_met(known, element), times)
        effect = effect_along(element, values, model, path)
        left = curved(effect, path.position, path.velocity, path.effort, path.signal, path.time)
        size = float(np.abs(effect).max())
        bent.append(float(np.abs(left).max()) / size if size > 0.0 else 0.0)
    if bent[1] <= SAME or bent[0] > SAME:
        return math.inf
    return 0.0


def within_bounds(term: Term, sizes: Scales) -> float:
    """Smallest distance of a free parameter from a bound set by the element's `ranges`, as a share of that bound.

    Also the distance of its size from that of no effect, as a share of the smallest first guess: an effect without a size is the
    hypothesis without it.
    """
    least = _size(term, sizes)
    for name in term.element.ranges(sizes) if term.element.ranges is not None else ():
        if term.values[name].fixed:
            continue
        value = term.values[name].value
        ends = [end for end in term.values[name].bounds if math.isfinite(end) and end != 0.0]
        least = min([least, *(abs(value - end) / abs(end) for end in ends)])
    return least


def _size(term: Term, sizes: Scales) -> float:
    """Size of an effect, as a share of the smallest first guess; infinite for one whose size has no first guess or is no free parameter."""
    element = term.element
    name, absent = element.size, element.absent
    if not name or not math.isfinite(absent) or term.values[name].fixed:
        return math.inf
    try:
        guesses = [abs(start[name] - absent) for start in element.first_guesses(sizes) if name in start]
    except NoGuess:
        return math.inf
    usual = min((one for one in guesses if one > 0.0), default=0.0)
    return departure(term) / usual if usual > 0.0 else math.inf


def own_frequency(element: Element, values: Mapping[str, float], sizes: Scales) -> float:
    """Distance of a vibration, or of a resonance as narrow as a spectral line, from the forcing's harmonics.

    In a free motion, the distance from the frequencies of the motion. In frequency resolutions of the records; infinite for other
    effects.
    """
    forcing, line = sizes.forcing_frequency, 1.0 / sizes.duration
    free = forcing <= 0.0 and sizes.idle
    if element.kernel is None or (forcing <= 0.0 and not free):
        return math.inf
    found = [values[one.name] for one in element.parameters if one.unit == "Hz"]
    damping = values[element.width] if element.width else 0.0
    low, high = min(sizes.frequency, sizes.swings[0] or math.inf), max(sizes.frequency, sizes.swings[1])
    apart = [
        max(low - f, f - high, 0.0) if free else abs(f - round(f / forcing) * forcing)
        for f in found
        if damping * f < line
    ]
    return min(apart, default=math.inf) / line


def _met(known: Trajectories, element: Element) -> Path:
    """All signals that have acted on the element, concatenated over the records."""
    paths = known.paths if element.acts == "body" else known.legs
    if element.slot == "actuator":
        paths = [replace(path, signal=path.effort) for path in paths]
    elif element.slot == "command":
        paths = [replace(path, signal=command) for path, command in zip(paths, known.commands)]
    names = ("time", "position", "velocity", "effort", "leg", "signal")
    met = Path(*(np.concatenate([getattr(path, name) for path in paths]) for name in names))
    if element.acts != "constraint":
        return met
    return replace(met, acceleration=np.concatenate([path.slope for path in paths]))


def _instants(met: Path, times: float) -> Path:
    """Random instants within `times` the range of a motion; all quantities are drawn independently."""
    rng = np.random.default_rng(0)

    def drawn(values: Array) -> Array:
        low, high = float(values.min()), float(values.max())
        return 0.5 * (low + high) + times * 0.5 * (high - low) * rng.uniform(-1.0, 1.0, INSTANTS)

    return Path(
        np.linspace(met.time.min(), met.time.max(), INSTANTS),
        *(drawn(values) for values in (met.position, met.velocity, met.effort, met.leg, met.signal)),
        acceleration=None if met.acceleration is None else drawn(met.acceleration),
    )
