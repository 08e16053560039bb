"""`rhythmid init` and `rhythmid convert` as they are typed: from a foreign recording to the first verdict, and what they refuse."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from foreign import STEP, array, joint_state, moved, tones, write

from rhythmid.record.read import read_record

TIME = np.arange(5000) * STEP
TORQUE = tones(3, TIME, 1.2, 0.4, 3.0)
DRY = 0.25
NOW = 1.7e9  # s at which a bag begins


@pytest.fixture
def table(tmp_path):
    """A bench's log, its times in ms, angles in degrees, decimal commas; a spring-loaded joint with dry friction."""
    angle, _ = moved(TORQUE, 0.05, 0.1, 6.0, DRY)
    angle = np.degrees(angle) + 0.02 * np.random.default_rng(0).standard_normal(len(angle))
    rows = [
        f"{1e3 * TIME[k]:.0f};{angle[k]:.5f};{TORQUE[k]:.6f}".replace(".", ",")
        for k in range(0, len(TIME), 10)
    ]
    path = tmp_path / "run.csv"
    path.write_text('# bench 3\n"t [ms]";"angle [deg]";"tau [Nm]"\n' + "\n".join(rows) + "\n")
    return path


def test_the_readme_shows_the_commands_that_init_prints(table, command):
    readme = (Path(__file__).parents[2] / "README.md").read_text(encoding="utf-8")
    section = readme.partition("\n## Only bags\n")[2].partition("\n## ")[0]
    shown = [line.split()[1:] for line in section.splitlines() if line.startswith("    rhythmid ")]
    assert [one[0] for one in shown] == ["init", "check", "diagnose"]
    begun = command(*shown[0])
    assert (begun.code, begun.err) == (0, "")
    assert [line.split()[1:] for line in begun.out.splitlines() if line.startswith("  rhythmid ")] == shown[
        1:
    ]


@pytest.fixture
def bag(tmp_path):
    """A robot's bag: states of three joints, and their torques in one array without names or stamps; the knee has dry friction."""
    rng, rows = np.random.default_rng(0), range(0, len(TIME), 4)
    torques = np.stack(
        [np.repeat(tones(seed, TIME, rms)[::4], 4) for seed, rms in ((7, 0.1), (3, 0.4), (8, 0.1))]
    )
    dry = (0.0, DRY, 0.0)
    angles = np.stack([moved(own, 0.05, 0.1, 6.0, held)[0] for own, held in zip(torques, dry, strict=True)])
    angles += 3e-4 * rng.standard_normal(angles.shape)
    states = [
        (NOW + TIME[k] + 2e-4, joint_state(NOW + TIME[k], ["hip", "knee", "ankle"], position=angles[:, k]))
        for k in rows
    ]
    commands = [(NOW + TIME[k] + 1e-4, array(torques[:, k])) for k in rows]
    return write(
        tmp_path / "bag", {"/robot/joint_states": states, "/robot/torque_controller/commands": commands}
    )


@pytest.mark.parametrize("recording", ["table", "bag"])
def test_three_commands_lead_from_a_foreign_recording_to_a_verdict(recording, request, command):
    source: Path = request.getfixturevalue(recording)
    begun = command("init", source.name)
    assert (begun.code, begun.err) == (0, "")
    commands = [line.split()[1:] for line in begun.out.splitlines() if line.startswith("  rhythmid ")]
    assert [one[0] for one in commands] == ["check", "diagnose"]
    checked = command(*commands[0])
    assert checked.code == 0
    assert all("clocks" in line for line in checked.out.splitlines() if "note" in line)
    done = command(*commands[1], "--json", "answer.json")
    assert done.code == 0, done.err
    answer = json.loads((source.parent / "answer.json").read_text())
    assert answer["verdict"] == "missing_physics" and answer["missing"][0]["element"] == "coulomb_friction"
    found = answer["missing"][0]["parameters"]["force"]
    assert found["value"] == pytest.approx(DRY, abs=max(0.01, 3.0 * found["std"]))


def test_files_that_exist_are_not_overwritten_unless_told_to(table, command):
    (table.parent / "model.yaml").write_text("mine")
    refused = command("init", "run.csv")
    assert refused.code == 2 and "model.yaml: exists already" in refused.err
    assert refused.err.count("\n") == 1 and not (table.parent / "signals.yaml").exists()
    assert command("init", "run.csv", "--force").code == 0
    assert "inertia" in (table.parent / "model.yaml").read_text()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("init", "run.csv", "--rate", "-5"), "--rate is a number of rows a second"),
        (("convert", "run.csv", "--out", "run.csv"), "run.csv: exists already"),
        (("convert", "none.csv", "--out", "bag"), "none.csv: no such file"),
    ],
)
def test_what_cannot_be_done_is_refused_in_one_line(table, command, arguments, words):
    refused = command(*arguments)
    assert refused.code == 2 and words in refused.err and refused.err.count("\n") == 1
    assert sorted(path.name for path in table.parent.iterdir()) == ["run.csv"]


def test_on_a_terminal_close_candidates_are_asked_for(tmp_path):
    angle, _ = moved(TORQUE, 0.05, 0.1, 6.0)
    np.savez(tmp_path / "run.npz", t=TIME, pos_left=angle, pos_right=0.9 * angle, torque=TORQUE)
    terminal, end = os.openpty()
    os.write(terminal, b"7\n2\n")
    done = subprocess.run(
        [sys.executable, "-m", "rhythmid.cli", "init", "run.npz"], stdin=end, capture_output=True, text=True, timeout=600, cwd=tmp_path
    )  # fmt: skip
    os.close(terminal)
    os.close(end)
    assert done.returncode == 0, done.stderr
    assert "Which joint is looked at?" in done.stdout and "a number from 1 to 2 is expected" in done.stdout
    assert "output: pos_right" in done.stdout


def test_a_table_becomes_a_bag_with_the_guesses_or_with_signals_of_ones_own(table, command):
    done = command("convert", "run.csv", "--out", "bag")
    assert done.code == 0 and "output: angle [deg]" in done.out
    (table.parent / "own.yaml").write_text(
        "time: {column: 't [ms]', scale: 0.001}\ninput: {column: 'tau [Nm]', unit: N*m}\n"
        "output: {column: 'angle [deg]', unit: rad, scale: 0.01745329252}\n"
    )
    assert command("convert", "run.csv", "--out", "other", "--signals", "own.yaml").code == 0
    expected = read_record(table, table.parent / "own.yaml")
    for name in ("bag", "other"):
        found = read_record(table.parent / name, table.parent / name / "signals.yaml")
        np.testing.assert_array_equal(found.output.value, expected.output.value)
        np.testing.assert_array_equal(found.input.value, expected.input.value)
        np.testing.assert_allclose(found.output.time, expected.output.time, atol=1e-9)
