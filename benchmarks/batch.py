"""Cost and memory of a batch, and its false alarms if there is only noise.

python benchmarks/batch.py [RUNS [JOBS [FOLDER]]]

RUNS recordings of ten seconds of one machine, alternately from two rigs, are identified in four stages into one folder. Each stage adds a
quarter of them, so that only new recordings are analysed. Printed are the processor time of an answer, the largest memory of this process
and of a worker after each stage; then the p-value of every test, and the share of sets of eight runs in which a test is below 0.05. An
interrupted benchmark continues in its FOLDER.
"""

from __future__ import annotations

import resource
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))
from batches import write_files, write_run

from rhythmid.batch.agreement import LEVEL
from rhythmid.batch.batch import Batch, batch
from rhythmid.batch.present import present
from rhythmid.batch.scatter import groups_agree, homogeneous, trend
from rhythmid.parallel import cores
from rhythmid.report.page import render

STAGES = 4
SET = 8  # runs of a set that is tested separately
MEGABYTE = 1e6


def processor_time() -> float:
    """Of this process and its ended workers [s]."""
    spent = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(one.ru_utime + one.ru_stime for one in spent)


def kept(folder: Path) -> int:
    """Existing answers."""
    return len(list((folder / "out").glob("answers/*.json")))


def stage(folder: Path, runs: int, jobs: int) -> Batch:
    """Identify the first `runs` recordings."""
    for run in range(runs):
        path = folder / f"rig{run % 2}" / f"{run:04d}.csv"
        if not path.exists():
            write_run(path, seed=run)
    entries = [
        {"bags": [f"{folder}/rig{rig}/{run:04d}.csv" for run in range(rig, runs, 2)], "group": f"rig {rig}"}
        for rig in (0, 1)
    ]
    files = {"model": f"{folder}/model.yaml", "signals": f"{folder}/signals.yaml"}
    return batch({"command": "identify", **files, "entries": entries}, folder / "out", jobs)


def false_alarms(found: Batch) -> dict[str, tuple[int, int]]:
    """Of sets of `SET` runs and every parameter: how many tests are below `LEVEL`, and how many were made."""
    counts = {"run to run": [0, 0], "rig to rig": [0, 0], "trend": [0, 0]}
    for one in found.agreements:
        runs = sorted(one.runs, key=lambda run: run.task.sources)
        rigs = [[run for run in runs if run.task.group == group] for group in one.groups]
        mixed = [run for pair in zip(*rigs) for run in pair]
        for begin in range(0, len(mixed) - SET + 1, SET):
            own = mixed[begin : begin + SET]
            values, stds = np.array([run.value for run in own]), np.array([run.std for run in own])
            groups = [run.task.group for run in own]
            repeated, slope = (
                homogeneous(values, stds, groups),
                trend(values, stds, groups, np.arange(SET, dtype=float)),
            )
            made = (repeated and repeated[1], groups_agree(values, stds, groups), slope and slope.p_value)
            for name, p in zip(counts, made):
                counts[name][0] += p is not None and p < LEVEL
                counts[name][1] += p is not None
    return {name: (below, made) for name, (below, made) in counts.items()}


def main() -> None:
    given = dict(enumerate(sys.argv[1:]))
    runs, jobs = int(given.get(0, 200)), int(given.get(1, cores()))
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(given.get(2, temporary)).resolve()
        write_files(folder)
        found = None
        for part in range(1, STAGES + 1):
            count = runs * part // STAGES
            before = kept(folder)
            cpu, wall = processor_time(), time.monotonic()
            found = stage(folder, count, jobs)
            cpu, wall = processor_time() - cpu, time.monotonic() - wall
            own = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / MEGABYTE
            worker = max(one.memory for _, one in found.answers) / MEGABYTE
            new = kept(folder) - before
            print(
                f"{count:4d} answers: {new} new ones in {wall:.0f} s, {cpu / max(new, 1):.2f} s of processor time each; "
                f"largest memory {own:.0f} MB here, {worker:.0f} MB in a worker",
                flush=True,
            )
        assert found is not None
        begun = time.monotonic()
        page = render(present(found, lambda task: task.file))
        print(f"index page: {len(page) / 1e3:.0f} kB in {time.monotonic() - begun:.1f} s")
        print(found.summary(width=120))
        for name, (below, made) in false_alarms(found).items():
            print(f"{name}: {below} of {made} tests of {SET} runs below {LEVEL:g}")


if __name__ == "__main__":
    main()
