"""The commands for machines of several joints, from simulation to diagnosis."""

import json
import subprocess
import sys
from importlib.resources import files
from pathlib import Path

import demo_leg
import pytest
from legged import fixed_leg
from typer.testing import CliRunner

import rhythmid as rh
from rhythmid.body.joint_experiment import JointExperiment
from rhythmid.body.machine import Machine
from rhythmid.cli import app
from rhythmid.errors import InputError

LEGS = Path(str(files("rhythmid"))) / "models" / "legs"
SIGNALS = str(LEGS / "leg_signals.yaml")


def called(*arguments: str) -> str:
    """What a command prints."""
    found = CliRunner().invoke(app, list(arguments), catch_exceptions=False)
    assert found.exit_code == 0, found.output
    return found.output


@pytest.fixture(scope="module")
def bags(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A leg in the air, and a bag of one whose knee has dry friction."""
    folder = tmp_path_factory.mktemp("legs")
    text = fixed_leg(folder).read_text()
    knee = text.index("knee:")
    rough = text[knee:].replace("force: [", "force: [{coulomb_friction: {force: 0.3, transition: 0.02}}, ")
    (folder / "rough.yaml").write_text(text[:knee] + rough)
    whole = (LEGS / "leg_experiment.yaml").read_text()
    (folder / "experiment.yaml").write_text(
        whole.replace("start: {rail: 0.45}", "").replace("12.0 ", "8.0 ").replace("rate: 500", "rate: 1000")
    )
    signals = (LEGS / "leg_signals.yaml").read_text()
    (folder / "signals.yaml").write_text(signals[: signals.index("base:")])
    experiment = str(folder / "experiment.yaml")
    called("simulate", str(folder / "rough.yaml"), "--experiment", experiment, "--out", str(folder / "rough"))
    return folder


def test_friction_that_was_concealed_in_a_knee_is_named_there(bags: Path):
    answer = bags / "answer.json"
    model, better = str(bags / "leg.yaml"), bags / "better.yaml"
    printed = called(
        "diagnose", str(bags / "rough"), "--model", model, "--signals", str(bags / "signals.yaml"), "--json", str(answer),
        "--save-model", str(better), "--report", str(bags / "report.html"),
    )  # fmt: skip
    found = json.loads(answer.read_text())
    assert found["verdict"] == "missing_physics"
    assert [(one["joint"], one["element"], one["slot"]) for one in found["missing"]] == [
        ("knee", "coulomb_friction", "force")
    ]
    (friction,) = found["missing"]
    assert friction["parameters"]["force"]["value"] == pytest.approx(0.3, abs=0.02)
    assert friction["probability"] > 0.8 and friction["heldout_gain"] > 0.02
    assert found["joints"]["hip"]["verdict"] == "consistent"
    (family,) = found["families"]["knee"]
    assert list(found["families"]) == ["knee"] and family["family"] == "friction"
    assert friction["probability"] - 1e-9 <= family["probability"] <= 1.0
    assert "coulomb_friction" in family["laws"] and "knee: some form of friction" in printed
    page = (bags / "report.html").read_text()
    assert "Missing physics: Coulomb friction at knee" in page
    assert "probability of a law of it" in page and "friction" in page
    assert page.count('class="slot faulty"') == 1 and "Parameters at knee" in page
    assert "Effort at knee over time" in page and "hip: consistent" in page
    assert "knee" in printed and "coulomb_friction" in better.read_text()


def test_a_leg_is_identified_from_its_bag(bags: Path):
    answer = bags / "identified.json"
    called(
        "identify", str(bags / "rough"), "--model", str(bags / "rough.yaml"), "--signals", str(bags / "signals.yaml"),
        "--json", str(answer), "--report", str(bags / "identified.html"),
    )  # fmt: skip
    page = (bags / "identified.html").read_text()
    assert "Measured against predicted at knee" in page and "What is left at hip over frequency" in page
    assert "Parameters of knee" in page and "Correlation of the parameters" in page
    found = json.loads(answer.read_text())
    assert found["parameters"]["knee.coulomb_friction.force"]["value"] == pytest.approx(0.3, abs=0.02)
    assert found["parameters"]["body.knee.armature"]["value"] == pytest.approx(0.006, abs=0.0005)
    inertia = found["inertia"]
    assert 0 < inertia["rank"] < inertia["count"] == 20
    assert inertia["links"]["shank"]["m"] == pytest.approx(0.22, rel=0.2)


def test_a_leg_is_answered_in_a_batch_as_alone(bags: Path):
    entries = [{"bags": str(bags / "rough")}]
    files = {"model": str(bags / "rough.yaml"), "signals": str(bags / "signals.yaml")}
    found = rh.batch({"command": "identify", **files, "entries": entries}, bags / "batch")
    ((task, answered),) = found.answers
    assert not answered.failure and task.machine
    values = {one.name: one for one in answered.values}
    assert values["knee.coulomb_friction.force"].value == pytest.approx(0.3, abs=0.02)
    assert "knee: Coulomb friction" in (bags / "batch" / "answers" / f"{task.file}.html").read_text()


def test_an_exported_leg_in_a_loop_of_mujocos_own_is_nearer_to_the_recording_with_its_paths_applied(
    bags: Path,
):
    for name, model in (("before", "leg.yaml"), ("after", "rough.yaml")):
        called("export", str(bags / model), "--to", "mujoco", "--out", str(bags / f"{name}.xml"))
    arguments = [
        *(str(bags / name) for name in ("before.xml", "after.xml", "rough")),
        str(bags / "signals.yaml"),
    ]
    script = Path(__file__).parents[2] / "docs" / "examples" / "mujoco_loop.py"
    printed = subprocess.run([sys.executable, script, *arguments], capture_output=True, text=True, check=True)
    errors = {line.split(":")[0]: float(line.split()[2]) for line in printed.stdout.splitlines()}
    assert errors["after, knee"] < 0.3 * errors["before, knee"] and errors["before, knee"] > 0.5


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["diagnose", "{bag}", "--model", "{leg}"], "needs --signals"),
        (
            ["diagnose", "{bag}", "--model", "{leg}", "--signals", SIGNALS, "--sim", "{bag}"],
            "--sim is for a machine of one axis",
        ),
        (
            ["diagnose", "{bag}", "--model", "{floating}", "--signals", "{signals}"],
            "the base of quadruped.xml floats",
        ),
        (
            ["identify", "{bag}", "--model", "{other}", "--signals", "{signals}"],
            "the joint 'leg' is not recorded",
        ),
        (
            ["identify", "{bag}", "--model", "{leg}", "--signals", SIGNALS, "--method", "paper"],
            "--method is for a machine of one axis",
        ),
        (
            ["identify", "{bag}", "--model", "{leg}", "--signals", SIGNALS, "--htf", "auto"],
            "--htf is for a machine of one axis",
        ),
        (
            ["identify", "{bag}", "--model", "{leg}", "--signals", "{signals}", "--holdout", "{bag}"],
            "rough: is fitted and held out",
        ),
        (["export", "{leg}", "--to", "sdf", "--out", "{new}"], "is written as mujoco or urdf"),
        (["export", "{leg}", "--to", "urdf", "--out", "{new}"], "a file that ends in .urdf"),
        (["simulate", "{leg}", "--experiment", "{wrong}", "--out", "{new}"], "the joint 'ankle' has no path"),
    ],
)
def test_what_cannot_be_done_is_told_in_one_line(bags: Path, arguments: list[str], said: str):
    quadruped = (
        (LEGS / "quadruped.yaml")
        .read_text()
        .replace("quadruped.xml", str(LEGS / "quadruped.xml, base: free"))
    )
    (bags / "floating.yaml").write_text(quadruped)
    (bags / "wrong.yaml").write_text("duration: 1\nexcitation: {ankle: {offset: 1}}\n")
    places = {
        "bag": bags / "rough", "leg": LEGS / "leg.yaml", "floating": bags / "floating.yaml",
        "other": LEGS / "hopper.yaml", "signals": bags / "signals.yaml", "wrong": bags / "wrong.yaml", "new": bags / "new",
    }  # fmt: skip
    with pytest.raises(InputError, match=said) as caught:
        CliRunner().invoke(app, [one.format(**places) for one in arguments], catch_exceptions=False)
    assert "\n" not in str(caught.value)
    assert not (bags / "new").exists()


def test_the_demonstration_conceals_one_effect_at_one_joint_and_seals_what_it_was(tmp_path: Path):
    plant, sealed = demo_leg.conceal(tmp_path, 3)
    truth = json.loads(sealed.read_text())
    given, made = (Machine.load(one) for one in (LEGS / "leg.yaml", plant))
    more = {
        joint: [term.label for term in made.paths[joint].terms if given.paths[joint].term(term.label) is None]
        for joint in given.joints
    }
    assert more == {joint: [truth["element"]] * (joint == truth["joint"]) for joint in given.joints}
    assert [JointExperiment.load(tmp_path / f"{one}.yaml").duration for one in demo_leg.RECORDS] == [8.0, 8.0]
