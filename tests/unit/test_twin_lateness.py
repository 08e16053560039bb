"""The live twin on a busy machine: messages that were late are no change of physics, and a change between them is told."""

from collections.abc import Callable

import numpy as np
import pytest
from live_machine import CHANGED, LIFT, at_work
from machines_at_work import RATE, Stretch

from rhythmid.errors import InputError
from rhythmid.model import Model
from rhythmid.twin.lateness import LOOK, Doubt, lateness, possible_lateness
from rhythmid.twin.released import Released
from rhythmid.twin.settings import Settings
from rhythmid.twin.twin import Status, Twin

HEALTHY, WATCHED, CHANGE = 25.0, 20.0, 15.0  # s; the change comes after so much of what is watched
SETTINGS = Settings(healthy=HEALTHY)
STALLS = ((11.3, 0.045), (12.6, 0.06), (13.1, 0.03), (13.9, 0.05))  # s since the healthy stretch, and length
Late = Callable[[np.ndarray], np.ndarray]


def stalled(stalls: tuple[tuple[float, float], ...], begin: float) -> Late:
    """How late what is due at some times [s] comes, when a relay stands still now and then and passes on all at once after that."""

    def late(time: np.ndarray) -> np.ndarray:
        found = np.zeros(len(time))
        for at, length in stalls:
            left = begin + at + length - time
            found = np.where((left > 0.0) & (left <= length), left, found)
        return found

    return late


def healthy() -> tuple[Model, Stretch]:
    model = Model.from_text(LIFT)
    return model, at_work(model, 0.0, HEALTHY + 1.5)


@pytest.fixture(scope="module")
def learnt():
    """The lift, a calibration of it, and the stretch that was learnt from."""
    model, signals = healthy()
    twin = Twin(model, SETTINGS)
    for role, time, value in signals.channels:
        twin.push(role, time, value)
    twin.advance()
    assert twin.calibration is not None
    return model, twin.calibration, signals


def watched(learnt, measured: Late, commanded: Late, tell: bool, change: str | None = None) -> list[Status]:
    """What a twin says of a machine whose measurements and commands are late; with `tell` it hears when commands were released."""
    model, calibration, signals = learnt
    begin = float(signals.time[-1])
    at = begin + CHANGE
    machine = model if change is None else CHANGED[change](model)
    before = at_work(model, begin, at, signals.end, seed=1, late=commanded)
    after = at_work(machine, at, begin + WATCHED, before.end, seed=2, late=commanded)
    whole = before.then(after)
    twin = Twin(model, SETTINGS, calibration=calibration, released=tell)
    told = np.maximum.accumulate(whole.stamp + measured(whole.stamp)) + 1e-9 * np.arange(len(whole.stamp))
    twin.push("input", whole.time, whole.command)
    twin.push("forcing", whole.time, whole.forcing)
    twin.push("output", told, whole.measured)
    if tell:
        due = whole.time + model.value("input_delay.delay")
        release = np.maximum.accumulate(due + commanded(whole.time)) + 1e-9 * np.arange(len(due))
        twin.push("released", release, whole.command)
    return twin.advance()


def punctual(time: np.ndarray) -> np.ndarray:
    return np.zeros(len(time))


def test_measurements_that_were_passed_on_late_raise_no_alarm(learnt, monkeypatch):
    begin = float(learnt[2].time[-1])
    said = watched(learnt, stalled(STALLS, begin), punctual, False)
    assert len(said) > 30 and all(status.since is None for status in said)
    monkeypatch.setattr(Doubt, "of", lambda stamps, late, first, end: Doubt(0.0 * late[first:end], 0.0))
    assert any(
        status.since is not None for status in watched(learnt, stalled(STALLS, begin), punctual, False)
    )


def test_commands_that_were_released_late_raise_no_alarm_where_their_release_is_told(learnt):
    begin = float(learnt[2].time[-1])
    late = stalled(STALLS, begin)
    said = watched(learnt, punctual, late, True)
    assert len(said) > 30 and all(status.since is None for status in said)
    assert any(status.since is not None for status in watched(learnt, punctual, late, False))


def test_a_change_of_physics_between_late_messages_is_told(learnt):
    begin = float(learnt[2].time[-1])
    late = stalled(STALLS, begin)
    said = watched(learnt, late, late, True, "friction")
    assert all(status.since is None for status in said if status.time < begin + CHANGE)
    assert (
        said[-1].since is not None and said[-1].isolation is not None and said[-1].isolation.slot == "force"
    )


def test_a_machine_whose_messages_are_always_late_is_told_to_be_late_and_none_is_learnt_from_it(learnt):
    begin = float(learnt[2].time[-1])
    always = tuple((0.1 * k, 0.08) for k in range(200))
    said = watched(learnt, stalled(always, begin), punctual, False)
    assert {status.level for status in said[5:]} == {"late"}
    model, signals = healthy()
    twin = Twin(model, SETTINGS)
    late = np.maximum.accumulate(
        signals.stamp + stalled(tuple((0.1 * k, 0.08) for k in range(270)), 0.0)(signals.stamp)
    )
    for role, time, value in signals.channels:
        told = late + 1e-9 * np.arange(len(late)) if role == "output" else time
        twin.push(role, told, value)
    with pytest.raises(InputError, match="came too late"):
        twin.advance()


def test_lateness_is_that_behind_the_grid_of_what_follows_and_a_gap_is_doubt():
    stamps = np.arange(1000) / 1000.0
    late = stalled(((0.3, 0.04),), 0.0)(stamps)
    stamps = np.maximum.accumulate(stamps + late) + 1e-9 * np.arange(1000)
    np.testing.assert_allclose(lateness(stamps, 1e-3), late, atol=2e-6)
    assert possible_lateness(stamps, 1e-3).max() == pytest.approx(0.04, abs=2e-3)
    gap = np.delete(np.arange(1000) / 1000.0, np.arange(500, 600))
    assert lateness(gap, 1e-3).max() < 1e-9
    doubt = possible_lateness(gap, 1e-3)
    np.testing.assert_allclose(doubt[[0, 499, 500, -1]], [0.0, 0.1, 0.1, 0.0], atol=1e-9)
    assert 0.0 < Doubt.of(gap, doubt, 500 + int(0.9 * LOOK * 1000), 800).rms < 0.1


def test_commands_are_told_once_in_order_and_without_their_release_after_a_while():
    commands = Released(0.01)
    time = np.arange(int(2.0 * RATE)) / RATE
    commands.given.append(time, time)
    first, _ = commands.take(-np.inf)
    assert len(first) == 0
    late = stalled(((0.5, 0.05),), 0.0)(time)
    commands.released.append(np.maximum.accumulate(time + 0.01 + late) + 1e-9 * np.arange(len(time)), time)
    some, _ = commands.take(-np.inf)
    rest, values = commands.take(10.0)
    told = np.concatenate([some, rest])
    assert len(told) == len(time) and np.all(np.diff(told) > 0.0) and values[-1] == time[-1]
    np.testing.assert_allclose(told, np.maximum.accumulate(time + late), atol=1e-5)
