"""Tests of agreement keep the false alarms that they state, and see what is there."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import kstest

from rhythmid.batch.scatter import between_runs, groups_agree, holm, homogeneous, random_effects, trend

SETS = 150  # of simulated runs
FAR = 1e-3  # p-value of a distribution of p-values that is no longer taken for uniform


def simulated(runs: int, groups: int, seed: int, scatter: float = 0.0, drift: float = 0.0):
    """p-values of each test over many sets of runs with stated standard deviations, and scatter or drift beyond them."""
    rng = np.random.default_rng(seed)
    names = [str(run * groups // runs) for run in range(runs)]
    found: dict[str, list[float]] = {"runs": [], "groups": [], "trend": []}
    for _ in range(SETS):
        stds, times = np.exp(rng.normal(0.0, 0.7, runs)), rng.uniform(0.0, 10.0, runs)
        values = 5.0 + stds * rng.normal(size=runs) + scatter * rng.normal(size=runs) + drift * times
        made = (
            homogeneous(values, stds, names),
            groups_agree(values, stds, names),
            trend(values, stds, names, times),
        )
        assert made[0] is not None and made[1] is not None and made[2] is not None
        found["runs"].append(made[0][1])
        found["groups"].append(made[1])
        found["trend"].append(made[2].p_value)
    return {name: np.array(p) for name, p in found.items()}


@pytest.mark.parametrize(("runs", "groups"), [(4, 2), (12, 3)])
def test_with_nothing_but_noise_every_p_value_is_uniform(runs, groups):
    for name, p_values in simulated(runs, groups, seed=runs).items():
        assert kstest(p_values, "uniform").pvalue > FAR, name
        assert np.mean(p_values < 0.05) == pytest.approx(0.05, abs=0.054), name  # three standard deviations


def test_scatter_beyond_what_is_stated_is_seen_and_is_no_difference_of_rigs_and_no_trend():
    p_values = simulated(12, 3, seed=1, scatter=6.0)
    assert np.mean(p_values["runs"] < 0.01) > 0.9
    assert np.mean(p_values["groups"] < 0.05) < 0.1
    assert np.mean(p_values["trend"] < 0.05) < 0.1


def test_no_parameter_of_a_batch_of_many_is_said_to_differ_more_often_than_stated():
    p_values = simulated(8, 2, seed=2)
    sets = list(zip(*p_values.values()))
    batches = [np.concatenate(sets[begin : begin + 4]) for begin in range(0, SETS - 3, 4)]
    assert np.mean([min(holm(list(one))) < 0.05 for one in batches]) < 0.15  # three standard deviations


def test_rigs_that_differ_and_values_that_drift_are_seen():
    rng, stds = np.random.default_rng(3), np.full(10, 0.1)
    noise, names, times = stds * rng.normal(size=10), ["a", "b"] * 5, np.arange(10.0)
    apart = noise + np.tile([0.0, 1.0], 5)
    assert (groups_agree(apart, stds, names) or 1.0) < 1e-3
    drifting = trend(apart + 0.2 * times, stds, names, times)
    assert drifting is not None and drifting.p_value < 1e-4
    assert drifting.value == pytest.approx(0.2, abs=4.0 * drifting.std)


def test_the_scatter_of_paule_and_mandel_brings_q_to_its_degrees_of_freedom():
    rng, stds = np.random.default_rng(4), np.exp(np.random.default_rng(5).normal(0.0, 0.5, 40))
    values = 7.0 + np.hypot(stds, 3.0) * rng.normal(size=40)
    tau = between_runs(np.ones((40, 1)), values, stds)
    weights = 1.0 / (stds**2 + tau**2)
    mean = np.average(values, weights=weights)
    assert np.sum(weights * (values - mean) ** 2) == pytest.approx(39.0, rel=1e-6)
    found = random_effects(values, stds)
    assert found.value == pytest.approx(mean) and found.std == pytest.approx(np.sum(weights) ** -0.5)
    assert tau == pytest.approx(3.0, rel=0.5)


def test_what_cannot_be_tested_is_not():
    one, ones = np.array([1.0]), np.ones(2)
    assert homogeneous(one, one, ["a"]) is None and homogeneous(ones, ones, ["a", "b"]) is None
    assert groups_agree(ones, ones, ["a", "a"]) is None and groups_agree(ones, ones, ["a", "b"]) is None
    assert trend(ones, ones, ["a", "a"], np.arange(2.0)) is None
    assert trend(np.ones(5), np.ones(5), ["a"] * 5, np.zeros(5)) is None  # all at one time


def test_equal_estimates_agree():
    same, names = np.full(6, 3.0), ["a", "b"] * 3
    assert homogeneous(same, np.ones(6), names) == pytest.approx((0.0, 1.0), abs=1e-6)
    assert groups_agree(same, np.ones(6), names) == 1.0
    found = trend(same, np.ones(6), names, np.arange(6.0))
    assert found is not None and found.value == pytest.approx(0.0, abs=1e-9)


@settings(max_examples=15)
@given(
    st.lists(st.integers(-100, 100), min_size=3, max_size=8), st.floats(1e-3, 1e3), st.integers(-1000, 1000)
)
def test_units_and_origin_of_a_quantity_do_not_matter(values, scale, origin):
    shown, stds, names = (
        np.array(values, dtype=float),
        np.ones(len(values)),
        ["a", "b", *["a"] * (len(values) - 2)],
    )
    moved = scale * (shown + origin)
    first, second = homogeneous(shown, stds, names), homogeneous(moved, scale * stds, names)
    assert first is not None and second is not None
    assert second == pytest.approx(first, rel=1e-6, abs=1e-9)
    again = groups_agree(moved, scale * stds, names)
    assert again == pytest.approx(groups_agree(shown, stds, names), rel=1e-3, abs=1e-6)
