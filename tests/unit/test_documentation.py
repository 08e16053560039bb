"""What the documents show works: every YAML block is read by the code that it is meant for."""

import json
import re
import shutil
from dataclasses import fields
from pathlib import Path

import pytest

import rhythmid
from rhythmid.batch.manifest import Manifest
from rhythmid.diagnose import rejections, verdict_rules
from rhythmid.diagnose.answer.result import ANSWER, Diagnosis
from rhythmid.experiment import Experiment
from rhythmid.identify.drive import controlled
from rhythmid.model import Model
from rhythmid.record.signals import Signals

ROOT = Path(__file__).parents[2]
PAPER = Path(rhythmid.__file__).parent / "models" / "paper_hopper.yaml"


def block(name: str) -> str:
    text = (ROOT / "docs" / "files.md").read_text(encoding="utf-8")
    found = re.search(rf"```yaml\n(# {name}\n.*?)```", text, re.DOTALL)
    assert found is not None
    return found[1]


def test_the_model_file_that_is_shown():
    model = Model.from_text(block("model.yaml"))
    assert model.value("switched_damper.stance") == 2.0
    assert "actuator_lag.time_constant" in model.free


def test_the_experiment_file_that_is_shown(tmp_path):
    shutil.copy(PAPER, tmp_path)
    experiment = Experiment.from_text(block("experiment.yaml"), tmp_path)
    assert experiment.count == 300_000


def test_the_manifest_that_is_shown(tmp_path):
    text = (ROOT / "docs" / "batch.md").read_text(encoding="utf-8")
    found = re.search(r"```yaml\n(.*?)```", text, re.DOTALL)
    assert found is not None
    (tmp_path / "week.yaml").write_text(found[1], encoding="utf-8")
    first, second = Manifest.load(tmp_path / "week.yaml").entries
    assert first.entry.group == "rig A" and second.options.method == "joint"


def test_the_signals_file_that_is_shown(tmp_path):
    (tmp_path / "signals.yaml").write_text(block("signals.yaml"), encoding="utf-8")
    assert Signals.load(tmp_path / "signals.yaml").use == (10.0, 90.0)


@pytest.mark.parametrize("machine", ["joint", "axis", "servo", "wheel", "motor", "pendulum", "rig", "film"])
def test_the_files_of_other_machines_are_read_and_fit_together(machine, tmp_path):
    text = (ROOT / "docs" / "machines.md").read_text(encoding="utf-8")
    shown = {name: found[1] for name in ("signals", "model")
             if (found := re.search(rf"```yaml\n(# {name}.yaml: {machine}\n.*?)```", text, re.DOTALL))}  # fmt: skip
    signals = Signals.from_text(shown["signals"], tmp_path / "signals.yaml")
    model = Model.from_text(shown["model"])
    assert model.free and signals.channels["output"].file is not None
    assert (signals.input_kind == "reference") == controlled(model)
    assert model.units.position == signals.channels["output"].unit.removesuffix("/s")


@pytest.mark.parametrize(
    "document",
    [
        "README.md",
        "docs/batch.md",
        "docs/files.md",
        "docs/machines.md",
        "docs/real.md",
        "docs/recordings.md",
        "docs/diagnose.md",
        "docs/python.md",
        "docs/export.md",
    ],
)
def test_links_lead_to_files_that_exist(document):
    text = (ROOT / document).read_text(encoding="utf-8")
    for target in re.findall(r"\]\((?!https?:)([^)#]+)", text) + re.findall(r"<img src=\"([^\"]+)", text):
        assert (ROOT / document).parent.joinpath(target).exists(), target


@pytest.mark.parametrize(
    ("name", "table"), [("rejections", rejections.table), ("verdicts", verdict_rules.table)]
)
def test_the_tables_of_rejections_and_verdicts_are_the_ones_that_the_code_goes_by(name, table):
    page = (ROOT / "docs" / "diagnose.md").read_text(encoding="utf-8")
    found = re.search(rf"<!-- {name} -->\n(.*?)\n<!-- /{name} -->", page, re.DOTALL)
    assert found is not None and found[1] == table(), f"python -m {table.__module__}"


def test_the_answer_that_is_shown_has_the_fields_of_a_diagnosis_and_no_others():
    text = (ROOT / "docs" / "files.md").read_text(encoding="utf-8")
    found = re.search(r"```json\n(.*?)```", text, re.DOTALL)
    assert found is not None
    shown = json.loads(found[1])
    assert ANSWER.validate_python(shown).verdict == "missing_physics"
    assert set(shown) == {one.name for one in fields(Diagnosis)}


def test_every_field_of_a_diagnosis_is_explained():
    page = (ROOT / "docs" / "diagnose.md").read_text(encoding="utf-8")
    explained = page.partition("## The JSON")[2].partition("\n## ")[0]
    for one in fields(Diagnosis):
        assert re.search(rf"`{one.name}[`.\[]", explained), one.name


def test_the_packages_agree_about_their_version():
    manifests = [ROOT / "analysis" / "package.xml", *(ROOT / "ros_ws" / "src").glob("*/package.xml")]
    versions = [re.search(r"<version>(.*)</version>", path.read_text(encoding="utf-8")) for path in manifests]
    assert {found[1] for found in versions if found} == {rhythmid.__version__}
    assert len(manifests) == 3


def test_what_the_makefile_offers_is_what_the_readme_names():
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    for target in re.findall(r"`?make ([a-z]+)", readme):
        assert re.search(rf"^{target}:", makefile, re.MULTILINE), target
