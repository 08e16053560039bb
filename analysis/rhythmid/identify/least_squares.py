"""Least squares over many rows in little memory: rows that do not fit are replaced by their triangular factor.

An orthogonal transformation leaves the solution, the rank and the norms of columns as they are (G. H. Golub, Numer. Math. 7 (1965)
206; in parts: J. Demmel et al., SIAM J. Sci. Comput. 34 (2012) A206).
"""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
KEPT_ROWS = 30_000  # that are kept as they are: with a hundred columns 24 MB


def reduced(parts: Iterable[tuple[Array, Array]], most: int = KEPT_ROWS) -> tuple[Array, Array]:
    """One design (m, p) and target (m,) with the least-squares solution of all parts, (n, p) and (n,) each; with `most` rows or
    fewer in all, the parts one below the other."""
    kept: list[Array] = []
    for design, target in parts:
        kept.append(np.column_stack([design, target]))
        if sum(map(len, kept)) > most:
            kept = [np.asarray(np.linalg.qr(np.concatenate(kept), mode="r"))]
    joined = np.concatenate(kept)
    return np.ascontiguousarray(joined[:, :-1]), joined[:, -1].copy()


def orthonormal(columns: Array) -> Array:
    """Orthonormal basis (n, r) of what these columns (n, p) span; those that depend on others, or are nothing, add nothing."""
    norms = np.linalg.norm(columns, axis=0)
    if not np.any(norms > 0.0):
        return np.zeros((len(columns), 0))
    left, singular, _ = np.linalg.svd(columns[:, norms > 0.0] / norms[norms > 0.0], full_matrices=False)
    return left[:, singular > 1e-9 * singular[0]]
