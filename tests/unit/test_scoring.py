"""How records are scored: the free run where it follows the machine, windows where it does not, and what comes after those."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from answers import diagnosed

from machines import CATALOGUE, SHORT, hopper, records
from rhythmid.diagnose import diagnosis as module
from rhythmid.diagnose import scoring
from rhythmid.diagnose.answer.result import FitQuality
from rhythmid.diagnose.diagnosis import Answer, diagnose
from rhythmid.diagnose.hypothesis import Verdict
from rhythmid.diagnose.scoring import (
    DISTURBED_FREE_RUN,
    FOLLOWS,
    FREE_RUN,
    FREE_RUN_BESIDE,
    FREE_RUN_IN_PART,
    INTEGRATES,
    Scoring,
    settle,
)
from rhythmid.errors import InputError
from rhythmid.identify.multiple_shooting import forgets
from rhythmid.identify.series import prepare
from rhythmid.model import Model
from rhythmid.record.record import Channel, Record
from rhythmid.simulation.signal import continuous
from rhythmid.simulation.simulate import simulate

PENDULUM = """
units: {{force: rad/s^2, position: rad}}
inertia: {{mass: {{value: 1.0, fixed: true}}}}
force:
  - pendulum_gravity: {{moment: {{value: {moment}}}, reference: {{value: {reference}}}}}
  - viscous_damper: {{damping: {{value: {damping}}}}}
"""
BALL = """
inertia: {mass: {value: 1.0, fixed: true}}
force:
  - gravity: {acceleration: 9.81}
  - periodic_forcing: {amplitude: 15.0, frequency: 1.0}
  - end_stop_contact: {stiffness: 3000.0, damping_ratio: 0.03, position: 0.0, side: -1.0}
"""
CART = """
inertia: {mass: {value: 1.0, fixed: true}}
force: [{viscous_damper: {damping: {value: 0.5}}}]
"""


def pendulum(moment: float = 40.0, reference: float = 0.0, damping: float = 0.02) -> Model:
    """Free, of one period a second at small swings."""
    return Model.from_text(PENDULUM.format(moment=moment, reference=reference, damping=damping))


def motion(machine: Model, start: tuple[float, float], seconds: float, std: float, seed: int = 0) -> Record:
    """What a sensor at 50 Hz sees of a machine from a start, with white noise."""
    time = 0.02 * np.arange(round(50.0 * seconds))
    value = simulate(machine, time, initial=start).output
    value = value + std * np.random.default_rng(seed).standard_normal(len(time))
    return Record("motion", Channel(time, value, machine.units.position))


@pytest.mark.parametrize("amplitude", [0.4, 1.5])
def test_a_lightly_damped_swing_with_friction_is_scored_in_free_run_over_sixty_periods(amplitude):
    machine = pendulum().with_element(
        CATALOGUE["coulomb_friction"], {"force": 0.002 * 40.0 * amplitude, "transition": 1e-3}
    )
    series = prepare([motion(machine, (amplitude, 0.0), 60.0, 1e-3)])
    found = tuple(settle(pendulum(moment=41.0), series, [], CATALOGUE))
    assert found[0].kind == "free_run" and found[0].reason == FREE_RUN


def test_a_swing_that_nothing_drives_is_scored_in_free_run_however_its_phase_drifts():
    machine = pendulum(damping=0.014).with_element(CATALOGUE["quadratic_drag"], {"coefficient": 0.0055})
    series = prepare([motion(machine, (1.3, 0.0), 50.0, 1e-3)])
    nominal = pendulum(damping=0.0)
    (found,) = settle(nominal, series, [], CATALOGUE)
    assert not forgets(nominal, series) and (found.kind, found.reason) == ("free_run", FREE_RUN)


def test_the_free_run_of_an_unstable_machine_means_nothing():
    up = pendulum(reference=np.pi, damping=0.5)
    assert not forgets(up, prepare([motion(up, (1e-3, 0.0), 2.0, 1e-5)]))
    ball = Model.from_text(BALL, catalogue=CATALOGUE)
    for seconds in (10.0, 40.0):  # while the runs part, and when they have parted as far as they can
        assert not forgets(ball, prepare([motion(ball, (0.3, 0.0), seconds, 1e-4)]))


def test_a_free_run_that_follows_a_machine_that_integrates_comes_after_the_windows():
    cart = Model.from_text(CART)
    time = 0.01 * np.arange(1000)
    force = np.random.default_rng(5).standard_normal(20).repeat(50)
    pushed = Channel(time, force, "N")
    value = simulate(cart, time, continuous(time, force, "zero")).output
    value = value + 1e-3 * np.random.default_rng(1).standard_normal(len(time))
    found = tuple(settle(cart, prepare([Record("cart", Channel(time, value, "m"), pushed)]), [], CATALOGUE))
    assert [one.kind for one in found] == ["windows", "free_run"]
    assert found[0].reason.endswith(INTEGRATES) and found[1].reason == DISTURBED_FREE_RUN
    assert found[1].calibration.fit.nrmse() < FOLLOWS


@pytest.mark.parametrize(("verdict", "said"), [("unknown_physics", 1), ("consistent", 0)])
def test_windows_in_which_nothing_is_missing_tell_what_a_free_run_says(monkeypatch, verdict, said):
    plain = diagnose(records(hopper(), SHORT[1:2]), hopper(), catalogue=CATALOGUE).diagnosis
    made = [
        replace(plain, scoring=replace(plain.scoring, kind="windows")),
        replace(plain, verdict=verdict),
    ]
    fit = SimpleNamespace(fit=SimpleNamespace(model=hopper(), std={}))
    effort = SimpleNamespace(
        applies=False,
        free_run_is_informative=True,
        effort_share=0.0,
        notes=(),
        band_left_out=False,
        noisier=False,
    )
    monkeypatch.setattr(module, "applicable", lambda *_: effort)
    monkeypatch.setattr(module, "settle", lambda *_: iter([SimpleNamespace(kind="windows")] * 2))
    monkeypatch.setattr(module, "free_run", lambda *_: SimpleNamespace(search=fit))
    monkeypatch.setattr(module, "compose", lambda *_: made.pop(0))
    found = diagnose(records(hopper(), SHORT[1:2]), hopper(), catalogue=CATALOGUE).diagnosis
    assert not made and found.scoring.kind == "windows" and found.verdict == "consistent"
    assert len(found.notes) == len(plain.notes) + said
    words = "Scored in free run the same records come to another verdict."
    assert sum(note.startswith(words) for note in found.notes) == said


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
    fit = SimpleNamespace(fit=SimpleNamespace(model=hopper(), std={}))
    monkeypatch.setattr(module, "settle", lambda *_, **__: iter([SimpleNamespace(kind="windows")] * 2))
    monkeypatch.setattr(module, "free_run", lambda *_: SimpleNamespace(search=fit))
    monkeypatch.setattr(module, "compose", lambda *_: left.pop(0))
    found = diagnose(records(hopper(), SHORT[1:2]), hopper(), catalogue=CATALOGUE).diagnosis
    assert replace(found, notes=()) == made[kept]
    assert len(left) == (1 if kept == 0 and verdicts[0] == "missing_physics" else 0)


def tried(
    monkeypatch: pytest.MonkeyPatch, *errors: float, shares: dict[float, float] | None = None
) -> tuple[list[Scoring], list[float]]:
    """The ways to score that come out of a free run and ever shorter windows of these errors; and the errors of those that were tried. `shares`
    of the motion in the windows are as large as the errors by default."""
    asked: list[float] = []
    share = shares or {}

    def calibrated(_model, error, *_):
        asked.append(error)
        fit = SimpleNamespace(error=error, nrmse=lambda: share.get(error, error))
        return SimpleNamespace(fit=fit, reconstructed=False)

    def ladder(*_):
        for number, error in enumerate(errors):
            yield SimpleNamespace(
                kind="windows" if number else "free_run",
                reason="" if number else FREE_RUN,
                of=lambda _, error=error: error,
            )

    monkeypatch.setattr(scoring, "_ladder", ladder)
    monkeypatch.setattr(scoring, "calibrate", calibrated)
    monkeypatch.setattr(Scoring, "error", property(lambda made: made.calibration.fit.error))
    monkeypatch.setattr(scoring, "hold_out_tail", lambda cut: (cut, ()))
    monkeypatch.setattr(scoring, "with_reference_scale", lambda calibration, *_: calibration)
    monkeypatch.setattr(
        scoring, "with_zeros", lambda calibration, _, unseen, *__: (calibration, list(unseen))
    )
    return list(settle(hopper(), [], [], CATALOGUE)), asked


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
    assert [one.error for one in tried(monkeypatch, *errors)[0]] == kept


@pytest.mark.parametrize(("share", "kept"), [(0.65, [0.4, 0.7]), (0.85, [0.7])])
def test_windows_in_which_the_machine_hardly_moves_are_no_way_to_score(monkeypatch, share, kept):
    # the error falls with the windows' length, as the motion does of which it is a share
    assert [one.error for one in tried(monkeypatch, 0.7, 0.4, shares={0.4: share})[0]] == kept


@pytest.mark.parametrize(
    ("errors", "reason"),
    [((0.25,), FREE_RUN), ((0.7, 0.5), FREE_RUN_IN_PART), ((0.7, 0.4), FREE_RUN_BESIDE)],
)
def test_the_reason_for_a_free_run_says_how_far_it_follows_the_records_of_the_fit(
    monkeypatch, errors, reason
):
    (one,) = [one for one in tried(monkeypatch, *errors)[0] if one.kind == "free_run"]
    assert one.reason == reason and "the records of the fit" in reason and "machine" not in reason


def asked(
    monkeypatch: pytest.MonkeyPatch,
    means: bool,
    share: float,
    error: float = 0.2,
    follows: bool = False,
    verdict: Verdict = "undecided",
    band_left_out: bool = False,
    noisier: bool = False,
) -> list[str]:
    """What is scored, in order, where nothing is named. `verdict` is that of effort scoring, after which the motion leaves all undecided.

    `means` says whether a free run means something, `follows` whether the model then follows the machine, `share` is the effort's of the
    inertial force, `error` what is left of it, `noisier` whether it has more noise than the motion.
    """
    order: list[str] = []

    def by_effort(*_) -> Answer:
        order.append("effort")
        fit = FitQuality(error, error)
        found = diagnosed(verdict, kind="effort")
        found = replace(found, fit={"refitted_nominal": fit, "augmented": fit})
        return Answer(found, hopper(), SimpleNamespace())  # type: ignore[arg-type]

    def free_run(_, scoring) -> SimpleNamespace:
        order.append(scoring.kind)
        return SimpleNamespace(search=SimpleNamespace(fit=SimpleNamespace(model=hopper(), std={})))

    effort = SimpleNamespace(
        applies=True, free_run_is_informative=means, effort_share=share, notes=(), band_left_out=band_left_out, noisier=noisier
    )  # fmt: skip
    monkeypatch.setattr(module, "applicable", lambda *_: effort)
    monkeypatch.setattr(module, "_by_effort", by_effort)
    monkeypatch.setattr(
        module,
        "settle",
        lambda *given: iter(
            [SimpleNamespace(kind="free_run")] if follows and not given[-1]
            else [SimpleNamespace(kind="windows")] if given[-1] else []
        ),
    )  # fmt: skip
    monkeypatch.setattr(module, "free_run", free_run)
    monkeypatch.setattr(module, "compose", lambda *_: diagnosed("undecided", kind=order[-1]))
    found = diagnose(records(hopper(), SHORT[2:]), hopper(), catalogue=CATALOGUE).diagnosis
    assert found.scoring.kind == order[-1 if verdict == "consistent" else 0]
    return order


@pytest.mark.parametrize(("left", "expected"), [(0.02, ["effort"]), (0.2, ["effort", "windows"])])
def test_windows_are_tried_where_the_effort_is_left_by_more_than_models_of_real_machines_leave(
    monkeypatch, left, expected
):
    assert asked(monkeypatch, False, 2.0, left, verdict="consistent") == expected


@pytest.mark.parametrize(
    ("verdict", "share", "expected"),
    [
        ("undecided", 2.0, ["effort", "windows"]),
        ("unknown_physics", 2.0, ["effort", "windows"]),
        ("undecided", 20.0, ["effort"]),  # quasi-static: its motion tells less
    ],
)
def test_windows_are_tried_where_the_effort_leaves_something_without_a_name_however_little(
    monkeypatch, verdict, share, expected
):
    assert asked(monkeypatch, False, share, 0.02, verdict=verdict) == expected


@pytest.mark.parametrize(("share", "expected"), [(2.0, ["windows", "effort"]), (20.0, ["effort"])])
def test_windows_come_first_where_a_band_of_the_effort_cannot_be_compared(monkeypatch, share, expected):
    assert asked(monkeypatch, False, share, 0.02, band_left_out=True) == expected


def test_the_effort_is_scored_where_no_window_serves_although_those_come_first(monkeypatch):
    def fails(*_):
        raise InputError("the records are too short")

    found = diagnosed("undecided", kind="effort")
    effort = SimpleNamespace(
        applies=True, free_run_is_informative=True, effort_share=0.5, notes=(), band_left_out=True, noisier=False
    )  # fmt: skip
    monkeypatch.setattr(module, "applicable", lambda *_: effort)
    monkeypatch.setattr(module, "settle", lambda *given: fails() if given[-1] else iter([]))
    monkeypatch.setattr(module, "_by_effort", lambda *_: Answer(found, hopper(), SimpleNamespace()))  # type: ignore[arg-type]
    answer = diagnose(records(hopper(), SHORT[2:]), hopper(), catalogue=CATALOGUE).diagnosis
    assert answer.scoring.kind == "effort"
    assert [one.reason for one in answer.excluded] == ["the records are too short"]


@pytest.mark.parametrize(("share", "expected"), [(1.5, ["effort", "windows"]), (0.5, ["windows", "effort"])])
def test_an_effort_that_moves_the_machine_comes_before_windows_and_one_beside_which_it_swings_after(
    monkeypatch, share, expected
):
    assert asked(monkeypatch, True, share) == expected


@pytest.mark.parametrize(("share", "first"), [(20.0, "effort"), (0.5, "free_run")])
def test_the_effort_of_a_quasi_static_machine_comes_before_a_free_run_that_follows_it(
    monkeypatch, share, first
):
    assert asked(monkeypatch, True, share, follows=True)[0] == first


@pytest.mark.parametrize(("noisier", "first"), [(True, "effort"), (False, "free_run")])
def test_an_effort_with_more_noise_than_the_motion_is_predicted_and_drives_no_free_run(
    monkeypatch, noisier, first
):
    assert asked(monkeypatch, True, 2.0, follows=True, noisier=noisier)[0] == first
