"""A step of the effort that was made as a record began: it stands still for the whole record."""

from collections.abc import Sequence

import numpy as np

from rhythmid.record.inventory import Recorded
from rhythmid.start.joint import Joint
from rhythmid.start.meaning import meaning_of

BEFORE = "it never changes: taken for a step that was made as the record began; without it, delete this input"


def step_before(constant: Sequence[Recorded], joint: Joint) -> Recorded | None:
    """The one effort, by its name or unit, among what stands still at another value than zero; None where there is none or several."""
    efforts = [
        one for one in constant
        if (meaning := meaning_of(one)).quantity == "effort" and meaning.certain and joint.includes(one, meaning) and _is_known(one)
    ]  # fmt: skip
    return efforts[0] if len(efforts) == 1 else None


def _is_known(one: Recorded) -> bool:
    """Whether it has a value, which is not zero."""
    return bool(np.isfinite(one.value).all() and one.value[:1].any())
