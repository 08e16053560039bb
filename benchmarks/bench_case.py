"""One case of the bench of recordings: the records, the nominal model, and the accepted answer."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
COULOMB_FAMILY = frozenset(
    {"coulomb_friction", "asymmetric_coulomb_friction", "stribeck_friction", "lugre_friction"}
)
LAGS = frozenset({"command_lag", "actuator_lag", "sensor_lag", "input_delay", "measurement_delay"})


@dataclass(frozen=True)
class Case:
    """Records to diagnose.

    Attributes
    ----------
    name : short, unique, its set first: `pendulum clean`.
    nominal : the nominal model in a few words.
    train, holdout : signals.yaml files; without `holdout` the diagnosis holds out the last fifth of every record.
    model : the nominal model's file.
    first : elements of which any is right as the dominant effect; empty if nothing is missing, None if there is no accepted answer.
    truth : parameters that are known, `element.parameter` -> value in the model's units, which the bench compares.
    """

    name: str
    nominal: str
    train: tuple[Path, ...]
    holdout: tuple[Path, ...]
    model: Path
    first: frozenset[str] | None
    truth: Mapping[str, float]


def write_table(path: Path, columns: Mapping[str, Array]) -> Path:
    """Columns of equal length [n] as a .csv file that names them."""
    table = np.stack(list(columns.values()), axis=1)
    np.savetxt(path, table, delimiter=",", header=",".join(columns), comments="", fmt="%.9g")
    return path


def write_signals(
    folder: Path, name: str, file: Path, channels: Sequence[str], use: tuple[float, float] | None = None
) -> Path:
    """`folder/name.yaml`, a record of the table `file`: `channels` are lines of a signals.yaml, `use` cuts it [s]."""
    lines = [f"tables: {{file: '{file}'}}", *channels]
    if use is not None:
        lines.append(f"use: [{use[0]}, {use[1]}]")
    path = folder / f"{name}.yaml"
    path.write_text("\n".join(lines) + "\n")
    return path


def write_model(folder: Path, name: str, text: str) -> Path:
    """`folder/name-model.yaml` with `text`."""
    path = folder / f"{name}-model.yaml"
    path.write_text(text.strip() + "\n")
    return path
