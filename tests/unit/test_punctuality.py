"""What a recording's own words on lateness and losses say to whoever analyses it."""

from pathlib import Path

import pytest

from rhythmid.diagnose.admission import admitted
from rhythmid.experiment import Experiment
from rhythmid.identify.identify import identify
from rhythmid.model import Model
from rhythmid.offline_run import perform
from rhythmid.record.bag_report import quality_report
from rhythmid.record.bag_writer import write_bag
from rhythmid.record.punctuality import punctuality_notes
from rhythmid.record.read import read_record

EXPERIMENT = """
model: paper_hopper.yaml
excitation: {type: chirp, amplitude: 0.05, band: [1, 7], sweep: 4.0}
"""
MODELS = Path(__file__).parents[2] / "analysis" / "rhythmid" / "models"


def stage(late, of=15000, longest=0.0231):
    return {"of": of, "late": late, "mean": 1e-4, "p99": 2e-3, "max": longest}


LATE = "1432 of 15000 commands were late, by up to 23.1 ms: use lockstep or a quieter machine"


def test_late_commands_and_measurements_and_losses_are_told():
    timing = {
        "excitation": stage(14000),
        "command_delay": stage(1432),
        "plant": stage(3),
        "measurement_delay": stage(200, 16000, 0.004),
        "lost": 7,
    }
    assert punctuality_notes({"timing": timing}) == (
        LATE,
        "200 of 16000 measurements were late, by up to 4 ms: use lockstep or a quieter machine",
        "7 messages were lost: use lockstep or a quieter machine",
    )


def test_the_sender_counts_where_nobody_holds_its_commands_back():
    assert punctuality_notes({"timing": {"excitation": stage(1432)}}) == (LATE,)


@pytest.mark.parametrize(
    "run",
    [
        None,
        {},
        {"timing": {"excitation": stage(140), "lost": 0}},
        {"timing": "of another program"},
        {"timing": {"plant": 3, "excitation": {"late": "many"}, "lost": None}},
    ],
)
def test_a_punctual_run_and_one_that_says_nothing_are_not_complained_of(run):
    assert punctuality_notes(run) == ()


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    """A recording of a few seconds whose graph was not punctual."""
    experiment = Experiment.from_text(EXPERIMENT, MODELS)
    run = {**experiment.description(), "timing": {"plant": stage(1432)}}
    return write_bag(tmp_path_factory.mktemp("late") / "bag", perform(experiment), run=run)


def test_check_repeats_it(bag):
    assert f"note: {LATE}" in "\n".join(quality_report(bag).lines())


def test_identify_and_diagnose_repeat_it_by_the_name_of_the_record(bag):
    record, nominal = read_record(bag), Model.load(MODELS / "paper_hopper.yaml")
    assert f"bag: {LATE}" in admitted([record], [], nominal).notes
    assert f"bag: {LATE}" in identify([record], nominal).notes
