"""Parameters of the nodes that watch a machine's measurements."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from rhythmid.errors import InputError

from .parameters import Parameter
from .watch import Limits

_FAR = math.inf
PARAMETERS = (
    Parameter("stale_after", 0.5, "realtime: stop when the newest measurement is older, by arrival or stamp; 0: never", "s", (0.0, _FAR)),
    Parameter("envelope", [-_FAR, _FAR], "realtime: stop when the position leaves [low, high], in position_unit"),
    Parameter("max_speed", _FAR, "realtime: stop when the machine is faster, in position_unit/s", "", (0.0, _FAR)),
    Parameter("position_unit", "m", "unit of positions and of these limits, for messages: m, or rad of a rotary joint"),
    Parameter("frozen_after", 0.0, "realtime: stop when the position stays exactly the same for so long; 0: never", "s", (0.0, _FAR)),
    Parameter("max_gap", 0.0, "realtime: stop when stamps step by more; 0: as stale_after", "s", (0.0, _FAR)),
    Parameter("measurement_clock", "system", "clock of the stamps: this system's, or another one", choices=("system", "other")),
)  # fmt: skip


def limits(values: Mapping[str, Any]) -> Limits:
    """The limits from the values of `PARAMETERS`. Raises InputError for an invalid envelope."""
    envelope = values["envelope"]
    if len(envelope) != 2 or not envelope[0] < envelope[1]:
        raise InputError(f"parameter envelope = {envelope}: two positions low < high are expected")
    low, high = envelope
    return Limits(
        values["stale_after"], low, high, values["max_speed"], values["frozen_after"], values["max_gap"],
        values["measurement_clock"] == "other", values["position_unit"],
    )  # fmt: skip
