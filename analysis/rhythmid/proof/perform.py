"""A drawn case becomes what a robot leaves behind: bags with the contract's topics, and somebody's nominal model."""

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rhythmid.proof.draw import Case
from rhythmid.proof.protocol import Run
from rhythmid.record.bag_writer import write_bag
from rhythmid.record.messages import Messages

Array = NDArray[np.float64]
BLOCKS = range(1, 21)  # lengths of block averages for which the noise floor is noted
LEARN, JUDGE, NOMINAL = "learn", "judge", "nominal.yaml"  # what lies in a case's folder


def perform(case: Case, folder: Path, seed: Sequence[int]) -> dict[int, float]:
    """Write the case's bags and nominal model into `folder`.

    Returns the held-out records' noise floor by length of block averages: rms(noise) / std(measured).
    """
    rng = np.random.default_rng(seed)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / NOMINAL).write_text(case.nominal, encoding="utf-8")
    for run in case.runs:
        _record(case, run, folder / LEARN / run.name, rng)
    pairs = [_record(case, run, folder / JUDGE / run.name, rng) for run in case.unseen]
    return {block: _floor(pairs, block) for block in BLOCKS}


def _record(case: Case, run: Run, path: Path, rng: np.random.Generator) -> tuple[Array, Array]:
    """Write one bag; returns its measurement and the noise in it."""
    seen = case.observe(run)
    assert seen is not None  # the case was drawn so
    measured = case.noise.corrupt(seen.measured, rng)
    sent = case.start_ns + np.rint(run.time * 1e9).astype(np.int64)
    stamped = case.start_ns + np.rint(seen.stamps * 1e9).astype(np.int64)
    write_bag(
        path,
        {
            "excitation": Messages(sent, effort=run.command),
            "forcing": Messages(sent, effort=run.forcing * case.forcing(run.time)),
            "joint_states": Messages(stamped, position=measured),
        },
    )
    return measured, measured - seen.measured


def _average(samples: Array, block: int) -> Array:
    whole = len(samples) // block * block
    return samples[:whole].reshape(-1, block).mean(axis=1)


def _floor(pairs: Sequence[tuple[Array, Array]], block: int) -> float:
    noise = sum(float(np.sum(_average(n, block) ** 2)) for _, n in pairs)
    spread = sum(float(np.sum((_average(y, block) - _average(y, block).mean()) ** 2)) for y, _ in pairs)
    return math.sqrt(noise / spread)
