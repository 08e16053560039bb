"""What all dead times inside a loop share: an element that acts on the past of a signal, so that its delay has to be simulated."""

from typing import Any

from rhythmid.elements.element import LONGEST_DEAD_TIME, Parameter, Scales

FRACTIONS = (0.01, 0.05)  # of a radian of the machine's own motion: first guesses of what turns its phase


def _starts(scales: Scales) -> list[dict[str, float]]:
    return [{"delay": fraction / scales.natural_frequency} for fraction in FRACTIONS]


def dead_time(description: str) -> dict[str, Any]:
    """Arguments of an `Element` whose one parameter is a dead time; `description` says of what."""
    return {
        "parameters": (Parameter("delay", "s", description, bounds=(0.0, LONGEST_DEAD_TIME)),),
        "dead_time": "delay",
        "size": "delay",
        "controlled": True,
        "starts": _starts,
        "family": "dead time",
    }
