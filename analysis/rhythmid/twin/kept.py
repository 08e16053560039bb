"""A calibration as a file, so that a restarted twin knows the healthy machine."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from rhythmid.elements.catalogue import Catalogue
from rhythmid.errors import InputError
from rhythmid.identify.noise import NoiseModel
from rhythmid.model import Model
from rhythmid.output import write_json
from rhythmid.twin.calibration import CONSTANT, Calibration
from rhythmid.twin.changes import watched, without_own_forcing
from rhythmid.twin.detector import Healthy, Threshold
from rhythmid.twin.observer import Filter
from rhythmid.twin.settings import Settings

VERSION = 2


def save(calibration: Calibration, path: Path) -> None:
    """Write a calibration. Raises InputError where it cannot be written."""
    filter, healthy = calibration.filter, calibration.healthy
    write_json(path, {
        "version": VERSION,
        "changes": [change.name for change in calibration.changes],
        "constant_force": calibration.constant_force,
        "period": calibration.period,
        "filter": vars(filter),
        "speed": filter.scatter[1],
        "sizes": calibration.sizes,
        "noise": {"coefficients": calibration.noise.coefficients, "std": calibration.noise.std},
        "healthy": {
            "offset": healthy.offset,
            "uncertainty": healthy.uncertainty,
            "thresholds": [vars(one) for one in healthy.thresholds],
            "probability": healthy.probability,
        },
        "nrmse": calibration.nrmse,
    })  # fmt: skip


def load(path: Path, model: Model, settings: Settings, forced: bool, catalogue: Catalogue) -> Calibration:
    """Read a calibration of this model. Raises InputError where the file is no calibration, or one of another model."""
    try:
        kept: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        if kept["version"] != VERSION:
            raise InputError(
                f"{path}: is of version {kept['version']}, and {VERSION} is expected; make it anew"
            )
        speed = float(kept["speed"])
        extended, changes = watched(
            without_own_forcing(model) if forced else model, catalogue, speed, settings.input_kind
        )
        if [change.name for change in changes] != kept["changes"]:
            raise InputError(f"{path}: is a calibration of another model; make it anew")
        if CONSTANT in extended.parameters:
            extended = extended.with_values({CONSTANT: float(kept["constant_force"])})
        noise, healthy = kept["noise"], kept["healthy"]
        return Calibration(
            extended,
            changes,
            float(kept["period"]),
            Filter(**{**kept["filter"], "scatter": np.array(kept["filter"]["scatter"])}),
            np.array(kept["sizes"]),
            NoiseModel(np.array(noise["coefficients"], dtype=float), float(noise["std"])),
            Healthy(
                np.array(healthy["offset"]),
                np.array(healthy["uncertainty"]),
                tuple(Threshold(**one) for one in healthy["thresholds"]),
                float(healthy["probability"]),
            ),
            float(kept["nrmse"]),
        )
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from None
    except (ValueError, KeyError, TypeError) as error:
        raise InputError(f"{path}: is no calibration of a twin ({type(error).__name__}: {error})") from None
