"""`rhythmid design`: a folder that can be played, the same numbers in terminal and JSON, refusals that leave nothing."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

import rhythmid as package
from rhythmid.design.requirements import Requirements
from rhythmid.experiment import Experiment
from rhythmid.offline_run import perform
from rhythmid.report.terminal_table import estimate_cells
from rhythmid.settings import Forcing

PAPER = Path(package.__file__).parent / "models" / "paper_hopper.yaml"
ARGUMENTS = ("--duration", 40, "--band", 0, 6, "--max-effort", 0.02, "--envelope", 0.13, 0.17, "--noise-std", 2e-5,
             "--rate", 250, "--harmonics", 2, "--delays", 0.04, 0.05)  # fmt: skip


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    return tmp_path_factory.mktemp("design")


@pytest.fixture
def made(folder, command):
    """A design made once by the command, and what it printed."""
    if not (folder / "said").exists():
        done = command(
            "design",
            PAPER,
            *ARGUMENTS,
            "--output",
            "out/plan",
            "--json",
            "out/plan.json",
            cwd=folder,
        )
        assert (done.code, done.err) == (0, ""), done.err
        (folder / "said").write_text(done.out, encoding="utf-8")
    return folder / "out" / "plan", (folder / "said").read_text(encoding="utf-8")


def played(plan: Path) -> tuple[np.ndarray, np.ndarray]:
    """The samples in the file: seconds, effort."""
    table = np.loadtxt(plan / "excitation.csv", delimiter=",", skiprows=1)
    return table[:, 0], table[:, 1]


def test_the_folder_holds_all_of_the_experiment(made):
    plan, said = made
    assert sorted(path.name for path in plan.iterdir()) == [
        "design.json", "design.png", "excitation.csv", "experiment.yaml", "model.yaml"
    ]  # fmt: skip
    assert (plan / "model.yaml").read_bytes() == PAPER.read_bytes()
    assert (plan / "design.png").read_bytes().startswith(b"\x89PNG")
    assert json.loads((plan / "design.json").read_text()) == json.loads(
        (plan.parent / "plan.json").read_text()
    )
    assert "predicted standard deviations" in said and "rhythmid run out/plan/experiment.yaml" in said


def test_every_free_parameter_and_both_delays_have_a_predicted_standard_deviation(made):
    plan, said = made
    result = json.loads((plan / "design.json").read_text())
    assert set(result["parameters"]) == {
        "linear_spring.stiffness",
        "linear_spring.rest_length",
        "switched_damper.stance",
    }
    assert set(result["delays"]) == {"input", "measurement", "sum"}
    for name, estimate in (result["parameters"] | result["delays"]).items():
        assert 0.0 < estimate["std"] < 0.1 * estimate["value"]
        assert estimate_cells(estimate["value"], estimate["std"])[1] in said, name
    assert result["amplitude"]["crest_factor"] < 1.8
    assert result["distortion"]["even"] > result["distortion"]["odd"] > 0.0


def test_a_forcing_that_nobody_has_stated_is_said_to_be_assumed_and_part_of_the_plan(made):
    plan, said = made
    assert "forcing of 1 N at 1 Hz, part of the plan" in said and "the model has no forcing" in said
    assert json.loads((plan / "design.json").read_text())["forcing"]["assumed"]
    machine = package.Model.load(PAPER)
    limits = (40.0, (0.0, 6.0), 0.02, (0.13, 0.17), 2e-5)
    assert Requirements.of(machine, *limits).forcing_assumed
    assert not Requirements.of(machine, *limits, forcing=Forcing(1.0, 1.0)).forcing_assumed


def test_the_example_in_the_documents_gives_what_they_show(command, tmp_path):
    text = (Path(__file__).parents[2] / "docs" / "design.md").read_text(encoding="utf-8")
    shown = re.search(r"    rhythmid (design .*?)\n\n((?:    [┃│][^\n]*\n)+)", text, re.DOTALL)
    assert shown is not None
    (tmp_path / "paper_hopper.yaml").write_bytes(PAPER.read_bytes())
    done = command(*shown[1].replace("\\\n", " ").split())
    assert done.code == 0, done.err
    for line in shown[2].splitlines():
        assert line.strip() in done.out
    result = json.loads((tmp_path / "plan" / "design.json").read_text())
    assert f"crest factor small: {result['amplitude']['crest_factor']:.2f} in the example" in text
    assert f"{result['distortion']['even']:.2%}".replace("%", " %") in text
    assert f"{result['distortion']['odd']:.2%}".replace("%", " %") in text


def test_what_is_played_is_the_file_sample_by_sample(made):
    plan, _ = made
    experiment = Experiment.load(plan / "experiment.yaml")
    time, effort = played(plan)
    assert len(time) == experiment.count == 10_000
    topics = perform(experiment)
    np.testing.assert_array_equal(topics["excitation"].effort, effort)
    np.testing.assert_allclose(topics["excitation"].stamp_ns * 1e-9, time, atol=1e-12)
    position = topics["joint_states"].position
    low, high = experiment.safety.envelope
    assert low < position.min() and position.max() < high
    assert np.max(np.abs(effort)) <= experiment.safety.max_effort


def test_simulating_and_identifying_the_design_gives_the_predicted_uncertainty(made, command):
    plan, _ = made
    done = command("simulate", plan / "model.yaml", "--experiment", plan / "experiment.yaml", "--out", "bag")
    assert done.code == 0, done.err
    done = command("identify", "bag", "--model", plan / "model.yaml", "--json", plan.parent / "found.json")
    assert done.code == 0, done.err
    predicted, found = (
        json.loads(path.read_text()) for path in (plan / "design.json", plan.parent / "found.json")
    )
    for group, names in (
        ("parameters", predicted["parameters"]),
        ("delays", ("input", "measurement", "sum")),
    ):
        for name in names:
            expected, actual = predicted[group][name], found[group][name]
            assert actual["std"] == pytest.approx(expected["std"], rel=0.1), name
            assert abs(actual["value"] - expected["value"]) < 4.5 * expected["std"], name


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--harmonics", 6), "aliases"),
        (("--envelope", 0.15, 0.16), "the limit cycle itself"),
        (("--duration", 5), "too short"),
        (("--kind", "sweep"), "one of comb, multisine"),
        (("--noise-std", "much"), "--noise-std"),
        (("--json", "/proc/where.json"), "cannot be written to"),
        (("--json", "plan"), "is named for two results"),
    ],
)
def test_a_refusal_is_one_line_and_leaves_nothing(arguments, words, refused, tmp_path):
    assert words in refused("design", PAPER, *ARGUMENTS, "--output", "plan", *arguments)
    assert list(tmp_path.iterdir()) == []


def test_a_folder_that_exists_is_not_overwritten(refused, tmp_path):
    (tmp_path / "plan").mkdir()
    assert "exists already" in refused("design", PAPER, *ARGUMENTS, "--output", "plan")
    assert list((tmp_path / "plan").iterdir()) == []
