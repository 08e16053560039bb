"""A design as a folder that can be run: the command's samples, model and experiment, the prediction, a figure.

`rhythmid run FOLDER/experiment.yaml` runs it over the ROS graph, `rhythmid simulate` without ROS. On a robot the excitation node
plays the samples.
"""

import os
import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from rhythmid.design.designer import Design
from rhythmid.design.figure import design_figure
from rhythmid.design.waveform import Waveform
from rhythmid.errors import InputError
from rhythmid.output import write_json
from rhythmid.report.figures import save_figure

COMMAND, MODEL, EXPERIMENT, PREDICTION, FIGURE = (
    "excitation.csv", "model.yaml", "experiment.yaml", "design.json", "design.png"
)  # fmt: skip


def command_table(command: Waveform, unit: str) -> str:
    """The command in the format of an excitation of type `samples`: a line for each sample with seconds and effort."""
    period_ns = round(command.period * 1e9)
    stamps = np.arange(len(command.values), dtype=np.int64) * period_ns
    rows = [
        f"{ns // 1_000_000_000}.{ns % 1_000_000_000:09d},{u!r}"
        for ns, u in zip(stamps.tolist(), command.values.tolist())
    ]
    return f"time [s],effort [{unit}]\n" + "\n".join(rows) + "\n"


def experiment_document(design: Design, elements: Sequence[Path] = ()) -> dict[str, Any]:
    """The experiment file's content: the predicted run within the given limits."""
    wanted, run = design.requirements, design.experiment
    document: dict[str, Any] = {
        "model": MODEL,
        "excitation": {"type": "samples", "file": COMMAND},
        "forcing": {
            "amplitude": run.forcing.amplitude,
            "frequency": run.forcing.frequency,
            "phase": run.forcing.phase,
        },
        "delays": {"input": wanted.input_delay, "measurement": wanted.measurement_delay},
        "noise": {"measurement_std": wanted.noise_std},
        "time": {"mode": "lockstep", "rate": wanted.rate},
        "duration": float(run.count * run.time.period_ns * 1e-9),
        "safety": {"max_effort": wanted.max_effort, "envelope": list(wanted.envelope)},
        "record": {"path": "design_bag"},
    }
    if elements:
        document["elements"] = [str(folder.resolve()) for folder in elements]
    return document


def save_design(design: Design, model: Path | str, folder: Path, elements: Sequence[Path] = ()) -> None:
    """Write the design into a new folder, completely or not at all; `model` is the file it was made from, or its text.

    Missing parent folders are created. Raises InputError when the folder cannot be written.
    """
    partial = folder.with_name(f".{folder.name}.partial")
    shutil.rmtree(partial, ignore_errors=True)
    try:
        partial.mkdir(parents=True)
        if isinstance(model, Path):
            shutil.copyfile(model, partial / MODEL)
        else:
            (partial / MODEL).write_text(model, encoding="utf-8")
        (partial / COMMAND).write_text(
            command_table(design.command, design.experiment.model.units.force), encoding="utf-8"
        )
        text = yaml.safe_dump(experiment_document(design, elements), sort_keys=False, default_flow_style=None)
        (partial / EXPERIMENT).write_text(
            "# The run that design.json predicts: rhythmid run experiment.yaml\n"
            "# Delays and noise are those of the simulated machine.\n" + text,
            encoding="utf-8",
        )
        write_json(partial / PREDICTION, design.to_dict())
        save_figure(design_figure(design), partial / FIGURE)
        os.rename(partial, folder)
    except OSError as error:
        raise InputError(f"{folder}: the design cannot be written: {error.strerror}") from None
    finally:
        shutil.rmtree(partial, ignore_errors=True)
