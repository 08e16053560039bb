"""`rhythmid watch` into a file: a line for each event, and one at the end."""

from diagnostic_msgs.msg import DiagnosticStatus, KeyValue

from rhythmid_bringup.watch_lines import WatchLines

OK, WARN, ERROR = DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.ERROR
HEALTHY = "the machine does what its model does"


def model(level, message, **values):
    pairs = [KeyValue(key=key.replace("_", " "), value=value) for key, value in values.items()]
    return {"rhythmid: arm/twin/model": DiagnosticStatus(level=level, message=message, values=pairs)}


def test_each_event_is_one_line_when_it_is_confirmed_and_one_when_it_has_ended():
    lines, said = WatchLines(), []
    ended = {"mismatches_ended": "1", "last_mismatch": "from 1.0 s to 20.0 s: in force"}
    for newest in (
        {}, model(OK, "learning"), model(OK, "learning"), model(OK, HEALTHY), model(WARN, "left: in sensor"),
        model(WARN, "left: in force"), model(ERROR, "left: in force"), model(ERROR, "left: in force, 98 %"),
        model(OK, HEALTHY, **ended), model(OK, HEALTHY, **ended),
    ):  # fmt: skip
        said += lines.take(newest)
    assert said == [
        "learning", HEALTHY, "mismatch: left: in force", "mismatch ended: from 1.0 s to 20.0 s: in force", HEALTHY,
    ]  # fmt: skip
    assert lines.end() == f"watch ended; mismatches that have ended: 1; now: {HEALTHY}"


def test_a_signal_without_stamps_is_named_once():
    twin = DiagnosticStatus(
        values=[KeyValue(key="/arm/effort without stamps", value="its lateness cannot be seen")]
    )
    lines = WatchLines()
    assert lines.take({"rhythmid: arm/twin": twin}) == [
        "/arm/effort without stamps: its lateness cannot be seen"
    ]
    assert lines.take({"rhythmid: arm/twin": twin}) == []


def test_a_twin_that_was_never_heard_is_told_at_the_end():
    assert "nothing was heard from the twin" in WatchLines().end()
