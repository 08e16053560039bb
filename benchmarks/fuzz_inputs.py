"""The samples that all valid inputs hold."""

import numpy as np

COUNT = 24  # messages and rows of the valid inputs: few, so that damage often strikes what matters
STAMPS = 5_000_000_000 + np.arange(COUNT, dtype=np.int64) * 1_000_000
VALUES = np.random.default_rng(7).standard_normal(COUNT).round(3)
