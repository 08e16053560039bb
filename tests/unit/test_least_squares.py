"""Rows that are replaced by their triangular factor leave the least-squares solution as it is."""

import numpy as np
import pytest

from rhythmid.identify.least_squares import reduced


def parts(count: int) -> list[tuple[np.ndarray, np.ndarray]]:
    rng = np.random.default_rng(0)
    designs = [rng.standard_normal((70, 5)) for _ in range(count)]
    for one in designs:
        one[:, 4] = one[:, 0] - one[:, 1]  # a column that the others tell
    return [(one, one @ np.arange(5.0) + rng.standard_normal(70)) for one in designs]


@pytest.mark.parametrize("most", [50, 100, 150, 1000])
def test_the_solution_the_rank_and_the_norms_are_those_of_all_rows(most):
    every = parts(6)
    design, target = np.concatenate([d for d, _ in every]), np.concatenate([t for _, t in every])
    small, aim = reduced(every, most)
    assert len(small) <= max(most, 6)
    wanted, _, rank, _ = np.linalg.lstsq(design, target, rcond=1e-6)
    found, _, same, _ = np.linalg.lstsq(small, aim, rcond=1e-6)
    assert rank == same == 4
    assert found == pytest.approx(wanted, rel=1e-9)
    assert np.linalg.norm(small, axis=0) == pytest.approx(np.linalg.norm(design, axis=0), rel=1e-12)


def test_few_rows_are_kept_as_they_are():
    every = parts(2)
    design, target = reduced(every)
    assert np.array_equal(design, np.concatenate([d for d, _ in every]))
    assert np.array_equal(target, np.concatenate([t for _, t in every]))
