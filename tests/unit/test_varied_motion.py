"""The next experiment for an effort that no name explains says which motion to record, in words of a control engineer."""

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from rhythmid.diagnose.answer.compose_effort import motion_varying
from rhythmid.diagnose.effort.reference import HISTORY
from rhythmid.diagnose.effort.remainder import remainder_of

N = 200
TIME = np.linspace(0.0, 1.0, N)
BALANCE: Any = SimpleNamespace(
    motions=(SimpleNamespace(time=TIME, others={"elbow": np.cos(TIME)}),), places=(slice(None),),
    mechanical=np.stack([TIME, np.sin(TIME), np.cos(TIME)], axis=1), measured=np.zeros(N),
)  # fmt: skip
FITTED: Any = SimpleNamespace(fit=SimpleNamespace(residual=np.random.default_rng(0).standard_normal(N)))
QUANTITIES = [one.quantity for one in remainder_of(cast(Any, BALANCE), cast(Any, FITTED))]


@pytest.mark.parametrize("quantity", [*QUANTITIES, HISTORY])
def test_every_quantity_of_a_remainder_has_a_motion_that_varies_it(quantity):
    told = motion_varying(quantity)
    motion, why = told.rsplit(": ", 1)
    assert why == f"the effort that is left depends on {quantity}"
    assert (
        any(word in motion for word in ("speed", "acceleration", "load", "motion"))
        and "alone over" not in motion
    )


def test_motions_of_different_quantities_differ():
    motions = [motion_varying(one).rsplit(": ", 1)[0] for one in (*QUANTITIES, HISTORY)]
    assert len(set(motions)) == len(motions) == 7
    assert "elbow moved alone" in motion_varying("the velocity of elbow")
