"""What lies in a case's folder: records that `rhythmid` reads, a nominal model, and answers that can be scored again."""

import json
import shutil
from dataclasses import asdict, replace
from functools import cache
from pathlib import Path
from typing import get_args

import numpy as np
import pytest
from contests import contest, predicted, supposed
from matplotlib.figure import Figure

from rhythmid.commands.proof import Machines
from rhythmid.diagnose.replay import ledger
from rhythmid.elements.catalogue import load_catalogue
from rhythmid.errors import InputError
from rhythmid.identify.drive import driven
from rhythmid.model import Model
from rhythmid.proof.campaign import ALL, Campaign, begin
from rhythmid.proof.draw import draw_case
from rhythmid.proof.examine import _records
from rhythmid.proof.machines.designs import DESIGNS
from rhythmid.proof.perform import JUDGE, LEARN, NOMINAL, perform
from rhythmid.proof.pool import pool
from rhythmid.proof.reliability import draw_reliability
from rhythmid.proof.replay import replay_campaign, replayed, told_hashes
from rhythmid.proof.score import Stated
from rhythmid.proof.seal import seal, truth_of
from rhythmid.record.read import load_records

INPUT = {
    "hopper": "force", "axis": "force", "joint": "force", "shaken": "base_displacement", "servo": "reference",
    "motor": "force",
}  # fmt: skip


@pytest.fixture(scope="module")
def catalogue():
    return load_catalogue()


@pytest.fixture(scope="module")
def drawn(catalogue):
    """drawn("axis", False): a case of this machine, tidy or cluttered, the same one for all tests."""
    return cache(lambda design, cluttered: draw_case(4, "null", 0, catalogue, design, cluttered))


TIDY = [(design, False) for design in DESIGNS if design != "hopper"]


@pytest.mark.parametrize(("design", "cluttered"), [*TIDY, ("servo", True)])
def test_records_of_every_machine_can_be_read_and_drive_its_nominal_model(
    design, cluttered, drawn, catalogue, tmp_path, monkeypatch
):
    monkeypatch.setattr(
        "rhythmid.proof.draw.put_clutter", lambda *_: ()
    )  # what clutter there is does not matter here
    case = drawn(design, cluttered)
    perform(case, tmp_path, [1])
    model = Model.load(tmp_path / NOMINAL, catalogue)
    for part, runs in ((LEARN, case.rig.runs), (JUDGE, case.rig.unseen)):
        records = load_records(_records(tmp_path / part))
        assert len(records) == len(runs)
        for record in records:
            used = driven(record, model)
            assert used.input is None if design in ("decay", "pendulum") and not case.rig.runs[0].command.any() else (
                used.input is not None and used.input_kind == INPUT.get(design, "force")
            )  # fmt: skip
            assert record.output_kind == ("velocity" if design == "motor" else "position")
            run = next(run for run in runs if run.name in (record.name, Path(record.name).stem))
            seen = case.observe(run)
            assert seen is not None and len(record.output) == len(run.time)
            error = np.abs(record.output.value - seen.measured)
            assert np.median(error) < 3.0 * case.noise.std
            steps = np.diff(record.output.time)
            assert (np.std(steps) * run.rate > 1e-3) == cluttered


def test_the_effort_that_is_logged_has_the_noise_that_the_case_says(drawn, tmp_path):
    case = drawn("axis", False)
    perform(case, tmp_path, [1])
    (record, *_) = load_records(_records(tmp_path / LEARN))
    run = next(run for run in case.rig.runs if run.name in (record.name, Path(record.name).stem))
    seen = case.observe(run)
    assert seen is not None and record.input is not None
    noise = record.input.value - seen.effort
    assert np.std(noise) == pytest.approx(case.rig.effort_noise * np.sqrt(np.mean(seen.effort**2)), rel=0.05)


def test_the_command_line_knows_every_machine():
    assert set(get_args(Machines)) == {*DESIGNS, ALL}


@pytest.fixture
def kept(drawn, tmp_path) -> tuple[Path, Campaign]:
    """A campaign of one case that is done, its answer made up."""
    campaign = Campaign(4, "null", 1, "decay")
    (task,) = campaign.tasks
    out = tmp_path / "out"
    begin(out, campaign, resume=False)
    case = drawn("decay", False)
    told = seal(out / "sealed" / f"{task.name}.json", truth_of(case, {1: 0.01}))
    (out / "seals.txt").write_text(f"2026-01-01T00:00:00  {told}  {task.name}\n")
    folder = out / "cases" / task.name
    folder.mkdir(parents=True)
    evidence = contest(supposed("", predicted(1.0)), supposed("quadratic_drag", predicted(0.05)))
    answer = {
        "verdict": "missing_physics", "indistinguishable": [], "block": 1, "seconds": 2.0, "processor_seconds": 3.0,
        "missing": [{"element": "quadratic_drag", "slot": "force", "probability": 0.9, "parameters": {}}],
        "evidence": ledger(evidence, 0.001, {}),
    }  # fmt: skip
    (folder / "answer.json").write_text(json.dumps(answer))
    return out, campaign


def test_kept_answers_are_scored_by_a_verdict_reached_anew_without_touching_the_campaign(kept):
    out, campaign = kept
    before = {path: path.read_bytes() for path in out.rglob("*") if path.is_file()}
    (one,), anew = replay_campaign(out, campaign, campaign.tasks)
    assert anew == 1 and (one.seconds, one.processor_seconds) == (2.0, 3.0)
    assert one.false_alarm and one.stated_wrong == ("quadratic_drag",)
    assert "--replay" in (out / "replay.md").read_text()
    assert json.loads((out / "replay.json").read_text())["cases"][0]["case"] == one.case
    assert {path: path.read_bytes() for path in before} == before


def test_campaigns_have_one_card_and_one_reliability_diagram_together(kept, tmp_path):
    out, campaign = kept
    other, card = tmp_path / "other", tmp_path / "card"
    shutil.copytree(out, other)
    scores = pool(card, [out, other])
    assert [one.case.split("/")[0] for one in scores] == ["out", "other"]
    written = json.loads((card / "proof.json").read_text())
    assert written["commands"] == [f"{campaign.command}: 1 of 1"] * 2
    assert written["null"]["rates"]["something named"]["hits"] == 2
    assert sum(row["right"]["of"] for row in written["reliability"]) == 2
    assert (card / "reliability.png").read_bytes().startswith(b"\x89PNG")
    with pytest.raises(InputError, match="holds no campaign"):
        pool(card, [out, tmp_path / "nowhere"])


def test_the_reliability_diagram_draws_a_law_that_the_catalogue_lacks_apart(kept):
    out, campaign = kept
    ((known,), _) = replayed(out, campaign.tasks)
    axis = Figure().subplots()
    draw_reliability(axis, [known, replace(known, kind="left-out", stated=(Stated("a", 0.9, True),))])
    shares = [list(drawn.lines[0].get_ydata()) for drawn in axis.containers]
    assert shares == [[0.0], [1.0]]


def test_a_folder_without_answers_cannot_be_replayed(tmp_path):
    campaign = Campaign(4, "null", 1, "decay")
    with pytest.raises(InputError, match="no answer"):
        replay_campaign(tmp_path, campaign, campaign.tasks)
    assert told_hashes(tmp_path) == {}


def test_a_truth_that_was_changed_since_is_not_scored(kept):
    out, campaign = kept
    path = out / "sealed" / f"{campaign.tasks[0].name}.json"
    path.write_text(path.read_text().replace('"null"', '"single"'))
    with pytest.raises(InputError, match="seal is broken"):
        replay_campaign(out, campaign, campaign.tasks)


def test_a_campaign_is_described_by_the_file_that_it_leaves(kept):
    out, campaign = kept
    assert json.loads((out / "campaign.json").read_text()) == asdict(campaign)
