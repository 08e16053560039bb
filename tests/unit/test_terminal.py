"""What the command promises on a terminal: help, completion, silence, JSON on standard output, and tables of any width."""

import io
import json
import os
import re
import shlex
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
import typer
from rich.console import Console

import rhythmid as rh
from rhythmid.batch.agreement import Agreement
from rhythmid.batch.batch import Batch
from rhythmid.batch.scatter import Slope
from rhythmid.cli import app
from rhythmid.commands.begin import BEGIN
from rhythmid.commands.terminal import console
from rhythmid.output import STANDARD_OUTPUT, require_new, write_json
from rhythmid.record.record import Channel
from rhythmid.report.quantity import with_std
from rhythmid.report.terminal_table import estimate_cells, print_estimates, print_markdown, print_table

COMMANDS = (*typer.main.get_command(app).commands, "run")  # `run` is in a package of its own
NARROW = 40
SLOW = {"numpy", "scipy", "numba", "matplotlib", "pandas", "xarray", "mujoco", "rclpy"}


def python_m(*arguments: str, **variables: str) -> subprocess.CompletedProcess[str]:
    """`python -m rhythmid` with environment variables."""
    return subprocess.run(
        [sys.executable, "-m", "rhythmid", *arguments],
        capture_output=True, text=True, timeout=600.0, check=False, env={**os.environ, **variables},
    )  # fmt: skip


@pytest.fixture
def bag(tmp_path):
    run = {"excitation": {"type": "chirp", "amplitude": 0.02, "sweep": 2.0}}
    return rh.simulate(rh.paper_hopper(), run).save(tmp_path / "bag")


def test_the_command_alone_says_where_to_begin_and_fits_a_narrow_terminal():
    done = python_m()
    assert (done.returncode, done.stdout, done.stderr) == (0, BEGIN, "")
    assert max(map(len, BEGIN.splitlines())) <= NARROW
    named = set(re.findall(r"^  rhythmid (\w+)", BEGIN, re.MULTILINE))
    assert {"init", "check", "diagnose"} <= named <= set(COMMANDS)


def test_python_m_and_the_short_option_give_the_same_help():
    assert python_m("-h").stdout == python_m("--help").stdout != ""
    assert "Usage: rhythmid check" in python_m("check", "-h").stdout


def test_help_loads_none_of_the_libraries_that_take_long():
    traced = subprocess.run(
        [sys.executable, "-X", "importtime", "-m", "rhythmid", "--help"],
        capture_output=True, text=True, timeout=600.0, check=True,
    )  # fmt: skip
    loaded = {line.rsplit("|", 1)[-1].strip().split(".")[0] for line in traced.stderr.splitlines()}
    assert "typer" in loaded and not loaded & SLOW


def test_help_on_a_narrow_terminal_cuts_nothing_off():
    text = python_m("identify", "--help", COLUMNS="40").stdout
    assert "--clock-offset-std" in text and "…" not in text


@pytest.mark.parametrize("command", ["", "identify", "design", "proof"])
def test_the_help_is_no_wider_than_a_narrow_terminal(command):
    text = python_m(*command.split(), "--help", COLUMNS="40").stdout
    assert max(map(len, text.splitlines())) <= 40


def examples() -> Sequence[tuple[str, str]]:
    import importlib

    modules = {name: f"rhythmid.commands.{name}" for name in COMMANDS} | {"run": "rhythmid_bringup.command"}
    return [
        (name, line) for name, where in modules.items() for line in importlib.import_module(where).EXAMPLES
    ]


def test_every_command_has_examples():
    assert (
        {name for name, _ in examples()}
        == set(COMMANDS)
        >= {"diagnose", "batch", "export", "recover", "watch"}
    )


@pytest.mark.parametrize(("name", "line"), examples())
def test_an_example_is_in_the_help_of_its_command_and_can_be_parsed(name, line):
    program, command, *arguments = shlex.split(line)
    assert (program, command) == ("rhythmid", name)
    if name == "run":
        return
    group = typer.main.get_command(app)
    one = group.commands[command]
    assert line in one.epilog
    one.make_context(command, arguments)  # refuses what it does not know, without running anything


def test_tab_completes_commands_and_options():
    commands = python_m(COMP_WORDS="rhythmid id", COMP_CWORD="1", _RHYTHMID_COMPLETE="complete_bash")
    assert commands.stdout.split() == ["identify"]
    options = python_m(
        COMP_WORDS="rhythmid identify --js", COMP_CWORD="2", _RHYTHMID_COMPLETE="complete_bash"
    )
    assert options.stdout.split() == ["--json"]


def test_json_on_standard_output_is_nothing_but_json(bag, rhythmid):
    done = rhythmid("check", bag, "--json", "-")
    assert json.loads(done.stdout)["usable"] is True
    assert "joint_states" in done.stderr  # the report for people goes where it does not disturb


def test_several_recordings_are_checked_one_after_the_other_and_listed_as_json(bag, command, tmp_path):
    both = command("check", bag, bag)
    assert (both.code, both.out.count("joint_states")) == (
        0,
        2 * command("check", bag).out.count("joint_states"),
    )
    told = json.loads(command("check", bag, bag, "--json", "-").out)
    assert [one["usable"] for one in told] == [True, True]
    spoilt = command("check", "nothing", bag, "--json", "quality.json")
    assert (
        spoilt.code == 2 and spoilt.err.startswith("error: nothing: no such") and "joint_states" in spoilt.out
    )
    (left,) = json.loads((tmp_path / "quality.json").read_text())
    assert left["path"] == str(bag)


def test_quiet_prints_errors_only(bag, command, tmp_path):
    done = command("check", bag, "-q", "--json", "-", "--report", "page.html")
    assert done.code == 0 and json.loads(done.out)["topics"] and done.err == ""
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert "<h1>Usable" in page and page.count('<script type="application/json">') >= 2
    refused = command("check", "nothing", "-q")
    assert refused.code == 2 and refused.err.startswith("error: ")


@pytest.mark.parametrize("name", [name for name in COMMANDS if name != "run"])
def test_every_command_can_be_silenced(name):
    one = typer.main.get_command(app).commands[name]
    assert any("--quiet" in parameter.opts for parameter in one.params)


def test_standard_output_is_never_in_the_way(capsys):
    require_new(STANDARD_OUTPUT, STANDARD_OUTPUT)
    write_json(STANDARD_OUTPUT, {"value": np.float64(np.nan)})
    assert json.loads(capsys.readouterr().out) == {"value": None}


def printed(width: int, *arguments, **options) -> list[str]:
    console = Console(file=io.StringIO(), width=width)
    print_table(console, *arguments, **options)
    assert isinstance(console.file, io.StringIO)
    return console.file.getvalue().splitlines()


ROWS = [
    ("switched_damper.stance", "2.000", "0.012", "N*s/m"),
    ("a [very] long name of a parameter", "200.00", "0.12", "N/m"),
]


@pytest.mark.parametrize("width", [40, 60, 80, 160])
def test_a_table_fits_its_terminal_and_loses_nothing(width):
    lines = printed(width, "estimates", ("name", "value", "± std", "unit"), ROWS)
    assert max(map(len, lines)) <= width
    text = "\n".join(lines)
    assert "…" not in text
    for name, *cells in ROWS:
        assert all(cell in text for cell in cells)
        assert name in text or width < 80  # folded there
    assert ("━" in text) == (width > NARROW)


def test_all_tables_are_printed_by_the_one_function_that_fits_them_to_the_terminal():
    root = Path(rh.__file__).parent
    found = {
        file.relative_to(root).as_posix()
        for file in root.rglob("*.py")
        if re.search(
            r"^\s*from rich\.(table import Table|markdown)", file.read_text(encoding="utf-8"), re.MULTILINE
        )
    }
    assert found == {"report/terminal_table.py"}


@pytest.mark.parametrize("width", [40, 80])
def test_a_text_with_tables_fits_its_terminal_and_loses_nothing(width):
    console = Console(file=io.StringIO(), width=width)
    print_markdown(
        console,
        "# Card\n\nRates with intervals.\n\n| concealed | answered |\n| --- | --- |\n"
        "| `coulomb_friction` | coulomb friction: 12, coulomb friction + stribeck friction: 3, undecided: 4 |\n",
    )
    assert isinstance(console.file, io.StringIO)
    text = console.file.getvalue()
    assert max(map(len, text.splitlines())) <= width and "…" not in text and "|" not in text
    assert (
        "answered" in text and " ".join(text.split()).endswith("undecided: 4") and "coulomb_friction" in text
    )


FRAMES = set("━─│┃")  # characters that frame tables


def swings() -> list[rh.Record]:
    """Two records of a pushed mass on a spring."""
    time = 0.01 * np.arange(600)
    push = np.sin(3.0 * time) + np.sin(7.0 * time)
    shift = (np.sin(3.0 * time - 0.1) / 51.0) + np.sin(7.0 * time - 0.9) / 16.0
    noise = 1e-4 * np.random.default_rng(1).standard_normal((2, 600))
    return [
        rh.Record(name, Channel(time, shift + own, "m"), Channel(time, push, "N"))
        for name, own in zip(("one", "two"), noise, strict=True)
    ]


def compared() -> Batch:
    """A batch whose one parameter differs between rigs."""
    one = Agreement(
        "identify", "linear_spring.stiffness", "N/m", (None, None, None), 0, ("A", "B"), 60.1, 0.2, 0.1, 1.1, 0.4, 0.001,
        Slope(0.1, 0.05, 0.06, 3), "day", ("rig to rig",),
    )  # fmt: skip
    return Batch((), (one,), Path("week"))


def test_tables_fit_any_terminal_and_without_one_lines_are_whole(monkeypatch, capsys):
    model = rh.Model.from_text(
        "inertia: {mass: {value: 1.0, unit: kg, fixed: true}}\nforce:\n  - linear_spring: {stiffness: {value: 60.0, unit: N/m}}\n"
        "  - viscous_damper: {damping: {value: 1.5, unit: N*s/m}}\n"
    )
    first, second = swings()
    results = {
        "identify": rh.identify(first, model),
        "compare": rh.compare(first, second),
        "batch": compared(),
    }
    for name, found in results.items():
        for columns in ("40", "80"):
            monkeypatch.setenv("COLUMNS", columns)
            found.show(console())
            text = capsys.readouterr().out
            assert "…" not in text and max(map(len, text.splitlines())) <= int(columns), name
            assert columns == "80" or not set(text) & FRAMES
        monkeypatch.delenv("COLUMNS")
        found.show(console())
        text = capsys.readouterr().out
        assert "…" not in text and max(map(len, text.splitlines())) > 80, name
        assert name == "compare" or set(text) & FRAMES


def test_digits_follow_the_standard_deviation():
    assert estimate_cells(199.99612345, 0.00123) == ("199.9961", "0.0012")
    assert estimate_cells(1234.5, 210.0) == ("1230", "210")
    assert estimate_cells(0.1234567, None) == ("0.1235", "—")
    assert estimate_cells(None, None) == ("not identifiable", "—")
    assert estimate_cells(0.0, 4.3e-05) == ("0", "4.3e-05")
    assert with_std(1.76, 0.001) == "1.7600 ± 0.0010"


@pytest.mark.parametrize("width", [40, 100])
def test_estimates_print_to_their_digits_at_any_width(width):
    console = Console(file=io.StringIO(), width=width)
    print_estimates(console, "t", {"k": {"value": 200.00069, "std": 0.00047, "unit": "N/m"}}, "name")
    assert isinstance(console.file, io.StringIO)
    assert "200.00069" in console.file.getvalue() and "0.00047" in console.file.getvalue()


WITHOUT_JSON = {"export", "proof", "run"}  # what they write is for machines already


@pytest.mark.parametrize("name", [name for name in COMMANDS if name not in WITHOUT_JSON])
def test_every_answer_can_be_had_as_json(name):
    one = typer.main.get_command(app).commands[name]
    assert any("--json" in parameter.opts for parameter in one.params)


def test_init_and_convert_tell_their_guesses_as_json(command, tmp_path):
    time = 0.01 * np.arange(400)
    rows = np.column_stack([time, np.sin(3.0 * time), np.sin(3.0 * time + 0.8)])
    np.savetxt(tmp_path / "run.csv", rows, delimiter=",", header="t,torque,angle", comments="")
    begun = command("init", "run.csv", "--yes", "--json", "-")
    told = json.loads(begun.out)
    assert {role: one["channel"] for role, one in told["roles"].items()} == {
        "output": "angle",
        "input": "torque",
    }
    assert told["nominal"]["inertia.mass"]["unit"] == "kg*m^2" and told["files"]["model"] == "model.yaml"
    assert told["roles"]["output"]["reason"] and "go on with" in begun.err
    made = json.loads(command("convert", "run.csv", "--out", "bag", "--json", "-").out)
    assert made["samples"] == {"output": 400, "input": 400} and made["path"] == "bag"
    assert made["guessed"]["roles"]["input"]["channel"] == "torque"
    saved = json.loads(command("recover", "bag", "--json", "-").out)
    assert (
        saved["path"] == "bag_recovered" and set(saved["recovered"].values()) == {400} and saved["lost"] == {}
    )


def test_simulate_tells_what_it_wrote_as_json(command, tmp_path):
    rh.paper_hopper().save(tmp_path / "model.yaml")
    (tmp_path / "experiment.yaml").write_text("model: model.yaml\nexcitation: {type: silence, length: 0.5}\n")
    told = command(
        "simulate", "model.yaml", "--experiment", "experiment.yaml", "--out", "bag", "--json", "-"
    ).out
    assert json.loads(told)["path"] == "bag" and json.loads(told)["topics"]
