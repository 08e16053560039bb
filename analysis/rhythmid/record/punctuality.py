"""Punctuality of the ROS graph during a recording, from its topic `run`, as far as it matters for the analysis."""

from collections.abc import Mapping
from typing import Any

# share of late messages above which they are reported: the 99th percentile of the lateness then exceeds a sample period
NOTABLE = 0.01
# stages that messages pass; where the command path holds messages until they are due, a late sender does not matter
_PATHS = {"commands": ("command_delay", "plant"), "measurements": ("measurement_delay",)}
_SENDER = "excitation"
_MEND = "use lockstep or a quieter machine"


def punctuality_notes(run: Mapping[str, Any] | None) -> tuple[str, ...]:
    """Messages about punctuality, one line each; empty for a punctual run and for a recording without timing data.

    Parameters
    ----------
    run : content of the topic `run`. `timing` has for each real-time stage of the path how many of its messages
        (`of`) were more than a sample period `late`, the longest delay of one [s] (`max`), and how many were
        `lost`.
    """
    timing = (run or {}).get("timing")
    if not isinstance(timing, Mapping):
        return ()
    found = []
    for what, path in _PATHS.items():
        if what == "commands" and not any(name in timing for name in path):
            path = (_SENDER,)
        stages = [timing[name] for name in path if isinstance(timing.get(name), Mapping)]
        worst = max(stages, key=lambda stage: _number(stage, "late"), default={})
        late, of = _number(worst, "late"), _number(worst, "of")
        if late > NOTABLE * of:
            by = f"up to {1e3 * _number(worst, 'max'):.3g} ms"
            found.append(f"{late:.0f} of {of:.0f} {what} were late, by {by}: {_MEND}")
    lost = _number(timing, "lost")
    if lost > 0:
        found.append(f"{lost:.0f} messages were lost: {_MEND}")
    return tuple(found)


def _number(values: Mapping[str, Any], name: str) -> float:
    """A number from an external document; 0 where it is no number."""
    value = values.get(name)
    return float(value) if isinstance(value, (int, float)) else 0.0
