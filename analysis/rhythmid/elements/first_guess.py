"""First guesses for elements without `starts`: each parameter from its unit, its bounds and the scales of the records.

A guess only needs the right order of magnitude: the score test scales its effect to the data, and a refit does the
rest. The shares are those of the built-in elements' own guesses: an effect of a few per cent of the machine's
forces.
"""

import math
import re
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rhythmid.elements.element import Element, Parameter, Scales

FORCE = 0.02  # share of the leg's typical force
COEFFICIENT = 0.05  # share of a stiffness, a damping, or any other force per power of position and speed
MASS = 0.03  # share of the machine's mass
MOTION = 0.2  # share of its position, speed or acceleration
CYCLE = 0.02  # share of a period of the motion, as a time
PLAIN = 0.1  # value of a dimensionless parameter
# smallest and largest factor by which a score test scales an effect's first guess. At zero its shape parameters have no derivative, and far
# from the guess the test is an extrapolation
LEAST_FACTOR, LARGEST_FACTOR = 0.05, 30.0
FURTHER = 4.0  # factor of lengths, speeds and times in a second guess
GUESSES = (  # the same in words, for the reference page
    f"for N {FORCE:g} of the typical force; for N/m, N*s/m and similar units {COEFFICIENT:g} of the coefficient that gives that force; "
    f"for kg {MASS:g} of the mass; for m, m/s and m/s^2 {MOTION:g} of the motion; for s {CYCLE:g} of its period; for Hz its frequency; "
    f"for 1 {PLAIN:g}; for 1/s {PLAIN:g} of the inverse duration; for lengths, speeds and times a second guess {FURTHER:g} times as large"
)
SHAPES = (
    "m",
    "m/s",
    "m/s^2",
    "s",
    "1/m",
    "1/s",
)  # units of parameters for a location or a rate rather than a size


class NoGuess(Exception):
    """Reason why an element gets no first guess."""


def generic_guesses(element: "Element", scales: "Scales") -> list[dict[str, float]]:
    """First guesses from units, bounds and scales: two where a length, a speed or a time is guessed, two for a phase.

    A parameter with a default keeps it, unless it is the effect's size. Raises NoGuess with the reason where a
    parameter's unit gives no scale, or where its bounds exclude all guesses.
    """
    if math.isinf(element.absent):
        raise NoGuess(
            f"its {element.size} is absent at infinity: its unit does not say from what size on it shows"
        )
    cases = (
        [1.0, FURTHER] if any(_open(element, p) and p.unit in SHAPES for p in element.parameters) else [1.0]
    )
    guesses = [
        {
            p.name: _inside(
                p, _magnitude(p, scales) * (factor if p.unit in SHAPES and p.name != element.size else 1.0)
            )
            for p in element.parameters
            if p.default is None or p.name == element.size
        }
        for factor in cases
    ]
    for phase in (p for p in element.parameters if math.isfinite(p.turn)):
        quarters = (0.0, 0.25 * phase.turn)
        guesses = [guess | {phase.name: _inside(phase, turned)} for guess in guesses for turned in quarters]
    if element.size and any(guess[element.size] == element.absent for guess in guesses):
        raise NoGuess(f"no {element.size} other than {element.absent:g} lies within its bounds")
    return guesses


def limited(factor: float) -> float:
    """The factor from a score test, with its sign, between `LEAST_FACTOR` and `LARGEST_FACTOR`."""
    return math.copysign(min(max(abs(factor), LEAST_FACTOR), LARGEST_FACTOR), factor)


def rescaled(element: "Element", values: Mapping[str, float], factor: float) -> dict[str, float]:
    """A first guess whose effect is scaled by the factor from a score test, inside the bounds of its size.

    Unchanged for an element without a size, and for a limit, whose effect is not proportional to its value.
    """
    if not element.size or math.isinf(element.absent):
        return dict(values)
    low, high = element.parameter(element.size).bounds
    margin = LEAST_FACTOR * abs(values[element.size] - element.absent)
    scaled = element.scaled(values, limited(factor))
    return scaled | {element.size: min(max(scaled[element.size], low + margin), high)}


def _open(element: "Element", parameter: "Parameter") -> bool:
    """Whether a parameter is guessed but is not a size of the effect."""
    return parameter.default is None and parameter.name != element.size


def _magnitude(parameter: "Parameter", scales: "Scales") -> float:
    """A significant size of a parameter in its unit."""
    rate = scales.velocity / scales.position  # [1/s] angular frequency of the motion
    known = {
        "N": FORCE * scales.force,
        "N/m": COEFFICIENT * scales.stiffness,
        "N*s/m": COEFFICIENT * scales.damping,
        "kg": MASS * scales.mass,
        "m": MOTION * scales.position,
        "m/s": MOTION * scales.velocity,
        "m/s^2": MOTION * scales.velocity * rate,
        "s": CYCLE / scales.frequency,
        "Hz": scales.frequency,
        "1": PLAIN,
        "rad": 0.0,
        "1/m": MOTION / scales.position,
        "1/s": PLAIN / scales.duration,
    }
    if parameter.unit in known:
        return known[parameter.unit]
    found = dict(powers(parameter.unit))
    if "N" not in found or not set(found) <= {"N", "m", "s", "kg"}:
        raise NoGuess(f"the unit {parameter.unit} of its {parameter.name} says nothing of its size")
    sizes = {"N": scales.force, "m": scales.position, "s": 1.0 / rate, "kg": scales.mass}
    return COEFFICIENT * math.prod(sizes[unit] ** power for unit, power in found.items())


def powers(unit: str) -> Iterator[tuple[str, int]]:
    """The units in a product such as N*s^2/m^2, with their powers."""
    for divided, name, power in re.findall(r"([*/]?)([A-Za-z]+)(?:\^(\d+))?", unit):
        yield name, (-1 if divided == "/" else 1) * int(power or 1)


def _inside(parameter: "Parameter", value: float) -> float:
    """The value, or its mirror image, within the parameter's bounds; else the middle of finite bounds, or the
    nearer bound."""
    low, high = parameter.bounds
    for one in (value, -value):
        if low <= one <= high:
            return one
    if math.isfinite(low) and math.isfinite(high):
        return 0.5 * (low + high)
    return 2.0 * low if math.isfinite(low) and low > 0.0 else low if math.isfinite(low) else high
