"""A motion in one direction shows no force of the position, and no hysteresis, in the balance of forces either."""

import numpy as np
import pytest
from axes import CATALOGUE, axis_model

from rhythmid.diagnose.effort.candidate import not_tried, starts_of
from rhythmid.diagnose.effort.scales import scales_of
from rhythmid.elements.candidates import NEVER_REVERSED, ONE_WAY
from rhythmid.identify.inverse_dynamics.balance import Balance
from rhythmid.record.record import Channel, Record

STEP = 0.005
TIME = STEP * np.arange(3000)


def record(lowest: float) -> Record:
    """An axis of 1 kg with 2 N s/m under a force between `lowest` and 8 N."""
    wave = 0.5 + 0.25 * (np.sin(2.0 * TIME) + np.sin(5.3 * TIME))
    force = lowest + (8.0 - lowest) * wave
    x, v, kept = 0.0, 1.0, []
    for one in force:
        kept.append(x)
        v += STEP * (one - 2.0 * v)
        x += STEP * v
    position = np.array(kept) + 1e-5 * np.random.default_rng(0).standard_normal(len(TIME))
    return Record("run", Channel(TIME, position, "m"), Channel(TIME, force, "N"))


@pytest.mark.parametrize(("lowest", "shown"), [(1.0, False), (-8.0, True)])
def test_a_spring_and_a_hysteresis_are_tried_where_the_motion_comes_back(lowest, shown):
    model = axis_model()
    balance = Balance.of([record(lowest)], model)
    sizes = scales_of(balance, model)
    tried = {one.name for one in starts_of(CATALOGUE, model, sizes, balance)}
    left = not_tried(CATALOGUE, model, sizes, balance)
    for name, why in (
        ("linear_spring", ONE_WAY),
        ("cubic_stiffness", ONE_WAY),
        ("bouc_wen_hysteresis", NEVER_REVERSED),
    ):
        assert (name in tried) == shown
        assert shown or left[name] == why
    assert "coulomb_friction" in tried
