"""The part of a motion in which a hand holds, pushes or throws the machine is told from the part in which it is free."""

import numpy as np
import pytest

from rhythmid.record.free_motion import freed
from rhythmid.record.record import Channel, Record
from rhythmid.record.rest_at_ends import rests_of

PERIOD = 0.002  # s
TIME = PERIOD * np.arange(4000)


def thrown(until: float, held: float = 0.0, friction: float = 0.2) -> np.ndarray:
    """Angle and speed (n, 2) of a pendulum that a hand pushes from `held` [s] on until a time [s]."""
    angle, speed, found = -1.0, 0.0, []
    for time in TIME:
        push = -130.0 if held <= time < until else 0.0
        found.append((angle, speed))
        speed += 0.0 if time < held else PERIOD * (push - 100.0 * np.sin(angle) - friction * speed)
        angle += PERIOD * speed
    return np.array(found)


def record(value: np.ndarray, kind: str = "position", drive: np.ndarray | None = None) -> Record:
    given = None if drive is None else Channel(TIME, drive, "V")
    return Record("swing", Channel(TIME, value, "rad"), input=given, output_kind=kind)


@pytest.mark.parametrize(("place", "kind"), [(0, "position"), (1, "velocity")])
def test_a_push_at_the_start_is_told_and_the_motion_begins_after_it(place, kind):
    noise = 1e-3 * np.random.default_rng(0).standard_normal(len(TIME))
    found = freed(record(thrown(0.1)[:, place] + noise, kind))
    assert found is not None and found.pushed and 0.1 <= found.until < 0.3 and found.until < found.begin < 0.6
    (said,) = rests_of(record(thrown(0.1)[:, place] + noise, kind))
    assert "it gains speed until t = " in said and f"use: [{found.begin:.3g}" in said


def test_a_push_after_a_rest_is_told():
    found = freed(record(thrown(1.1, held=1.0)[:, 0]))
    assert found is not None and found.pushed and found.begin > found.until > 1.05


def test_a_machine_that_coasts_after_a_push_is_free_from_its_largest_speed_on():
    speed = np.where(TIME < 2.0, 5.0 * np.clip(TIME - 1.0, 0.0, 1.0), np.maximum(5.0 - (TIME - 2.0), 0.0))
    found = freed(record(speed, "velocity", np.zeros(len(TIME))))
    assert found is not None and found.begin == pytest.approx(2.0, abs=0.1)


@pytest.mark.parametrize("friction", [0.0, 0.2, 5.0])
def test_a_swing_that_is_free_from_its_first_sample_on_has_no_push(friction):
    assert freed(record(thrown(0.0, friction=friction)[:, 0])) is None


@pytest.mark.parametrize("value", [3.0, -1.0])
def test_a_recorded_drive_explains_a_push(value):
    drive = np.where(TIME < 0.1, value, 0.0)
    assert freed(record(thrown(0.1)[:, 0], drive=drive)) is None


def test_a_motion_that_gains_speed_again_and_again_is_not_a_push():
    growing = np.exp(0.3 * TIME) * np.cos(10.0 * TIME)
    assert freed(record(growing)) is None


def coasting(until: float, held: float = 0.5) -> np.ndarray:
    """Angle (n,) of a wheel that is driven from `held` [s] until a time [s] and then coasts to rest."""
    speed = np.where(TIME < until, 20.0 * np.clip(TIME - held, 0.0, None), 0.0)
    speed += np.where(TIME >= until, 20.0 * (until - held) * np.exp(-(TIME - until)), 0.0)
    return np.cumsum(speed) * PERIOD


@pytest.mark.parametrize("held", [0.0, 0.5])
def test_an_angle_that_is_driven_and_then_coasts_is_free_from_its_largest_speed_on(held):
    found = freed(record(coasting(1.5, held)))
    assert found is not None and found.pushed and found.begin == pytest.approx(1.5, abs=0.1)
    (said,) = rests_of(record(coasting(1.5, held)))
    assert "it gains speed until t = " in said


def test_half_a_swing_and_a_fall_are_free_from_their_first_sample_on():
    assert freed(record(np.cos(np.pi * TIME / TIME[-1]))) is None
    assert freed(record(4.9 * TIME**2)) is None


def pushed_again(first: float, again: float) -> np.ndarray:
    """Angle (n,) of a pendulum that a hand pushes at two times [s]."""
    angle, speed, found = 0.0, 0.0, []
    for time in TIME:
        push = -130.0 if any(begin <= time < begin + 0.1 for begin in (first, again)) else 0.0
        found.append(angle)
        speed += PERIOD * (push - 100.0 * np.sin(angle) - 0.2 * speed)
        angle += PERIOD * speed
    return np.array(found)


def test_of_a_motion_that_is_pushed_again_the_longest_part_between_two_pushes_is_free():
    found = freed(record(pushed_again(0.5, 6.0)))
    assert found is not None and found.pushed and 0.6 <= found.begin < 1.0
    assert found.end is not None and 5.0 < found.end <= 6.0
    said = " ".join(rests_of(record(pushed_again(0.5, 6.0))))
    assert "it gains speed again after t = " in said and f", {found.end:.3f}]" in said


def test_a_swing_by_hand_before_the_release_is_no_part_of_the_free_motion():
    lifted = 0.03 * np.sin(12.0 * TIME) * (TIME < 1.0) - 0.5 * (
        1.0 - np.cos(np.pi * np.clip(TIME - 1.0, 0.0, 1.0))
    )
    free = np.interp(TIME - 2.0, TIME, thrown(0.0)[:, 0])
    found = freed(record(np.where(TIME < 2.0, lifted, free)))
    assert found is not None and found.pushed and 2.0 <= found.begin < 2.3 and found.end is None
