"""Write a drawn case as data of a robot and its user.

The records are bags with the contract's topics, or tables with a description of their columns; the nominal model is a file.
"""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray

from rhythmid.proof.draw import Case
from rhythmid.proof.machine import Observation
from rhythmid.proof.machines.designs import DESIGNS
from rhythmid.proof.noise import coloured
from rhythmid.proof.protocol import Run
from rhythmid.record.bag_writer import write_bag
from rhythmid.record.messages import Messages

Array = NDArray[np.float64]
BLOCKS = range(1, 21)  # lengths of block averages for which the noise floor is stored
LEARN, JUDGE, NOMINAL = "learn", "judge", "nominal.yaml"  # content of a case's folder
TEXT_UP_TO = 500  # [Hz] highest rate of a table that is written as text
EFFORT_COLOUR = 0.8  # correlation between neighbouring samples of the effort noise in an untidy log


def perform(case: Case, folder: Path, seed: Sequence[int]) -> dict[int, float]:
    """Write the case's records and nominal model into `folder`.

    Returns the held-out records' noise floor by length of block averages: rms(noise) / std(measured).
    """
    rng = np.random.default_rng(seed)
    for part in (LEARN, JUDGE):
        (folder / part).mkdir(parents=True, exist_ok=True)
    (folder / NOMINAL).write_text(case.nominal, encoding="utf-8")
    write = _bag if DESIGNS[case.design].bags else _table
    for run in case.rig.runs:
        write(case, run, folder / LEARN / run.name, rng)
    pairs = [write(case, run, folder / JUDGE / run.name, rng) for run in case.rig.unseen]
    return {block: _floor(pairs, block) for block in BLOCKS}


def _seen(case: Case, run: Run, rng: np.random.Generator) -> tuple[Observation, Array]:
    """The noise-free record, and the logged measurement."""
    seen = case.observe(run)
    assert seen is not None  # cases that diverge were not drawn
    return seen, case.log.written(case.noise.corrupt(seen.measured, rng), rng)


def _bag(case: Case, run: Run, path: Path, rng: np.random.Generator) -> tuple[Array, Array]:
    """Write one bag; returns its measurement and the noise in it."""
    seen, measured = _seen(case, run, rng)
    stamps = case.log.stamped(seen.stamps, 1.0 / run.rate, rng)
    sent = case.start_ns + np.rint(run.time * 1e9).astype(np.int64)
    stamped = case.start_ns + np.rint(stamps * 1e9).astype(np.int64)
    write_bag(
        path,
        {
            "excitation": Messages(sent, effort=run.command),
            "forcing": Messages(sent, effort=run.forcing * case.rig.forcing(run.time)),
            "joint_states": Messages(stamped, position=measured),
        },
    )
    return measured, measured - seen.measured


def _table(case: Case, run: Run, path: Path, rng: np.random.Generator) -> tuple[Array, Array]:
    """Write one table and the signals file with its columns; returns its measurement and the noise in it."""
    seen, measured = _seen(case, run, rng)
    rig = case.rig
    force, position = rig.units
    columns = {"t": case.log.stamped(run.time, 1.0 / run.rate, rng)}
    signals: dict[str, Any] = {"time": {"column": "t"}}
    if rig.recorded == "effort":
        columns["effort"] = seen.effort + _effort_noise(case, seen.effort, rng)
        signals["input"] = {"column": "effort", "unit": force, "hold": "zero"}
    elif rig.recorded == "command":
        columns["drive"] = run.command
        signals["input"] = {"column": "drive", "unit": force, "hold": "zero"}
    elif rig.recorded == "base":
        columns["base"] = run.command
        signals["input"] = {"column": "base", "kind": "base_displacement", "hold": "band_limited"}
    elif rig.recorded == "reference":
        columns["command"] = run.command
        signals["input"] = {"column": "command", "unit": position, "kind": "reference", "hold": "zero"}
    else:
        signals["input"] = "none"
    columns["motion"] = measured
    kind, unit = ("velocity", f"{position}/s") if rig.velocity else ("position", position)
    signals["output"] = {"column": "motion", "unit": unit, "kind": kind}
    file = path.with_suffix(".csv" if run.rate <= TEXT_UP_TO else ".npz")
    signals["tables"] = {"file": file.name}
    if file.suffix == ".csv":
        header = ",".join(columns)
        np.savetxt(file, np.column_stack(list(columns.values())), "%.10g", ",", header=header, comments="")
    else:
        np.savez(file, **columns)  # pyright: ignore[reportArgumentType]
    path.with_suffix(".yaml").write_text(yaml.safe_dump(signals, sort_keys=False), encoding="utf-8")
    return measured, measured - seen.measured


def _effort_noise(case: Case, effort: Array, rng: np.random.Generator) -> Array:
    size = case.rig.effort_noise * float(np.sqrt(np.mean(effort**2)))
    white = rng.standard_normal(len(effort))
    return size * (coloured(white, EFFORT_COLOUR) if case.cluttered else white)


def _average(samples: Array, block: int) -> Array:
    whole = len(samples) // block * block
    return samples[:whole].reshape(-1, block).mean(axis=1)


def _floor(pairs: Sequence[tuple[Array, Array]], block: int) -> float:
    noise = sum(float(np.sum(_average(n, block) ** 2)) for _, n in pairs)
    spread = sum(float(np.sum((_average(y, block) - _average(y, block).mean()) ** 2)) for y, _ in pairs)
    return math.sqrt(noise / spread)
