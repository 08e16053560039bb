"""Correlations of the estimates of a machine with several joints."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rhythmid.body.body import BODY
from rhythmid.identify.inverse_dynamics.estimate import EffortFit
from rhythmid.model import INERTIA

Array = NDArray[np.float64]
INSEPARABLE_CORRELATION = 0.9  # correlation above which only a combination of two estimates is identifiable


@dataclass(frozen=True, eq=False)
class Correlations:
    """The `matrix` (n, n) of the correlations of the estimates `names`.

    Two pairs are taken as independent: estimates by inverse dynamics at different joints, and an estimate refined
    by free runs with one that was not.
    """

    names: tuple[str, ...]
    matrix: Array

    @classmethod
    def of_fit(cls, joint: str, fit: EffortFit) -> "Correlations":
        """Correlations of a joint's fit, including the alignment of effort and motion."""
        weight = fit.jacobian / fit.scale
        normal = weight.T @ weight + np.diag(fit.precision)
        scaling = 1.0 / np.sqrt(np.diag(normal))
        names = (f"{joint}.alignment", *(label_of(joint, name) for name in fit.names))
        covariance = np.asarray(np.linalg.pinv(normal * np.outer(scaling, scaling)), dtype=np.float64)
        return cls.of_covariance(names, covariance)

    @classmethod
    def of_covariance(cls, names: Sequence[str], covariance: Array) -> "Correlations":
        """Correlations of a covariance, in any units."""
        spread = np.sqrt(np.diag(covariance))
        return cls(tuple(names), covariance / np.outer(spread, spread))

    @classmethod
    def joined(cls, parts: Sequence["Correlations"]) -> "Correlations":
        """Correlations of several fits; for a pair of names in several parts the last one holds."""
        names = tuple(dict.fromkeys(name for part in parts for name in part.names))
        matrix = np.eye(len(names))
        for part in parts:
            at = [names.index(name) for name in part.names]
            others = [k for k in range(len(names)) if k not in at]
            matrix[np.ix_(at, others)] = matrix[np.ix_(others, at)] = 0.0
            matrix[np.ix_(at, at)] = part.matrix
        return cls(names, matrix)

    def close(self) -> Iterator[tuple[str, str, float]]:
        """Pairs of names of which only a combination is identifiable, with their correlation."""
        for i, first in enumerate(self.names):
            for j in range(i):
                if abs(self.matrix[i, j]) > INSEPARABLE_CORRELATION:
                    yield first, self.names[j], float(self.matrix[i, j])

    def to_dict(self) -> dict[str, Any]:
        """Names and rows as plain data."""
        return {"names": list(self.names), "matrix": self.matrix.tolist()}


def label_of(joint: str, name: str) -> str:
    """The machine's name of a parameter of a joint's balance."""
    if name == INERTIA:
        return f"{BODY}.{joint}.armature"
    return name if name.startswith(f"{BODY}.") else f"{joint}.{name}"
