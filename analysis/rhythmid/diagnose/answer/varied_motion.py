"""The motion to record next where an effort that no name explains depends on one quantity: it varies this one alone."""

from rhythmid.diagnose.effort.reference import HISTORY
from rhythmid.diagnose.effort.remainder import SPEED_OF

# each varies its quantity over the whole range and leaves the others as they are, so that they cannot stand for it
MOTIONS = {
    "velocity": "constant speeds from the slowest to the fastest, in both directions, over the same travel and with the same load",
    "position": "one slow constant speed over the whole travel, there and back, with the same load",
    "acceleration": "the same path at several accelerations up to the largest, with the same load",
    "load": "the same motion with several loads, from none to the largest",
    "time": "the same short motion from a cold start, repeated until the effort no longer changes",
    HISTORY: "reversals after short and after long strokes, at a slow and at a fast speed, with the same load",
}


def motion_varying(quantity: str) -> str:
    """The motion that varies the quantity of a remaining effort, as `remainder_of` or a map names it, and why."""
    if quantity.startswith(SPEED_OF):
        other = quantity.removeprefix(SPEED_OF)
        motion = f"{other} moved alone at several constant speeds while this joint is held"
    else:
        motion = MOTIONS[quantity]
    return f"{motion}: the effort that is left depends on {quantity}"
