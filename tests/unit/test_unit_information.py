"""Cross-validation of what one block alone determines: the other blocks' noise does not carry it away."""

import numpy as np

from rhythmid.diagnose.evidence import Blocks, Linearised, cross_validate

ROWS = 600


def fitted(measured: np.ndarray, design: np.ndarray) -> Linearised:
    """A regression as a fit, at its least-squares solution."""
    solution = np.linalg.lstsq(design, measured, rcond=None)[0]
    nothing = np.zeros(design.shape[1])
    return Linearised(design @ solution - measured, design, nothing, nothing)


def test_what_one_block_alone_determines_is_not_carried_away_by_the_noise_of_the_others():
    rng = np.random.default_rng(4)
    wide = rng.standard_normal(ROWS)
    measured = wide + rng.standard_normal(ROWS)
    blocks = Blocks.of(np.zeros(ROWS, dtype=np.int64))
    first = blocks.block == 0
    # felt in the first block, and by a ten-thousandth in every other one: there noise would drive it a thousandfold
    brief = np.where(first, 1.0, 1e-4 * rng.standard_normal(ROWS))
    found = cross_validate(fitted(measured, np.column_stack([wide, brief])), blocks)
    plain = cross_validate(fitted(measured, wide[:, None]), blocks)
    assert np.abs(found.error[first]).max() < 2.0 * np.abs(plain.error[first]).max()
