"""How records are scored: the free run where it follows the machine, windows where it does not, and what comes after those."""

from types import SimpleNamespace

import pytest

from machines import CATALOGUE, SHORT, hopper, records
from rhythmid.diagnose import diagnosis as module
from rhythmid.diagnose import scoring
from rhythmid.diagnose.diagnosis import diagnose
from rhythmid.diagnose.scoring import FREE_RUN, settle
from rhythmid.identify.series import prepare
from rhythmid.model import Model


def ways(amplitude: float) -> list[str]:
    """How records with a disturbance of this amplitude [N] are scored, in order."""
    hum = {"amplitude": amplitude, "frequency": 2.7, "phase": 0.3}
    machine = hopper().with_element(CATALOGUE["periodic_disturbance"], hum)
    series = prepare(records(machine, SHORT[:2]))
    return [way.words.split(" of ")[0] for way in settle(hopper(), series, [], CATALOGUE)]


def test_a_free_run_that_follows_the_machine_is_all_there_is():
    assert ways(0.0) == ["free run"]


def test_windows_come_before_a_free_run_that_is_far_off_and_alone_where_it_is_hopeless(monkeypatch):
    assert ways(1.0) == ["windows", "free run"]
    monkeypatch.setattr(scoring, "HOPELESS", 0.4)
    assert ways(1.0) == ["windows"]


@pytest.mark.parametrize(
    ("verdicts", "kept"),
    [
        (["missing_physics", "unknown_physics"], 0),
        (["unknown_physics", "missing_physics"], 1),
        (["undecided", "unknown_physics"], 0),
        (["unknown_physics told", "missing_physics"], 0),
    ],
)
def test_what_the_first_way_leaves_without_a_name_is_tried_the_second(monkeypatch, verdicts, kept):
    answers = [
        SimpleNamespace(
            diagnosis=SimpleNamespace(verdict=one.split()[0]), mistaken="told" if "told" in one else None
        )
        for one in verdicts
    ]
    left = list(answers)
    monkeypatch.setattr(module, "settle", lambda *_: [SimpleNamespace(words=FREE_RUN)] * 2)
    monkeypatch.setattr(module, "_diagnosed", lambda *_: left.pop(0))
    given: Model = hopper()
    assert diagnose(records(given, SHORT[1:2]), given, catalogue=CATALOGUE) is answers[kept]
    assert len(left) == (1 if verdicts[0] == "missing_physics" or "told" in verdicts[0] else 0)
