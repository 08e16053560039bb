"""The samples in all valid inputs."""

import numpy as np

COUNT = 24  # messages and rows of the valid inputs: few, so that damage often affects important bytes
STAMPS = 5_000_000_000 + np.arange(COUNT, dtype=np.int64) * 1_000_000
VALUES = np.random.default_rng(7).standard_normal(COUNT).round(3)
