"""How records are scored: the free run where it follows the machine, windows where it does not, and what comes after those."""

from types import SimpleNamespace

import pytest

from machines import CATALOGUE, SHORT, hopper, records
from rhythmid.diagnose import diagnosis as module
from rhythmid.diagnose import scoring
from rhythmid.diagnose.diagnosis import diagnose
from rhythmid.diagnose.scoring import FREE_RUN, Scoring, settle
from rhythmid.identify.series import prepare


def scorings(amplitude: float) -> list[Scoring]:
    """How records with a disturbance of this amplitude [N] are scored, in order."""
    hum = {"amplitude": amplitude, "frequency": 2.7, "phase": 0.3}
    machine = hopper().with_element(CATALOGUE["periodic_disturbance"], hum)
    return list(settle(hopper(), prepare(records(machine, SHORT[:1])), [], CATALOGUE))


def test_a_free_run_that_follows_the_machine_is_all_there_is_and_it_is_said():
    (one,) = scorings(0.0)
    assert (one.kind, one.reason) == ("free_run", FREE_RUN)


def test_windows_come_before_a_free_run_that_is_far_off_and_alone_where_it_is_hopeless(monkeypatch):
    found = scorings(1.0)
    assert [one.kind for one in found] == ["windows", "free_run"]
    assert found[0].reason.startswith("windows of ") and found[0].error < found[1].error
    monkeypatch.setattr(scoring, "HOPELESS", 0.1)
    assert [one.kind for one in scorings(1.0)] == ["windows"]


def test_without_separate_records_the_last_part_of_every_run_is_held_out():
    (one,) = scorings(0.0)
    for series in one.calibration.series:
        assert series.hidden.any() and not (series.hidden & series.used).any()
        assert series.hidden[-1] and not series.hidden[0]


@pytest.mark.parametrize(
    ("verdicts", "kept"),
    [
        (["missing_physics", "unknown_physics"], 0),
        (["unknown_physics", "missing_physics"], 1),
        (["undecided", "unknown_physics"], 0),
    ],
)
def test_what_the_first_scoring_leaves_without_a_name_is_tried_in_the_second(monkeypatch, verdicts, kept):
    made = [SimpleNamespace(verdict=one, missing=()) for one in verdicts]
    left = list(made)
    fit = SimpleNamespace(fit=SimpleNamespace(model=hopper()))
    monkeypatch.setattr(module, "settle", lambda *_, **__: [SimpleNamespace(kind="windows")] * 2)
    monkeypatch.setattr(module, "free_run", lambda *_: SimpleNamespace(search=fit))
    monkeypatch.setattr(module, "compose", lambda *_: left.pop(0))
    assert diagnose(records(hopper(), SHORT[1:2]), hopper(), catalogue=CATALOGUE).diagnosis is made[kept]
    assert len(left) == (1 if kept == 0 and verdicts[0] == "missing_physics" else 0)
