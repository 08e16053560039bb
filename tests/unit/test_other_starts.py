"""A fit that starts from short windows finds the motion of a machine that parts from it at the slightest difference."""

import numpy as np
import pytest
from untidy_logs import FAULTS, MACHINES, simulated, written

from rhythmid.diagnose.admission import admitted
from rhythmid.diagnose.baseline import calibrate
from rhythmid.elements.catalogue import load_catalogue
from rhythmid.identify.identify import identify
from rhythmid.identify.multiple_shooting import periods_long, windows
from rhythmid.identify.plausibility import likely_mend
from rhythmid.identify.series import hold_out_tail, prepare
from rhythmid.model import Model
from rhythmid.record.read import read_record

MACHINE = MACHINES["pendulum"]  # driven over the top
NOISE = 1e-3  # share of the motion


def files(folder, kind, seed):
    table = FAULTS[kind](np.random.default_rng(1000 + seed), simulated(MACHINE, 0.0, seed, kind))
    return written(folder / "run", MACHINE, table)


@pytest.mark.parametrize(("kind", "seed"), [("few_lost", 501), ("lost_apart", 501), ("lost_apart", 521)])
@pytest.mark.parametrize("long", [True, False])
def test_a_pendulum_that_turns_over_is_followed_with_lost_samples_too(tmp_path, kind, seed, long):
    signals, nominal = files(tmp_path, kind, seed)
    model = Model.load(nominal)
    series = prepare(admitted([read_record(signals)], (), model).records)
    cut, _ = hold_out_tail(series if long else windows(series, periods_long(series[0])))
    found = calibrate(model, cut, load_catalogue()).fit
    assert found.nrmse() < NOISE
    assert found.model.value("pendulum_gravity.moment") == pytest.approx(1.0, abs=1e-4)


def test_identify_follows_a_pendulum_that_turns_over(tmp_path):
    signals, model = files(tmp_path, "few_lost", 501)
    found = identify([read_record(signals)], Model.load(model))
    assert found.usable and found.parameters["pendulum_gravity.moment"].value == pytest.approx(1.0, abs=1e-4)


def test_a_stretch_between_gaps_in_which_a_pendulum_turns_over_is_not_taken_for_one_of_the_other_sign(
    tmp_path,
):
    signals, nominal = files(tmp_path, "gaps", 514)
    model = Model.load(nominal)
    assert likely_mend(model, admitted([read_record(signals)], (), model).records) is None
