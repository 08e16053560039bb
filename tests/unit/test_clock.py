"""The nodes' clock agrees with the system's however the process is interrupted while it is set."""

import time

from rhythmid_nodes.clock import Clock


def test_an_interruption_between_the_readings_of_both_clocks_does_not_shift_it(monkeypatch):
    """Every other reading is interrupted for 5 ms, the first one, too, as on a busy machine."""
    epoch, readings = time.time_ns, []

    def interrupted() -> int:
        readings.append(epoch())
        if len(readings) % 2:
            time.sleep(0.005)
        return readings[-1]

    monkeypatch.setattr(time, "time_ns", interrupted)
    clock = Clock()
    monkeypatch.undo()
    before = time.time_ns()
    now = clock.now()
    after = time.time_ns()
    assert before - 2_000_000 < now < after + 2_000_000
