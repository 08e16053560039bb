"""Joint covariance of estimates, and their correlation."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rhythmid.result import axis_or_new, optional

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

Array = NDArray[np.float64]
DARK = 0.6  # correlation above which a cell of the plot is dark
MOST_WRITTEN = 12  # largest number of parameters for which the plot shows numbers
UNDETERMINED = 1e20  # variance from which a parameter counts as not identifiable


@dataclass(frozen=True, eq=False)
class JointCovariance:
    """Covariance of estimates.

    Attributes
    ----------
    names : names of the p parameters, delays included.
    units : unit of each.
    matrix : float64[p, p] covariance in the products of their units. A parameter that is not identifiable has
        infinity on the diagonal, and NaN in the rest of its row and column.

    Examples
    --------
    >>> import numpy as np
    >>> found = JointCovariance.of(("k", "c"), ("N/m", "N*s/m"), np.array([[4.0, 1.0], [1.0, 1.0]]))
    >>> found.correlation.tolist()
    [[1.0, 0.5], [0.5, 1.0]]
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    matrix: Array

    @classmethod
    def of(cls, names: Sequence[str], units: Sequence[str], matrix: Array) -> "JointCovariance":
        """The covariance with parameters that are not identifiable marked."""
        unknown = ~(np.abs(np.diag(matrix)) < UNDETERMINED)
        marked = np.where(unknown[:, None] | unknown[None, :], math.nan, matrix)
        marked[unknown, unknown] = math.inf
        return cls(tuple(names), tuple(units), marked)

    @property
    def std(self) -> Array:
        """Standard deviations, float64[p], each in its unit."""
        return np.sqrt(np.diag(self.matrix))

    @property
    def correlation(self) -> Array:
        """Correlation coefficients, float64[p, p] between -1 and 1; NaN where a parameter is not identifiable or is
        exact."""
        std = np.where((self.std > 0.0) & np.isfinite(self.std), self.std, math.nan)
        return np.clip(self.matrix / np.outer(std, std), -1.0, 1.0)

    def to_dict(self) -> dict[str, Any]:
        """Plain JSON data: names, units, covariance and correlation."""
        return {
            "names": list(self.names),
            "units": list(self.units),
            "covariance": self.matrix.tolist(),
            "correlation": self.correlation.tolist(),
        }

    def to_dataframe(self, correlation: bool = True) -> "pd.DataFrame":
        """Correlation, or covariance, as a pandas DataFrame with the parameters' names as rows and columns.

        Raises InputError where pandas is not installed.
        """
        values = self.correlation if correlation else self.matrix
        return optional("pandas", "to_dataframe").DataFrame(values, index=self.names, columns=self.names)

    def plot(self, axis: "Axes | None" = None) -> "Axes":
        """Plot the correlation as a coloured matrix, on a new figure where no axis is given."""
        axis = axis_or_new(axis)
        shown = axis.imshow(self.correlation, vmin=-1.0, vmax=1.0, cmap="RdBu_r")
        places = range(len(self.names))
        axis.set_xticks(places, self.names, rotation=45, ha="right", rotation_mode="anchor")
        axis.set_yticks(places, self.names)
        for row in places:
            for column in places:
                value = self.correlation[row, column]
                if row != column and math.isfinite(value) and len(places) <= MOST_WRITTEN:
                    text = f"{value:.2f}".replace("-", "−").replace("−0.00", "0.00")
                    colour = "white" if abs(value) > DARK else "black"
                    axis.annotate(
                        text, (column, row), ha="center", va="center", fontsize="small", color=colour
                    )
        axis.figure.colorbar(shown, ax=axis, label="correlation")
        return axis
