"""A change with time and a law of the motion: each is found where it is the true one."""

import math

import numpy as np
from axes import CATALOGUE, axis_model

from rhythmid.diagnose.effort.search import search_effort
from rhythmid.record.record import Channel, Record

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


def chosen(record: Record) -> tuple[str, ...]:
    """The effect that the search chooses among a fading actuator and dry frictions."""
    few = ("actuator_fade", "coulomb_friction", "asymmetric_coulomb_friction")
    known = CATALOGUE.without(*(name for name in CATALOGUE if name not in (*few, "viscous_damper")))
    return search_effort([record], axis_model(), known, most=1).chosen.elements


def test_friction_by_direction_in_one_turn_is_no_fading_actuator():
    assert chosen(stepped(1, 0.8)) == ("asymmetric_coulomb_friction",)


def test_a_fading_actuator_that_drives_many_turns_is_one():
    assert chosen(stepped(8, 0.0, 0.03)) == ("actuator_fade",)
