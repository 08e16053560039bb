"""`rhythmid check` tells what analyses will do with a recording: what is left out, how much and why, and where it is cut."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rhythmid.diagnose.admission import admitted
from rhythmid.model import Model
from rhythmid.record.bag_report import BagReport, quality_report
from rhythmid.record.bag_writer import write_bag
from rhythmid.record.messages import Messages
from rhythmid.record.quality import ChannelQuality
from rhythmid.record.read import read_record
from rhythmid.record.timing import Timing

N = 4000
TIME = 0.005 * np.arange(N)
U = np.sin(2.0 * np.pi * 0.35 * TIME) + 0.5 * np.sin(2.0 * np.pi * 0.83 * TIME + 1.0)
Y = 0.1 * np.sin(2.0 * np.pi * 0.35 * TIME - 0.4) + 0.02 * np.sin(2.0 * np.pi * 0.83 * TIME)
OUTLIERS, STUCK = [700, 1500, 3100], slice(2204, 2210)
SIGNALS = "time: {column: t}\ninput: {column: u, unit: N, hold: linear}\noutput: {column: y, unit: m}\n"
MASS = Model.from_text(
    "inertia: {mass: {value: 1.0, unit: kg}}\nforce: [{viscous_damper: {damping: {value: 1.0, unit: N*s/m}}}]"
)


def table(folder: Path, u: np.ndarray, y: np.ndarray) -> Path:
    """A table with its signals.yaml beside it; a NaN is an empty field."""
    rows = (",".join("" if np.isnan(v) else f"{v:.9g}" for v in row) for row in zip(TIME, u, y))
    (folder / "run.csv").write_text("t,u,y\n" + "\n".join(rows) + "\n")
    (folder / "signals.yaml").write_text(SIGNALS)
    return folder / "run.csv"


def checked(folder: Path, u: np.ndarray = U, y: np.ndarray = Y) -> BagReport:
    rng = np.random.default_rng(3)
    return quality_report(table(folder, u, y + 1e-5 * rng.standard_normal(N)), folder / "signals.yaml")


@pytest.fixture
def spoilt() -> np.ndarray:
    """The output with three outliers and a sensor that stood still for six samples."""
    value = Y.copy()
    value[OUTLIERS] += 0.05
    return value


def stuck(folder: Path, value: np.ndarray) -> BagReport:
    rng = np.random.default_rng(3)
    value = value + 1e-5 * rng.standard_normal(N)
    value[STUCK] = value[STUCK.start - 1]
    return quality_report(table(folder, U, value), folder / "signals.yaml")


def test_outliers_and_stuck_samples_are_told_with_number_and_reason(tmp_path, spoilt):
    report = stuck(tmp_path, spoilt)
    lines = "\n".join(report.lines())
    assert "stand far off their neighbours are left out, 3 of 4000, the first at t = 3.5 s" in lines
    assert "repeat the one before while the motion goes on are left out, 6 of 4000" in lines
    assert "9 of 4000 samples are left out" in lines and "flawless" not in lines
    assert [(one["reason"], one["count"], one["total"]) for one in report.to_dict()["left_out"]] == [
        ("outlier", 3, N), ("repeated", 6, N),
    ]  # fmt: skip


def test_what_check_tells_is_what_a_diagnosis_does(tmp_path, spoilt):
    report = stuck(tmp_path, spoilt)
    given = admitted([read_record(tmp_path / "run.csv", tmp_path / "signals.yaml")], [], MASS)
    assert set(report.notes) == set(given.notes)
    assert report.cut is not None
    for told, used in zip(report.cut.stretches, given.records, strict=True):
        np.testing.assert_array_equal(told.output.time, used.output.time)


def test_clipped_samples_are_told_to_be_left_out(tmp_path):
    noisy = Y + 1e-5 * np.random.default_rng(3).standard_normal(N)
    report = quality_report(table(tmp_path, U, np.minimum(noisy, 0.1)), tmp_path / "signals.yaml")
    (left_out,) = report.left_out["output"]
    assert left_out.reason == "clipped" and left_out.count > 100
    assert "are clipped at 0.1 m" in "\n".join(report.lines())


def test_where_a_recording_is_cut_is_told(tmp_path):
    command = np.random.default_rng(1).standard_normal(N)
    command[1000:1100] = command[3000:3040] = np.nan
    report = checked(tmp_path, u=command)
    assert any(
        "cut where commands are missing (2 times, the first at t = 4.995 s" in one for one in report.notes
    )
    cut = report.to_dict()["cut"]
    assert cut["gaps"] == [pytest.approx([4.995, 5.5]), pytest.approx([14.995, 15.2])]
    starts = [one["start"] for one in cut["stretches"]]
    assert starts == pytest.approx([0.0, 5.55, 15.25]) and cut["stretches"][0]["end"] == pytest.approx(4.995)


def test_samples_that_are_filled_in_are_told_and_no_channel_is_flawless_beside_a_note(tmp_path):
    command = U.copy()
    command[2000] = np.nan
    report = checked(tmp_path, u=command)
    assert any("1 lost samples of the input are interpolated" in note for note in report.notes)
    assert any(line.endswith(": nothing but what the notes say") for line in report.lines())
    assert not any("flawless" in line for line in report.lines())
    assert report.to_dict()["cut"]["gaps"] == [] and len(report.to_dict()["cut"]["stretches"]) == 1


def test_a_recording_of_which_nothing_is_told_is_flawless(tmp_path):
    report = checked(tmp_path)
    assert sum(line.endswith(": flawless") for line in report.lines()) == 2
    assert report.remarks == [] and report.to_dict()["left_out"] == []
    assert report.to_dict()["cut"] == {
        "gaps": [], "stretches": [{"name": "run", "start": 0.0, "end": pytest.approx(TIME[-1])}]
    }  # fmt: skip


def test_an_output_that_is_mostly_clipped_cannot_be_used(tmp_path, command):
    noisy = Y + 1e-5 * np.random.default_rng(3).standard_normal(N)
    table(tmp_path, U, np.clip(noisy, -0.02, 0.02))
    answer = command("check", "run.csv", "--signals", "signals.yaml", "--json", "answer.json")
    assert answer.code == 2 and "choose a wider range of the sensor" in answer.err
    written = json.loads((tmp_path / "answer.json").read_text())
    assert not written["usable"] and written["cut"] is None


MODEL = """inertia: {mass: {value: 2.0, unit: kg, fixed: true}}
force:
  - linear_spring: {stiffness: {value: 5.0, unit: N/m}}
  - viscous_damper: {damping: {value: 1.0, unit: N*s/m}}
"""


def test_the_size_and_the_columns_of_a_table_are_told(tmp_path):
    report = checked(tmp_path)
    size = (tmp_path / "run.csv").stat().st_size
    assert report.size == size and report.columns == 3
    assert report.lines()[0].endswith(f": {size / 1e3:.1f} kB, {TIME[-1]:.3f} s, 3 columns read")
    named = SIGNALS.replace("column: t}", "column: t}\ntables: {file: run.csv}")
    (tmp_path / "named.yaml").write_text(named)
    assert quality_report(tmp_path / "named.yaml").lines()[0].endswith("3 columns read")
    assert quality_report(tmp_path / "named.yaml").size == size


def test_a_recording_whose_position_lies_elsewhere_is_noted(tmp_path, command):
    checked(tmp_path)
    (tmp_path / "moved").mkdir()
    table(tmp_path / "moved", U, Y + 50.0).rename(tmp_path / "moved.csv")
    answer = command("check", "run.csv", "moved.csv", "--signals", "signals.yaml")
    assert answer.code == 0 and answer.out.splitlines()[-1].startswith(
        "note: the output of moved is between "
    )


def test_a_model_is_told_in_one_line_with_the_records(tmp_path, command):
    checked(tmp_path)
    (tmp_path / "model.yaml").write_text(MODEL)
    answer = command("check", "run.csv", "--signals", "signals.yaml", "--model", "model.yaml")
    assert answer.code == 0 and answer.err == ""
    assert answer.out.splitlines()[-1] == (
        "model.yaml: inertia 2 kg (fixed); linear_spring, viscous_damper; 2 free parameters (linear_spring.stiffness, "
        "viscous_damper.damping); units N, m, kg"
    )


def test_units_of_the_records_that_are_not_the_models_are_noted(tmp_path, command):
    checked(tmp_path)
    (tmp_path / "signals.yaml").write_text(SIGNALS.replace("unit: N", "unit: V"))
    (tmp_path / "model.yaml").write_text(MODEL)
    answer = command("check", "run.csv", "--signals", "signals.yaml", "--model", "model.yaml")
    assert answer.code == 0
    assert answer.out.splitlines()[-1] == "  note: run: the input is in V by signals.yaml, in N by the model"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (MODEL.replace("viscous", "viscos"), "model.yaml:4: unknown element 'viscos_damper'"),
        (MODEL.replace("unit: N/m", "unit: kg"), "model.yaml:3: force[0].linear_spring.stiffness: unit 'kg'"),
        (
            MODEL + "command: [{position_control: {proportional: 9.0, derivative: 1.0}}]\n",
            "the model has a controller, but no reference is recorded",
        ),
    ],
)
def test_a_model_that_is_wrong_or_does_not_fit_the_records_is_refused_after_the_report(
    tmp_path, command, text, words
):
    checked(tmp_path)
    (tmp_path / "model.yaml").write_text(text)
    answer = command("check", "run.csv", "--signals", "signals.yaml", "--model", "model.yaml")
    assert answer.code == 2 and words in answer.err and answer.err.count("\n") == 1
    assert "columns read" in answer.out


def test_an_effort_that_a_holding_controller_makes_of_the_output_is_noted(tmp_path):
    rng = np.random.default_rng(5)
    place = 1e-6 * np.cumsum(rng.standard_normal(N))
    held = 3.0 - 9000.0 * place + 1e-5 * rng.standard_normal(N)
    report = quality_report(table(tmp_path, held, place), tmp_path / "signals.yaml")
    (note,) = [
        one for one in report.notes if one.startswith("input: it is a copy of the output (correlation -")
    ]
    assert "what a controller makes while its reference stands still" in note
    assert not any(line.endswith("flawless") for line in report.lines())


@pytest.mark.parametrize("stiffness", [9000.0, 0.0])
def test_a_spring_that_the_effort_stretches_and_a_free_motion_are_not(tmp_path, stiffness):
    effort = stiffness * Y if stiffness else U
    report = quality_report(table(tmp_path, effort, Y), tmp_path / "signals.yaml")
    assert not any("copy" in one for one in report.notes)


class TestStrict:
    """`rhythmid check --strict`: exit code 1 where anything may change an answer."""

    @pytest.mark.parametrize(("spoil", "code"), [(False, 0), (True, 1)])
    def test_a_recording_with_samples_that_are_left_out_fails_and_a_flawless_one_does_not(
        self, spoil, code, spoilt, command, tmp_path
    ):
        rng = np.random.default_rng(3)
        run = table(tmp_path, U, (spoilt if spoil else Y) + 1e-5 * rng.standard_normal(N))
        given = ("check", run, "--signals", tmp_path / "signals.yaml")
        assert command(*given).code == 0
        answer = command(*given, "--strict", "--json", "-")
        assert answer.code == code and bool(json.loads(answer.out)["matters"]) == spoil
        assert ("--strict: 1 of the remarks may change an answer" in answer.err) == spoil

    def test_what_changes_no_answer_does_not_matter(self):
        timing = Timing.of(0.01 * np.array([0, 1, 2, 4, 3, 5, 6, 6, 7]))
        quality = ChannelQuality("a", timing, missing=3)
        assert len(quality.complaints()) == 3 and quality.matters() == []
        assert len(replace(quality, conflicts=1).matters()) == 1

    def test_a_recording_that_cannot_be_used_has_exit_code_2(self, command, tmp_path):
        assert command("check", tmp_path / "nothing", "--strict").code == 2

    def test_clocks_that_are_taken_for_one_are_told_but_do_not_matter(self, tmp_path):
        bag = write_bag(
            tmp_path / "bag",
            {
                "/u": Messages((1e9 * TIME).astype(np.int64), effort=U),
                "/y": Messages((1e9 * TIME).astype(np.int64), Y),
            },
        )
        (tmp_path / "s.yaml").write_text(
            "time: header\ninput: {topic: /u, field: 'effort[0]', time: receive}\noutput: {topic: /y, field: 'position[0]'}\n"
        )
        report = quality_report(bag, tmp_path / "s.yaml")
        assert any(note.startswith("assumed: ") for note in report.notes) and report.matters == []
