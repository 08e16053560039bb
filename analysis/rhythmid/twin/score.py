"""Scores: the information in innovations on each change of physics, as sums that add up over time.

The innovations are ε = S θ + e, with sensitivities S, sizes θ of the changes, and white e. Their score b = Sᵀε and information
A = SᵀS are sufficient for θ: M. Basseville, I. V. Nikiforov, Detection of Abrupt Changes, 1993, section 8.2 (local approach).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhythmid.identify.noise import NoiseModel
from rhythmid.twin.observer import Innovations

Array = NDArray[np.float64]
RANK = 1e-7  # ratio to the largest eigenvalue of the scaled information below which a combination of changes is not identifiable


@dataclass(frozen=True)
class Score:
    """Score b (p,) and information A (p, p) of innovations, their sum of squares and their number."""

    score: Array
    information: Array
    squares: float
    count: int

    @classmethod
    def zero(cls, changes: int) -> "Score":
        """The score of no innovations."""
        return cls(np.zeros(changes), np.zeros((changes, changes)), 0.0, 0)

    def __add__(self, other: "Score") -> "Score":
        return Score(
            self.score + other.score,
            self.information + other.information,
            self.squares + other.squares,
            self.count + other.count,
        )


class Whitener:
    """Whitens the remaining colour of a healthy machine's innovations, and filters their sensitivities in the same way."""

    def __init__(self, noise: NoiseModel, changes: int) -> None:
        self.noise = noise
        self.before = np.empty((0, 1 + changes))

    def __call__(self, found: Innovations) -> Score:
        """Score of a segment."""
        order = self.noise.order
        rows = np.vstack([self.before, np.column_stack([found.white, found.by_change])])
        self.before = rows[max(0, len(rows) - order) :]
        if len(rows) <= order:
            return Score.zero(rows.shape[1] - 1)
        white = rows[order:].copy()
        for lag, coefficient in enumerate(self.noise.coefficients, start=1):
            white -= coefficient * rows[order - lag : len(rows) - lag]
        white /= self.noise.std
        innovation, by_change = white[:, 0], white[:, 1:]
        return Score(
            by_change.T @ innovation, by_change.T @ by_change, float(innovation @ innovation), len(innovation)
        )


def inverse(matrix: Array) -> tuple[Array, int]:
    """Pseudo-inverse (p, p) of a positive matrix whose rows may have any units, and its rank."""
    scale = np.sqrt(np.maximum(np.diag(matrix), 0.0))
    live = scale > 0.0
    reciprocal = np.where(live, 1.0 / np.where(live, scale, 1.0), 0.0)
    values, vectors = np.linalg.eigh(matrix * np.outer(reciprocal, reciprocal))
    kept = values > RANK * max(float(values[-1]), 1e-300)
    if not live.any():
        return np.zeros_like(matrix), 0
    root = vectors[:, kept] / np.sqrt(values[kept])
    return (root @ root.T) * np.outer(reciprocal, reciprocal), int(kept.sum())
