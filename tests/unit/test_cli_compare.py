"""`rhythmid diagnose --sim`: from two bags to terminal, JSON and page, without a model."""

import json
from pathlib import Path

import pytest

from rhythmid.experiment import Experiment
from rhythmid.offline_run import perform
from rhythmid.record.bag_writer import write_bag

EXPERIMENT = """
model: machine.yaml
excitation: {{type: chirp, amplitude: 1.0, band: [0, 7], sweep: 8.0}}
forcing: {{amplitude: 1.0, frequency: 1.0}}
noise: {{measurement_std: {noise}}}
delays: {{input: {delay}, measurement: 0.0}}
"""
HOPPER = Path(__file__).parents[2] / "analysis/rhythmid/models/paper_hopper.yaml"


@pytest.fixture(scope="module")
def bags(tmp_path_factory):
    """Folder with a simulation's bag and a real one whose command arrives 20 ms late."""
    folder = tmp_path_factory.mktemp("bags")
    (folder / "machine.yaml").write_text(HOPPER.read_text())
    for name, noise, delay in (("sim", 0.0, 0.0), ("real", 1e-4, 0.02)):
        (folder / f"{name}.yaml").write_text(EXPERIMENT.format(noise=noise, delay=delay))
        messages = perform(Experiment.load(folder / f"{name}.yaml"))
        write_bag(
            folder / name, {topic: messages[topic] for topic in ("excitation", "forcing", "joint_states")}
        )
    return folder


def test_two_bags_are_enough(command, bags):
    done = command("diagnose", "real", "--sim", "sim", "--json", "out.json", "--report", "out.html", cwd=bags)
    assert done.code == 0, done.err
    assert "input delay" in " ".join(done.out.split())
    found = json.loads((bags / "out.json").read_text())["comparison"]
    assert found["slot"] == "command"
    assert found["explanations"][0]["parameters"]["delay"]["value"] == pytest.approx(0.02, abs=1e-3)
    page = (bags / "out.html").read_text()
    assert "Simulation against recording" in page and "they part here" in page


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((), "give --model NOMINAL.yaml, --sim BAG, or both"),
        (("--sim", "sim", "--save-model", "x.yaml"), "belong to a model"),
        (("--sim", "sim", "--budget", "10"), "belong to a model"),
        (("--model", "nominal.yaml", "--budget", "0"), "--budget is a number of seconds greater than 0"),
        (("--model", "nominal.yaml", "--budget", "nan"), "--budget is a number of seconds greater than 0"),
        (("--sim", "nowhere"), "nowhere: no such file"),
    ],
)
def test_what_is_missing_is_said_in_one_line(command, bags, arguments, words):
    done = command("diagnose", "real", *arguments, cwd=bags)
    assert done.code == 2
    assert words in done.err
    assert done.err.count("error:") == 1
