"""Locations in the signal path at which elements act, in words."""

from collections.abc import Mapping

SENTENCES: Mapping[str, str] = {
    "command": "between the command u and the point where the forcing joins it",
    "actuator": "in the actuator, which turns forcing plus command into force",
    "force": "in the balance of forces on the mass",
    "sensor": "between the mass and the measurement",
    "timing": "in the clocks: stamps and delays that change",
}
