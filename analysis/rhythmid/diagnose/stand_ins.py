"""Stand-ins: effects that, as they are fitted, are not what their name says and imitate something else.

One that bends only where the motion has never been, such as a gap whose edges it never meets, is but a constant or a
spring; one at the edge of what it may be is on its way to being another; and a disturbance, or a resonance as
narrow as one, at a multiple of the forcing's frequency is what any change in the path of the forcing looks like.
"""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rhythmid.diagnose.search.score_tests import Trajectories
from rhythmid.diagnose.static_law import SAME, curved
from rhythmid.elements.element import Element, Scales
from rhythmid.model import Term
from rhythmid.simulation.effect import Path, effect_along

Array = NDArray[np.float64]
POINTS = 400  # instants at which an effect is tried
REACH = 1.2  # times the ranges of the motion, which no part of it exceeds, nor of what a limit has cut off
FAR = 1e3  # times these ranges, where every kink shows
DAMPING = "damping_ratio"  # of a resonance: it is as wide as this share of its frequency
EDGE = 1e-3  # of a bound, as which a value next to it counts


def stand_ins(known: Trajectories, added: Sequence[str], sizes: Scales) -> list[str]:
    """A sentence about each of the `added` elements, by their labels, that is a stand-in in the fitted model."""
    said: list[str] = []
    for label in added:
        term = known.fit.model.term(label)
        assert term is not None
        name = term.element.name.replace("_", " ")
        if _beyond_reach(known, term):
            said.append(
                f"{name} would act beyond the records' range only; within it stands for something else"
            )
        elif (edge := _at_edge(term, sizes)) is not None:
            said.append(f"{name} is at the edge of what it can be ({edge}) and stands for something else")
        elif _synchronous(term, sizes):
            said.append(
                f"{name} at the forcing's own frequency stands for a change in the path of the forcing"
            )
    return said


def _beyond_reach(known: Trajectories, term: Term) -> bool:
    """Whether the effect is curved, but straight wherever the motion has been."""
    element = term.element
    if element.kernel is None or element.own:
        return False
    values = {name: value.value for name, value in term.values.items()}
    bent: list[bool] = []
    for times in (REACH, FAR):
        path = _instants(_met(known, element), times)
        effect = effect_along(element, values, known.fit.model, path)
        left = curved(effect, path.position, path.velocity, path.effort, path.signal, path.time)
        bent.append(bool(np.abs(left).max() > SAME * np.abs(effect).max()))
    return bent == [False, True]


def _at_edge(term: Term, sizes: Scales) -> str | None:
    """The first parameter that ended at a bound which the search has set for these records."""
    for name in term.element.ranges(sizes) if term.element.ranges is not None else ():
        value, (low, high) = term.values[name].value, term.values[name].bounds
        near = [end for end in (low, high) if math.isfinite(end) and abs(value - end) < EDGE * abs(end)]
        if near and not term.values[name].fixed:
            return name
    return None


def _synchronous(term: Term, sizes: Scales) -> bool:
    """Whether the effect is a vibration, or a resonance as narrow as one, that these records cannot tell in frequency from
    the forcing."""
    forcing, line = sizes.forcing_frequency, 1.0 / sizes.duration
    if term.element.kernel is None or forcing <= 0.0:
        return False
    found = [term.values[one.name].value for one in term.element.parameters if one.unit == "Hz"]
    damping = term.values[DAMPING].value if DAMPING in term.values else 0.0
    return any(abs(f - round(f / forcing) * forcing) < line and damping * f < line for f in found)


def _met(known: Trajectories, element: Element) -> Path:
    """All that the element has met, one record after the other."""
    paths = known.paths if element.acts == "body" else known.legs
    if element.slot == "actuator":
        paths = [replace(path, signal=path.effort) for path in paths]
    elif element.slot == "command":
        paths = [replace(path, signal=command) for path, command in zip(paths, known.commands)]
    names = ("time", "position", "velocity", "effort", "leg", "signal")
    return Path(*(np.concatenate([getattr(path, name) for path in paths]) for name in names))


def _instants(met: Path, times: float) -> Path:
    """Instants within so many times the ranges of a motion, all quantities drawn by themselves."""
    rng = np.random.default_rng(0)

    def drawn(values: Array) -> Array:
        low, high = float(values.min()), float(values.max())
        return 0.5 * (low + high) + times * 0.5 * (high - low) * rng.uniform(-1.0, 1.0, POINTS)

    return Path(
        np.linspace(met.time.min(), met.time.max(), POINTS),
        *(drawn(values) for values in (met.position, met.velocity, met.effort, met.leg, met.signal)),
    )
