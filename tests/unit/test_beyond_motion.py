"""A change with time is told from a law of the motion only where the motion comes again."""

import math

import numpy as np
import pytest
from axes import CATALOGUE, axis_model

from rhythmid.diagnose.effort.beyond_motion import changes_with_time
from rhythmid.diagnose.effort.search import search_effort
from rhythmid.diagnose.rejections import keeps_shape
from rhythmid.record.record import Channel, Record

STEP = 5e-3
ASYMMETRY = 0.2


def stepped(turns: int, friction: float, fade: float = 0.0) -> Record:
    """An axis of 1 kg with 2 N s/m and friction that differs by direction, driven to and fro by 4 N, at rest in between."""
    fine, every = 5e-4, 10
    length = 10.0 / turns
    count = round(10.0 / fine)
    x = v = 0.0
    kept = []
    for index in range(count):
        at = index * fine
        phase = (at % length) / length
        force = 4.0 if 0.1 < phase < 0.4 else -4.0 if 0.6 < phase < 0.9 else 0.0
        if index % every == 0:
            kept.append((at, x, v, force))
        dry = friction * (1.0 + math.copysign(ASYMMETRY, v)) * math.tanh(v / 1e-2)
        v += fine * ((1.0 - fade * at) * force - 2.0 * v - dry)
        x += fine * v
    time, position, speed, effort = np.array(kept).T
    rng = np.random.default_rng(turns)
    noisy = position + 1e-5 * rng.standard_normal(len(time))
    return Record(
        "stepped", Channel(time, noisy, "m"), Channel(time, effort, "N"),
        velocity=Channel(time, speed + 1e-4 * rng.standard_normal(len(time)), "m/s"), hold="zero",
    )  # fmt: skip


def fades(record: Record) -> tuple[float, bool]:
    """The statistic of a fading actuator, and whether it is believed to be one."""
    few = ("actuator_fade", "coulomb_friction", "asymmetric_coulomb_friction")
    known = CATALOGUE.without(*(name for name in CATALOGUE if name not in (*few, "viscous_damper")))
    found = search_effort([record], axis_model(), known, most=1)
    both = [one for one in (*found.hypotheses, *found.ruled_out) if one.elements == ("actuator_fade",)]
    return both[0].shape["more_than_motion"], keeps_shape(both[0].shape)


def test_friction_by_direction_in_one_turn_is_no_fading_actuator():
    statistic, kept = fades(stepped(1, 0.8))
    assert statistic < 0.01 and not kept


def test_a_fading_actuator_that_drives_many_turns_is_one():
    statistic, kept = fades(stepped(8, 0.0, 0.03))
    assert statistic > 0.2 and kept


@pytest.mark.parametrize(
    ("name", "values", "changes"),
    [
        ("actuator_fade", {"rate": 0.01}, True),
        ("periodic_disturbance", {"amplitude": 1.0, "frequency": 0.3, "phase": 0.0}, True),
        ("coulomb_friction", {"force": 1.0, "transition": 0.01}, False),
        ("actuator_lag", {"time_constant": 0.1}, False),
    ],
)
def test_an_effect_changes_with_time_where_its_law_says_so(name, values, changes):
    assert changes_with_time(CATALOGUE[name], values, axis_model()) is changes
