"""The noise of a measured motion in the effort that a model requires is no physics that a free map may claim."""

from dataclasses import replace

import numpy as np
import pytest
from axes import axis, axis_model, frame, frame_model

from rhythmid.diagnose.effort.reference import beyond_noise
from rhythmid.diagnose.hypothesis import Prediction
from rhythmid.identify.inverse_dynamics.balance import Balance
from rhythmid.identify.inverse_dynamics.motion_noise import noise_power


def noisier(record, std):
    output = record.output
    rng = np.random.default_rng(4)
    return replace(
        record, output=replace(output, value=output.value + rng.normal(0.0, std, len(output.value)))
    )


def test_the_noise_of_the_motion_in_the_required_effort_is_that_of_its_floor():
    model, quiet = axis_model(), axis(noise=1e-3, jitter=0.0)
    noisy = noisier(quiet, 2e-4)
    balance = Balance.of([noisy], model)
    clean = Balance.of([quiet], model, balance.bandwidth)
    true = np.mean((balance.required(model)[0] - clean.required(model)[0]) ** 2)
    found = noise_power(balance, [noisy], model)
    everywhere = balance.filtered(
        balance.required(model)[0] - clean.required(model)[0], balance.motions[0].period
    )
    assert found == pytest.approx(float(np.mean(everywhere**2)), rel=0.5)
    assert found < true  # the filter of the comparison takes noise off
    assert noise_power(clean, [quiet], model) < 0.05 * found


def test_the_effort_of_a_machine_on_a_moving_base_holds_the_same_noise():
    model, clean = frame_model(), frame()
    noisy = noisier(clean, 4e-4)
    balance = Balance.of([noisy], model)
    before = Balance.of([clean], model, balance.bandwidth)
    error, own = (
        one.filtered(one.required(model)[0] - one.motions[0].effort, one.motions[0].period)
        for one in (balance, before)
    )
    assert noise_power(balance, [noisy], model) == pytest.approx(float(np.mean((error - own) ** 2)), rel=0.5)


def prediction(error):
    error = np.asarray(error, dtype=float)
    return Prediction(-(error**2), error**2, np.ones(len(error)))


def test_a_map_that_removes_less_than_the_noise_of_the_motion_predicts_no_better():
    plain, mapped = prediction([2.0, 2.0, 2.0]), prediction([1.0, 1.5, 2.0])
    gain = plain.mean_square - mapped.mean_square
    kept = beyond_noise(mapped, plain, 2.0 * gain)
    assert kept.mean_square == plain.mean_square and kept.score == plain.score
    half = beyond_noise(mapped, plain, 0.5 * gain)
    assert plain.mean_square - half.mean_square == pytest.approx(0.5 * gain)
    assert half.score - plain.score == pytest.approx(0.5 * (mapped.score - plain.score))


def test_a_map_that_predicts_worse_stays_as_it_is():
    plain, mapped = prediction([1.0, 1.0]), prediction([1.5, 1.0])
    assert beyond_noise(mapped, plain, 0.1) is mapped
