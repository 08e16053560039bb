"""Cautions: reasons to doubt an estimate, each with the question that settles the doubt."""

from dataclasses import asdict, dataclass
from typing import Any, Literal

Name = Literal[
    "not_identified", "other_unit", "large_shift", "value_at_zero", "long_delay", "negative_delay", "half_interval"
]  # fmt: skip

GIVEN_VALUES = "Are the values that the model is given near the machine's? If so, `rhythmid diagnose` names the physics that it lacks."


@dataclass(frozen=True)
class Caution:
    """A doubt in words and the `question` that settles it, with the parameter, its estimate and its nominal value."""

    name: Name
    text: str
    question: str
    parameter: str | None = None
    value: float | None = None
    nominal: float | None = None
    unit: str | None = None

    def to_dict(self) -> dict[str, Any]:
        return asdict(self)


def not_identified(motion: float, response: float | None) -> Caution:
    """The fit leaves too much of the `motion`, or of the `response` to the command, unexplained (shares of the rms)."""
    left = f"{100.0 * motion:.0f} % of the motion" if motion < 1.0 else "more than all of the motion"
    if response is not None:
        left = f"{100.0 * min(response, 9.99):.0f} % of the response to the command"
    return Caution(
        "not_identified",
        f"not identified: the fit leaves {left} unexplained, so none of its values can be used",
        GIVEN_VALUES,
    )


def none_told() -> Caution:
    """A fit that follows the motion whatever its values: the records tell none of them."""
    return Caution(
        "not_identified",
        "not identified: the model follows the records, but they determine none of its values, which could be others as well",
        "Does what drives the machine change enough while it moves? `rhythmid design` proposes an excitation.",
    )


def other_unit(text: str) -> Caution:
    """All values are shifted in the way that another unit of a channel would shift them."""
    return Caution("other_unit", text, "In which unit was the channel recorded?")
