"""Common properties of all dead times inside a loop: elements that act on the past of a signal, so that their delay
is simulated."""

from typing import Any

from rhythmid.elements.element import LONGEST_DEAD_TIME, Parameter, Scales

FRACTIONS = (0.01, 0.05)  # [rad] phase shift of the machine's own motion by the first guesses


def _starts(scales: Scales) -> list[dict[str, float]]:
    return [{"delay": fraction / scales.natural_frequency} for fraction in FRACTIONS]


def dead_time(description: str) -> dict[str, Any]:
    """Arguments of an `Element` whose one parameter is a dead time; `description` is the parameter's."""
    return {
        "parameters": (Parameter("delay", "s", description, bounds=(0.0, LONGEST_DEAD_TIME)),),
        "dead_time": "delay",
        "size": "delay",
        "controlled": True,
        "starts": _starts,
        "family": "dead time",
    }
