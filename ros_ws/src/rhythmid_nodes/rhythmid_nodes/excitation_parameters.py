"""Parameters of the node `excitation`."""

from __future__ import annotations

import math

from .command import STAMPED, TYPES
from .node import SAMPLED
from .parameters import Parameter
from .watch_parameters import PARAMETERS as WATCHED

_FAR = math.inf
PARAMETERS = (
    *SAMPLED,
    Parameter("excitation", "", "what to play, in JSON: the `excitation` of an experiment file"),
    Parameter("folder", ".", "where file names in it start"),
    Parameter("max_effort", 0.0, "largest |u|; what exceeds it is clamped", "N", (0.0, _FAR)),
    Parameter("ramp", 0.0, "fading in at the start and out at the end or on stop", "s", (0.0, 3600.0)),
    *WATCHED,
    Parameter("command_type", STAMPED, "message type of the commands", choices=tuple(TYPES)),
    Parameter("command_topic", "excitation", "topic of the commands"),
    Parameter("command_joints", None, "order of a Float64MultiArray's joints; not given: the one joint", items=str),
    Parameter("run", "{}", "JSON published on `run`"),
    Parameter("subscribers", 1, "subscribers of the commands to wait for before starting", "", (0, 1000)),
    Parameter("unattended", False, "start as soon as ready and end the process a second after the last sample"),
    Parameter("recorder", "recorder", "node that records: an unattended start waits until it is active, and who loses it fades out; empty: none"),
    Parameter("consumers", ["plant", "recorder"], "lockstep: nodes whose announcements the excitation waits for"),
)  # fmt: skip
