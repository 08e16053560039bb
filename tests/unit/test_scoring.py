"""How records are scored: the free run where it follows the machine, windows where it does not, and what comes after those."""

from dataclasses import replace
from types import SimpleNamespace

import pytest
from answers import diagnosed

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
    made = [diagnosed(one) for one in verdicts]
    left = list(made)
    fit = SimpleNamespace(fit=SimpleNamespace(model=hopper()))
    monkeypatch.setattr(module, "settle", lambda *_, **__: [SimpleNamespace(kind="windows")] * 2)
    monkeypatch.setattr(module, "free_run", lambda *_: SimpleNamespace(search=fit))
    monkeypatch.setattr(module, "compose", lambda *_: left.pop(0))
    found = diagnose(records(hopper(), SHORT[1:2]), hopper(), catalogue=CATALOGUE).diagnosis
    assert replace(found, notes=()) == made[kept]
    assert len(left) == (1 if kept == 0 and verdicts[0] == "missing_physics" else 0)


def tried(monkeypatch: pytest.MonkeyPatch, *errors: float) -> tuple[list[float], list[float]]:
    """Errors, as shares of the motion, of the ways to score that come out of a free run and ever shorter windows of these errors; and
    those that were tried."""
    asked: list[float] = []

    def calibrated(_model, error, *_):
        asked.append(error)
        fit = SimpleNamespace(error=error, nrmse=lambda: error)
        return SimpleNamespace(fit=fit, reconstructed=False)

    def ladder(*_):
        for number, error in enumerate(errors):
            yield SimpleNamespace(
                kind="windows" if number else "free_run", reason="", of=lambda _, error=error: error
            )

    monkeypatch.setattr(scoring, "_ladder", ladder)
    monkeypatch.setattr(scoring, "calibrate", calibrated)
    monkeypatch.setattr(scoring, "_error", lambda fit: fit.error)
    monkeypatch.setattr(scoring, "hold_out_tail", lambda cut: (cut, ()))
    found = settle(hopper(), [], [], CATALOGUE)
    return [one.error for one in found], asked


@pytest.mark.parametrize(
    ("errors", "asked"),
    [
        ((0.7, 0.66, 0.64, 0.4), 3),  # two steps that lower it by less than a tenth: no more are tried
        ((0.7, 0.62, 0.55, 0.4), 4),
        ((0.7, 0.66, 0.5, 0.4), 4),  # one such step is passed over
        ((0.7, 0.25, 0.1), 2),  # it follows the machine
    ],
)
def test_windows_are_made_shorter_as_long_as_that_lowers_the_error(monkeypatch, errors, asked):
    assert len(tried(monkeypatch, *errors)[1]) == asked


@pytest.mark.parametrize(
    ("errors", "kept"),
    [
        ((0.7, 0.5), [0.7]),  # windows do not lower it by enough: no error that adds up
        ((0.7, 0.4), [0.4, 0.7]),
        ((0.9, 0.5), [0.5]),  # a free run that is hopeless says nothing
        ((0.25, 0.1), [0.25]),
    ],
)
def test_windows_are_the_way_to_score_where_they_lower_the_error_to_less_than_60_percent(
    monkeypatch, errors, kept
):
    assert tried(monkeypatch, *errors)[0] == kept
