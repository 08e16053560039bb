"""Harmonic transfer functions as a labelled xarray Dataset."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rhythmid.result import optional

if TYPE_CHECKING:
    import xarray as xr

DIMENSIONS = ("harmonic", "frequency")


def dataset(
    harmonics: Sequence[int],
    frequencies: Sequence[NDArray[np.float64]],
    columns: Mapping[str, tuple[Sequence[NDArray], str]],
) -> "xr.Dataset":
    """Functions of frequency, one for each harmonic, over the union of their frequencies.

    Parameters
    ----------
    harmonics : indices m, h of them.
    frequencies : float64[n] for each harmonic [Hz].
    columns : by name, an array (n,) for each harmonic, and the unit.

    Returns
    -------
    xarray.Dataset
        With the dimensions `harmonic` and `frequency`; NaN where a function has no value.

    Raises
    ------
    InputError
        Where xarray is not installed.
    """
    xr = optional("xarray", "to_xarray")
    grid = np.unique(np.concatenate([*frequencies, np.empty(0)]))
    variables = {}
    for name, (parts, unit) in columns.items():
        kind = np.result_type(*parts, np.float64) if len(parts) else np.float64
        values = np.full((len(harmonics), len(grid)), np.nan, dtype=kind)
        for row, (frequency, part) in enumerate(zip(frequencies, parts, strict=True)):
            values[row, np.searchsorted(grid, frequency)] = part
        variables[name] = (DIMENSIONS, values, {"units": unit})
    places = {"harmonic": list(harmonics), "frequency": ("frequency", grid, {"units": "Hz"})}
    return xr.Dataset(variables, places)
