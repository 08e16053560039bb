"""Frequency of an effect relative to the motion's own: at the same one it is equivalent to a change in the path of the force.

A vibration, or a resonance as narrow as a spectral line, at a multiple of the forcing's frequency is equivalent to any change in the path
of the forcing; at the frequency of a free motion it is equivalent to another damping or stiffness.
"""

import math
from collections.abc import Mapping

from rhythmid.elements.element import Element, Scales

# frequency resolutions within which two frequencies count as equal: spectral lines closer than their width cannot be separated
OWN_LINE = 1.0


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
