"""Least squares over many rows in little memory: rows beyond a limit are replaced by their triangular factor.

An orthogonal transformation keeps the solution, the rank and the norms of columns (G. H. Golub, Numer. Math. 7
(1965) 206; in parts: J. Demmel et al., SIAM J. Sci. Comput. 34 (2012) A206).
"""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
KEPT_ROWS = 30_000  # rows that are kept unchanged: 24 MB with a hundred columns


def reduced(parts: Iterable[tuple[Array, Array]], most: int = KEPT_ROWS) -> tuple[Array, Array]:
    """One design matrix (m, p) and target (m,) with the same least-squares solution as all parts (n, p) and (n,)
    together. With at most `most` rows in all, the parts are stacked unchanged."""
    kept: list[Array] = []
    for design, target in parts:
        kept.append(np.column_stack([design, target]))
        if sum(map(len, kept)) > most:
            kept = [np.asarray(np.linalg.qr(np.concatenate(kept), mode="r"))]
    joined = np.concatenate(kept)
    return np.ascontiguousarray(joined[:, :-1]), joined[:, -1].copy()


def column_norms(columns: Array) -> Array:
    """Norms (p,) of columns (n, p), to scale them by; 1 for a zero column, which stays zero."""
    norms = np.asarray(np.linalg.norm(columns, axis=0), dtype=np.float64)
    norms[norms == 0.0] = 1.0
    return norms


def orthonormal(columns: Array) -> Array:
    """Orthonormal basis (n, r) of the span of these columns (n, p); linearly dependent and zero columns add nothing."""
    norms = np.linalg.norm(columns, axis=0)
    if not np.any(norms > 0.0):
        return np.zeros((len(columns), 0))
    left, singular, _ = np.linalg.svd(columns[:, norms > 0.0] / norms[norms > 0.0], full_matrices=False)
    return left[:, singular > 1e-9 * singular[0]]
