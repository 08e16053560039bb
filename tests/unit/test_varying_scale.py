"""Blocks of errors whose scale varies: their density is that of one scale where it does not, and forgives where it does."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.stats import norm
from scipy.stats import t as student

from rhythmid.diagnose.varying_scale import block_densities
from rhythmid.identify.student import DEGREES

BLOCKS, ROWS = 60, 40


def errors(spread, seed=0, rows=ROWS):
    """Blocks of Student errors whose log scales have this standard deviation."""
    rng = np.random.default_rng(seed)
    scales = np.exp(spread * rng.standard_normal(BLOCKS))
    return [scale * rng.standard_t(DEGREES, rows) for scale in scales]


def scored(made, scale=1.0, time=1.0, seen=None):
    return block_densities(
        made, np.full(len(made), scale), time, np.ones(len(made), bool) if seen is None else seen
    )


def test_errors_of_one_scale_have_the_density_of_students_t():
    made = [np.random.default_rng(1).standard_t(DEGREES, ROWS) for _ in range(3)]
    plain = [student.logpdf(one, DEGREES).sum() for one in made]
    np.testing.assert_allclose(scored(made, seen=np.array([True, False, False])), plain, rtol=1e-9)


@pytest.mark.parametrize("spread", [0.3, 1.0])
def test_the_density_is_the_integral_over_the_blocks_scales(spread):
    made = errors(spread)
    found = scored(made)

    def exact(one):
        top = max(
            student.logpdf(one, DEGREES, scale=np.exp(x)).sum() + norm.logpdf(x, 0.0, spread)
            for x in np.linspace(-4, 4, 400)
        )

        def density(x):
            return np.exp(
                student.logpdf(one, DEGREES, scale=np.exp(x)).sum() + norm.logpdf(x, 0.0, spread) - top
            )

        return top + np.log(quad(density, -4.0, 4.0, limit=200, points=np.linspace(-3.5, 3.5, 15))[0])

    assert found[:10] == pytest.approx([exact(one) for one in made[:10]], abs=0.5)


@settings(max_examples=20, deadline=None)
@given(st.floats(0.2, 1.5), st.integers(0, 100))
def test_a_large_block_among_blocks_of_all_sizes_costs_less_than_among_equal_ones(spread, seed):
    large = 8.0 * np.random.default_rng(seed).standard_t(DEGREES, ROWS)
    varied, equal = (scored([large, *errors(s, seed)])[0] for s in (spread, 0.0))
    assert varied > equal


@given(st.floats(1e-3, 1e3), st.integers(0, 100))
def test_the_unit_of_the_errors_only_shifts_every_density_alike(unit, seed):
    made = errors(0.5, seed)
    here, there = scored(made), scored([unit * one for one in made], scale=unit)
    np.testing.assert_allclose(here - there, ROWS * np.log(unit), atol=1e-6)


def test_blocks_that_no_fit_has_seen_teach_nothing_of_how_scales_vary():
    made = [*errors(0.0), 30.0 * np.ones(ROWS)]
    seen = np.arange(len(made)) < BLOCKS
    np.testing.assert_allclose(scored(made, seen=seen)[:BLOCKS], scored(made[:BLOCKS]), rtol=1e-12)
    assert scored(made, seen=np.ones(len(made), bool))[-1] > scored(made, seen=seen)[-1]
