"""Events of the live twin: the location of a change that has ended is that of the windows during it."""

import pytest
from live_machine import CHANGED, LIFT, at_work

from rhythmid.elements.catalogue import load_catalogue
from rhythmid.model import Model
from rhythmid.twin.events import Events
from rhythmid.twin.isolation import Isolation, Sized
from rhythmid.twin.settings import Settings
from rhythmid.twin.twin import Status, Twin

WHERE = {
    slot: Isolation(slot, (), {slot: 0.9}, (Sized("change", slot, 1.0, 0.1, "N", 9.0),), 1.0)
    for slot in ("force", "sensor", "unknown")
}
SEGMENT = 0.2  # s


def told(*parts: tuple[float, str, float]) -> Events:
    """Events after parts of (duration [s], slot that is named, statistic), and then the end of the mismatch."""
    events, now = Events(), 0.0
    for duration, slot, mismatch in parts:
        for _ in range(round(duration / SEGMENT)):
            now += SEGMENT
            events.take(Status(now, "warn", mismatch, since=SEGMENT, isolation=WHERE[slot]))
    return events


@pytest.mark.parametrize("duration", [2.0, 12.0, 100.0])
def test_an_ended_event_keeps_the_slot_of_its_duration(duration):
    events = told((duration, "force", 50.0), (5.8, "unknown", 5.0), (2.0, "sensor", 0.5))
    assert events.current.isolation.slot == "force"  # before the mismatch counts as ended
    events.take(Status(1e3, "ok", 0.1))
    (event,) = events.found
    assert event.isolation.slot == "force" and event.peak == 50.0
    assert event.until == pytest.approx(duration + 5.8)


def test_a_lasting_event_is_located_by_its_newest_window():
    assert told((10.0, "force", 50.0), (1.0, "sensor", 50.0)).current.isolation.slot == "sensor"


def test_late_messages_take_the_slot_from_no_event():
    events = told((10.0, "force", 50.0))
    events.take(Status(10.2, "warn", since=SEGMENT))
    assert events.current.isolation.slot == "force"


def test_friction_that_doubles_for_a_while_is_told_with_its_size():
    model = Model.from_text(LIFT, catalogue=load_catalogue())
    signals = at_work(model, 0.0, 31.0)
    for machine, until, seed in ((CHANGED["friction"](model), 36.0, 1), (model, 52.0, 2)):
        signals = signals.then(at_work(machine, signals.time[-1], until, signals.end, seed=seed))
    twin, events = Twin(model, Settings(healthy=20.0)), Events()
    for first in range(0, len(signals.time), 250):
        part = slice(first, first + 250)
        for role, time, value in signals.channels:
            if role in twin.samples:
                twin.push(role, time[part], value[part])
        for status in twin.advance():
            events.take(status)
    (event,) = events.found
    assert event.until is not None and event.isolation is not None
    best = event.isolation.changes[0]
    assert (event.isolation.slot, best.name) == ("force", "coulomb_friction.force")
    assert best.size == pytest.approx(1.0, rel=0.25)
