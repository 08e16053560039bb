"""The live twin: it follows a healthy machine in silence, and tells a change of physics with its slot and size."""

import json
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest
from live_machine import CHANGED, LIFT, at_work
from machines_at_work import RATE, Stretch
from watch import Outcome

from rhythmid.commands.watch import watch
from rhythmid.elements.catalogue import load_catalogue
from rhythmid.errors import InputError
from rhythmid.model import Model
from rhythmid.record.convert import write_record
from rhythmid.record.outlier import outlying_samples
from rhythmid.record.record import Channel, Record
from rhythmid.twin.calibration import Calibration
from rhythmid.twin.changes import Change, watched, without_own_forcing
from rhythmid.twin.detector import Healthy
from rhythmid.twin.diagnosis import Diagnosing
from rhythmid.twin.isolation import isolate
from rhythmid.twin.kept import load, save
from rhythmid.twin.outliers import WithoutOutliers
from rhythmid.twin.samples import Samples
from rhythmid.twin.score import Score, inverse
from rhythmid.twin.settings import Settings
from rhythmid.twin.twin import Status, Twin

HEALTHY = 25.0  # s
SETTINGS = Settings(healthy=HEALTHY)
model = lru_cache(lambda: Model.from_text(LIFT, catalogue=load_catalogue()))


def feed(twin: Twin, signals: Stretch, step: int = 250) -> list[Status]:
    """What a twin says of signals that come in `step` samples at a time."""
    said = []
    for first in range(0, len(signals.time), step):
        part = slice(first, first + step)
        for role, time, value in signals.channels:
            if role in twin.samples:
                twin.push(role, time[part], value[part])
        said += twin.advance()
    return said


@lru_cache
def learnt() -> tuple[Calibration, Stretch]:
    """A calibration of the healthy machine, and what it was learnt from."""
    signals = at_work(model(), 0.0, HEALTHY + 1.5)
    twin = Twin(model(), SETTINGS)
    said = feed(twin, signals)
    assert twin.calibration is not None
    assert {status.level for status in said} == {"learning"}
    return twin.calibration, signals


def after(change: str | None, seconds: float = 7.0) -> tuple[float, list[Status]]:
    """When a machine was changed [s], and what a twin that knows it says from 11 s before."""
    calibration, signals = learnt()
    at = signals.time[-1] + 11.0
    before = at_work(model(), signals.time[-1], at, signals.end, seed=1)
    changed = model() if change is None else CHANGED[change](model())
    later = at_work(changed, at, at + seconds, before.end, seed=2)
    return at, feed(Twin(model(), SETTINGS, calibration=calibration), before.then(later))


def test_a_healthy_machine_is_followed_in_silence_and_its_delays_are_told():
    calibration, _ = learnt()
    _, said = after(None)
    assert {status.level for status in said[-60:]} == {"ok"}
    assert all(0.5 < status.innovation < 1.5 and status.mismatch < 1.0 for status in said[-60:])
    assert calibration.nrmse < 0.02
    for name, truth in (("input", 0.010), ("measurement", 0.005), ("sum", 0.015)):
        assert said[-1].delays[name].value == pytest.approx(truth, abs=5.0 * said[-1].delays[name].std)


@pytest.mark.parametrize(
    ("change", "slot", "name", "size"),
    [
        ("friction", "force", "coulomb_friction.force", 1.0),
        ("payload", "inertia", "inertia.mass", 0.1),
        ("command", "command", "input_delay.delay", 0.005),
        ("measurement", "sensor", "measurement_delay.delay", 0.005),
    ],
)
def test_a_change_of_physics_is_told_with_its_slot_and_size(change, slot, name, size):
    at, said = after(change)
    assert all(status.since is None for status in said if status.time < at)
    first = next(status for status in said if status.since is not None)
    assert first.time < at + 2.0 and first.level == "warn"
    last = said[-1]
    assert last.mismatch > 1.0 and last.isolation.slot == slot
    assert last.isolation.changes[0].name == name
    assert last.isolation.changes[0].size == pytest.approx(size, rel=0.15)
    assert max(last.isolation.share, key=last.isolation.share.get) == slot
    if slot in ("command", "sensor"):
        delay = last.delays["input" if slot == "command" else "measurement"].value
        assert delay == pytest.approx((0.010 if slot == "command" else 0.005) + 0.005, abs=5e-4)


def told(believed: Model, forced: bool, change: str, path: Path) -> tuple[Calibration, list[Status]]:
    """What a twin that starts from `believed` learns of the healthy lift, and says seven seconds after a change, its calibration read from a file."""
    signals = at_work(model(), 0.0, HEALTHY + 1.5, forced=forced)
    twin = Twin(believed, SETTINGS, forced)
    feed(twin, signals)
    assert twin.calibration is not None
    save(twin.calibration, path)
    calibration = load(path, believed, SETTINGS, forced, load_catalogue())
    at = signals.time[-1] + 11.0
    before = at_work(model(), signals.time[-1], at, signals.end, seed=1, forced=forced)
    later = at_work(CHANGED[change](model()), at, at + 7.0, before.end, seed=2, forced=forced)
    return calibration, feed(Twin(believed, SETTINGS, forced, calibration), before.then(later))


@pytest.mark.parametrize(("change", "slot"), [("command", "command"), ("measurement", "sensor")])
def test_a_model_whose_position_of_rest_is_off_tells_which_delay_has_grown(change, slot, tmp_path):
    off = 0.004  # m, a third of the motion's standard deviation
    calibration, said = told(
        model().with_values({"linear_spring.rest_length": off}), True, change, tmp_path / "healthy.json"
    )
    assert calibration.constant_force == pytest.approx(-800.0 * off, rel=0.02)
    assert said[-1].isolation.slot == slot and said[-1].isolation.rivals == ()
    assert said[-1].isolation.changes[0].size == pytest.approx(0.005, rel=0.15)


@pytest.mark.parametrize("change", ["command", "measurement"])
def test_delays_that_nothing_tells_apart_are_named_together(change, tmp_path):
    _, said = told(model(), False, change, tmp_path / "healthy.json")
    late = [status.isolation for status in said[-20:]]
    assert all({one.slot, *one.rivals} == {"command", "sensor"} for one in late)


@pytest.mark.parametrize(
    ("explained", "correlation", "rivals"), [(2e3, 0.9, ()), (20.0, 0.9, ("sensor",)), (2e4, 0.999, ("sensor",))]
)  # fmt: skip
def test_a_slot_is_named_alone_where_it_leads_by_odds_and_by_more_than_effects_are_known_to(
    explained, correlation, rivals
):
    information = np.array([[1.0, correlation], [correlation, 1.0]])
    score = Score(np.sqrt(explained) * information[0], information, 0.0, 0)  # as the first change makes it
    healthy = Healthy(np.zeros(2), np.zeros((2, 2)), (), 0.0)
    changes = [Change("input_delay.delay", "command", "s"), Change("measurement_delay.delay", "sensor", "s")]
    found = isolate(score, healthy, changes, 1.0)
    assert found.slot == "command" and found.rivals == rivals


def test_the_benchmark_counts_a_delay_of_a_machine_without_forcing_only_where_both_slots_are_named():
    def right(machine: str, slot: str, *rivals: str) -> bool:
        return Outcome(machine, 0, "measurement delay", 1.0, slot, rivals, False).right

    assert right("joint", "command", "sensor") and right("joint", "sensor", "command")
    assert not right("joint", "sensor") and not right("joint", "sensor", "command", "force")
    assert right("lift", "sensor") and not right("lift", "command", "sensor")


def test_a_mismatch_that_lasts_becomes_an_error_and_ends_ten_seconds_after_the_last_sign_of_it():
    twin = Twin(model(), SETTINGS, calibration=learnt()[0])
    seen = [twin._level(now, 2.0 if 1.0 <= now < 13.0 else 0.0) for now in np.arange(0.0, 26.0)]
    assert seen == ["ok"] + ["warn"] * 10 + ["error"] * 12 + ["ok"] * 3


def test_what_is_said_does_not_depend_on_how_the_samples_come_in():
    calibration, signals = learnt()
    later = at_work(model(), signals.time[-1], signals.time[-1] + 8.0, signals.end, seed=1)
    whole = feed(Twin(model(), SETTINGS, calibration=calibration), later, 10_000)
    bits = feed(Twin(model(), SETTINGS, calibration=calibration), later, 37)
    assert [status.mismatch for status in bits] == [status.mismatch for status in whole]


def with_outliers(signals: Stretch, every: int) -> Stretch:
    """The signals with a value far off at every so many measurements."""
    measured = signals.measured.copy()
    measured[every // 2 :: every] += 10.0 * np.ptp(measured)
    return replace(signals, measured=measured)


def test_outliers_of_the_measurement_are_left_out_and_counted_however_they_come_in():
    calibration, signals = learnt()
    clean = at_work(model(), signals.time[-1], signals.time[-1] + 8.0, signals.end, seed=1)
    spoilt = with_outliers(clean, 300)
    twin = Twin(model(), SETTINGS, calibration=calibration)
    whole, bits = (
        feed(twin, spoilt, 10_000),
        feed(Twin(model(), SETTINGS, calibration=calibration), spoilt, 37),
    )
    assert bits == whole
    assert {one.level for one in whole} == {"learning", "ok"}
    assert max(one.innovation for one in whole) < 1.5
    judged = np.sum(spoilt.stamp[150::300] < whole[-1].time)
    assert judged <= twin.outliers <= len(spoilt.stamp[150::300])


def test_a_healthy_stretch_is_cleaned_of_outliers_by_the_criterion_of_the_records():
    rng = np.random.default_rng(2)
    time = np.arange(3000) / 200.0 + 5e4
    value = np.sin(3.0 * time) + 1e-3 * rng.standard_normal(3000)
    value[rng.choice(np.arange(5, 2900, 7), 25, replace=False)] += 0.5
    expected = outlying_samples(value)
    filtered = WithoutOutliers()
    kept = []
    for first in range(0, 3000, 11):
        filtered.given.append(time[first : first + 11], value[first : first + 11])
        kept.append(filtered.take()[0])
    told = np.concatenate(kept)
    assert filtered.left_out == expected.sum() == 25
    assert np.array_equal(told, time[~expected][: len(told)]) and len(told) > 2900


def test_peaks_of_an_acceleration_are_kept():
    filtered = WithoutOutliers(keep=True)
    filtered.given.append(np.arange(300.0), np.where(np.arange(300) == 150, 9.0, 0.0))
    assert len(filtered.take()[0]) == 300 and filtered.left_out == 0 and len(filtered.take()[0]) == 0


def test_a_calibration_is_read_back_as_it_was_written(tmp_path):
    calibration, signals = learnt()
    save(calibration, tmp_path / "healthy.json")
    catalogue = load_catalogue()
    back = load(tmp_path / "healthy.json", model(), SETTINGS, True, catalogue)
    later = at_work(model(), signals.time[-1], signals.time[-1] + 8.0, signals.end, seed=1)
    one, two = (feed(Twin(model(), SETTINGS, calibration=known), later)[-1] for known in (calibration, back))
    assert one == two
    other = model().without("coulomb_friction").without("viscous_damper")
    with pytest.raises(InputError, match="of another model"):
        load(tmp_path / "healthy.json", other, SETTINGS, True, catalogue)
    for text in ("{}", "[]", "not json", '{"version": 1}'):
        (tmp_path / "bad.json").write_text(text)
        with pytest.raises(InputError, match="no calibration"):
            load(tmp_path / "bad.json", model(), SETTINGS, True, catalogue)
    with pytest.raises(InputError, match="cannot be read"):
        load(tmp_path / "absent.json", model(), SETTINGS, True, catalogue)


def test_a_machine_that_the_model_does_not_describe_or_that_rests_is_refused():
    _, signals = learnt()
    alien = model().with_values({"linear_spring.stiffness": 100.0})
    with pytest.raises(InputError, match="not a model of this machine|diverges"):
        feed(Twin(alien, SETTINGS), signals)
    quiet = Stretch(
        signals.time,
        0 * signals.command,
        0 * signals.forcing,
        signals.stamp,
        0 * signals.measured,
        signals.end,
    )
    with pytest.raises(InputError, match="no motion"):
        feed(Twin(model(), SETTINGS), quiet)


def test_samples_that_are_no_number_or_come_twice_are_left_out_and_counted():
    samples = Samples()
    samples.append(np.array([0.0, 1.0, 1.0, 2.0, 1.5]), np.array([1.0, np.nan, 2.0, 3.0, 4.0]))
    assert samples.time.tolist() == [0.0, 2.0] and samples.refused == 3
    samples.append(np.array([2.0, 3.0]), np.array([9.0, 5.0]))
    assert samples.value.tolist() == [1.0, 3.0, 5.0]
    samples.forget(2.5)
    assert samples.time.tolist() == [2.0, 3.0]


def test_added_elements_change_nothing_and_every_slot_is_watched():
    extended, changes = watched(model(), load_catalogue(), 0.1)
    assert {change.slot for change in changes} == {"inertia", "command", "actuator", "force", "sensor"}
    assert "gravity.acceleration" not in {change.name for change in changes}
    one, two = (at_work(machine, 0.0, 2.0, noise=0.0).measured for machine in (model(), extended))
    np.testing.assert_allclose(two, one, atol=1e-12)
    driven = model().with_element(load_catalogue()["periodic_forcing"], {"amplitude": 1.0, "frequency": 1.0})
    assert without_own_forcing(driven).term("periodic_forcing") is None


def test_the_inverse_is_that_of_the_part_that_shows_whatever_the_units():
    rng = np.random.default_rng(0)
    root = rng.standard_normal((3, 4))
    scale = np.array([1e-6, 1.0, 1e6, 1e3])
    matrix = (root.T @ root) * np.outer(scale, scale)
    found, rank = inverse(matrix)
    assert rank == 3
    np.testing.assert_allclose(
        matrix @ found @ matrix, matrix, rtol=1e-6, atol=1e-9 * np.outer(scale, scale).min()
    )
    assert inverse(np.zeros((2, 2)))[1] == 0


@pytest.mark.parametrize(("changes", "said"), [
    ({"healthy": 5.0}, "healthy stretch"), ({"healthy": float("nan")}, "healthy stretch"), ({"false_alarms": 0.0}, "false alarms"),
    ({"input_kind": "base_displacement"}, "base displacement"),
])  # fmt: skip
def test_settings_that_cannot_work_are_refused(changes, said):
    with pytest.raises(InputError, match=said):
        Settings(**changes)


@pytest.fixture
def files(tmp_path):
    """A bag in which the friction doubles at 37.5 s, with its signals and model."""
    _, signals = learnt()
    before = at_work(model(), signals.time[-1], 37.5, signals.end, seed=1)
    later = at_work(CHANGED["friction"](model()), 37.5, 45.0, before.end, seed=2)
    whole = signals.then(before).then(later)
    channels = {
        role: Channel(time, value, "m" if role == "output" else "N") for role, time, value in whole.channels
    }
    bag = write_record(Record("lift", **channels), tmp_path / "bag")
    (tmp_path / "model.yaml").write_text(LIFT)
    return bag, tmp_path


def test_the_command_watches_a_bag(files, rhythmid):
    bag, folder = files
    done = rhythmid(
        "watch", "model.yaml", "--bag", bag, "--signals", bag / "signals.yaml", "--healthy", HEALTHY, "--json", "watch.json",
        "--save-calibration", "healthy.json",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    found = json.loads((folder / "watch.json").read_text())
    (event,) = found["events"]
    assert 37.5 < event["since"] < 40.0 and event["until"] is None and event["slot"] == "force"
    assert "coulomb_friction.force" in " ".join(done.stdout.split())
    assert (folder / "healthy.json").exists()


BAG = {"bag": Path("bag"), "signals": Path("bag/signals.yaml")}


@pytest.mark.parametrize(("options", "said"), [
    ({"bag": Path("absent")}, "no such file"),
    ({"bag": Path("bag")}, "--signals"),
    ({**BAG, "healthy": 3.0}, "at least 20 s"),
    (BAG, "lasts 45 s"),
    ({**BAG, "json": Path("model.yaml")}, "exists already"),
    ({**BAG, "calibration": Path("model.yaml")}, "no calibration"),
])  # fmt: skip
def test_what_cannot_be_watched_is_refused(files, monkeypatch, options, said):
    monkeypatch.chdir(files[1])
    with pytest.raises(InputError, match=said):
        watch(Path("model.yaml"), **options)


def test_a_diagnosis_runs_in_a_process_of_its_own_and_says_why_it_fails():
    time = np.arange(500) / RATE
    running = Diagnosing(
        Record("window", Channel(time, np.zeros(500), "m"), Channel(time, np.ones(500), "N")), model()
    )
    answer = running.poll(wait=True)
    assert answer["verdict"] == "failed" and "never changes" in answer["summary"] and answer["missing"] == []
