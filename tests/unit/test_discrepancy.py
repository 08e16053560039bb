"""What small effects that a model lacks do to its parameters: standard deviations that hold the truth, and nothing where nothing is lacking."""

from functools import partial

import numpy as np
import pytest

from rhythmid.diagnose import discrepancy
from rhythmid.diagnose.discrepancy import mean_product
from rhythmid.identify.least_squares import reduced

ROWS, PARAMETERS, CANDIDATES = 600, 3, 20


def problem(rng, size, own):
    """A linear problem whose residual shows effects of this size, in units of the noise over all rows: the error of the estimates,
    their standard deviations from the noise alone, and with the discrepancy. The smaller the part of each effect is that is its
    `own`, the more of it the parameters reproduce."""
    basis = rng.normal(size=(ROWS, 6))  # so that candidates and parameters are alike in part
    jacobian = basis @ rng.normal(size=(6, PARAMETERS)) + 0.3 * rng.normal(size=(ROWS, PARAMETERS))
    candidates = basis @ rng.normal(size=(6, CANDIDATES)) + own * rng.normal(size=(ROWS, CANDIDATES))
    span, _ = np.linalg.qr(jacobian)
    candidates /= np.linalg.norm(candidates - span @ (span.T @ candidates), axis=0)
    missing = candidates @ (size * rng.normal(size=CANDIDATES))
    measured = missing + rng.normal(size=ROWS)
    inverse = np.linalg.inv(jacobian.T @ jacobian)
    error = inverse @ (jacobian.T @ measured)
    residual = jacobian @ error - measured
    added = mean_product(
        jacobian, residual, np.geomspace(1.0, 50.0, CANDIDATES) * candidates, inverse, np.inf
    )
    return error, np.sqrt(np.diag(inverse)), np.sqrt(np.diag(inverse + added))


def share_held(size, own, draws=100):
    """Shares of the estimates within 1.96 standard deviations, from the noise alone and with the discrepancy, and the mean widening."""
    rng = np.random.default_rng(7)
    made = [problem(rng, size, own) for _ in range(draws)]
    plain = np.mean([np.abs(error) < 1.96 * std for error, std, _ in made])
    whole = np.mean([np.abs(error) < 1.96 * std for error, _, std in made])
    return plain, whole, np.mean([wide / std for _, std, wide in made])


def test_many_rows_give_the_same_in_parts(monkeypatch):
    rng = np.random.default_rng(5)
    jacobian, candidates = rng.standard_normal((500, 3)), rng.standard_normal((500, 4))
    residual = 3.0 * candidates @ rng.standard_normal(4) + rng.standard_normal(500)
    inverse = np.linalg.inv(jacobian.T @ jacobian)
    whole = mean_product(jacobian, residual, candidates, inverse, np.inf)
    monkeypatch.setattr(discrepancy, "ROWS", 40)
    monkeypatch.setattr(discrepancy, "reduced", partial(reduced, most=60))
    np.testing.assert_allclose(
        mean_product(jacobian, residual, candidates, inverse, np.inf), whole, rtol=1e-9
    )
    assert whole.any()


@pytest.mark.parametrize(
    "own", [2.0, np.geomspace(0.1, 4.0, CANDIDATES)], ids=["little", "from little to nearly all"]
)
@pytest.mark.parametrize("size", [0.5, 1.0, 3.0, 6.0])
def test_intervals_hold_the_truth_beside_small_effects_that_the_parameters_reproduce_in_part(size, own):
    plain, whole, _ = share_held(size, own)
    assert plain < (0.91 if size < 1.0 else 0.8)
    assert 0.9 < whole < 0.99


def test_little_is_added_where_the_residual_is_noise():
    plain, whole, widening = share_held(0.0, 2.0)
    assert plain == pytest.approx(whole, abs=0.04)
    assert widening < 1.25


def test_candidates_that_change_nothing_or_that_are_none_add_nothing():
    rng = np.random.default_rng(1)
    jacobian, residual = rng.normal(size=(50, 2)), rng.normal(size=50)
    inverse = np.linalg.inv(jacobian.T @ jacobian)
    for none in (np.zeros((50, 0)), np.zeros((50, 3))):
        assert not mean_product(jacobian, residual, none, inverse, np.inf).any()


def test_a_candidate_that_the_parameters_absorb_whole_adds_nothing_by_itself():
    rng = np.random.default_rng(2)
    jacobian = rng.normal(size=(200, 2))
    inverse = np.linalg.inv(jacobian.T @ jacobian)
    residual = rng.normal(size=200)
    assert not mean_product(jacobian, residual, jacobian @ np.array([[1.0], [2.0]]), inverse, np.inf).any()


def test_a_law_that_the_parameters_reproduce_almost_whole_is_no_larger_than_what_models_of_real_machines_leave():
    rng = np.random.default_rng(3)
    jacobian = rng.normal(size=(400, 2))
    inverse = np.linalg.inv(jacobian.T @ jacobian)
    law = (jacobian @ np.array([1.0, 0.5]) + 0.003 * rng.normal(size=400))[:, None]
    residual = rng.normal(size=400)
    signal = 100.0 * np.sqrt(400.0)  # a hundred times the noise
    std = np.sqrt(np.diag(mean_product(jacobian, residual, law, inverse, signal)))
    share = np.abs(std[0] * np.linalg.norm(jacobian[:, 0]) / signal)
    assert share < 0.05
    assert np.diag(mean_product(jacobian, residual, law, inverse, np.inf))[0] > 4.0 * std[0] ** 2
