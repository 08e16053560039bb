"""Small recordings of a mass on a spring, and manifests that ask for them."""

from pathlib import Path

import numpy as np

from rhythmid.batch.agreement import agreements
from rhythmid.batch.answered import Answered, Value
from rhythmid.batch.batch import Batch
from rhythmid.batch.manifest import Manifest
from rhythmid.batch.task import tasks_of
from rhythmid.excitation.sequence import build
from rhythmid.model import Model
from rhythmid.simulation.signal import zero_order_hold
from rhythmid.simulation.simulate import simulate

MODEL = """
inertia: {mass: {value: 1.0, unit: kg, fixed: true}}
force:
  - linear_spring: {stiffness: {value: 220.0, unit: N/m}, rest_length: {value: 0.0, unit: m, fixed: true}}
  - viscous_damper: {damping: {value: 2.5, unit: N*s/m}}
"""
SIGNALS = "time: {column: t}\ninput: {column: u, unit: N, hold: zero}\noutput: {column: y, unit: m}\n"
EXCITATION = {"type": "multisine", "rms": 3.0, "period": 5.0, "periods": 2, "band": [0.3, 6.0]}
RATE, SAMPLES, NOISE = 100.0, 1000, 1e-3  # [Hz], number, standard deviation [m]


def write_files(folder: Path) -> None:
    """Model and signals of the machine."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "model.yaml").write_text(MODEL)
    (folder / "signals.yaml").write_text(SIGNALS)


def write_run(path: Path, seed: int, stiffness: float = 220.0) -> None:
    """A table of ten seconds of the machine."""
    path.parent.mkdir(parents=True, exist_ok=True)
    time = np.arange(SAMPLES) / RATE
    command = build(EXCITATION)(time)
    machine = Model.from_text(MODEL).with_values({"linear_spring.stiffness": stiffness})
    motion = simulate(machine, time, zero_order_hold(time, command)).output
    motion = motion + np.random.default_rng(seed).normal(0.0, NOISE, len(time))
    table = np.column_stack([time, command, motion])
    np.savetxt(path, table, delimiter=",", header="t,u,y", comments="")


def write_swing(path: Path, rate: float = RATE) -> None:
    """A table of two seconds of a sine: enough for `check`."""
    path.parent.mkdir(parents=True, exist_ok=True)
    time = np.arange(0.0, 2.0, 1.0 / rate)
    table = np.column_stack([time, np.ones_like(time), np.cos(5.0 * time)])
    np.savetxt(path, table, delimiter=",", header="t,u,y", comments="")


def made_up(folder: Path, values, times=None, stds=None, groups=("rig A",)) -> Batch:
    """A batch of answers with these values of one parameter [N], of the groups by turns."""
    write_files(folder)
    for number in range(len(values)):
        (folder / f"{number:03d}.csv").touch()
    entries = [
        {
            "bags": [f"{folder}/{number:03d}.csv"],
            "group": groups[number % len(groups)],
            "signals": f"{folder}/signals.yaml",
        }
        for number in range(len(values))
    ]
    tasks = tasks_of(Manifest.of({"command": "identify", "entries": entries}))
    answers = []
    for number, task in enumerate(tasks):
        gain = Value("gain", values[number], 1.0 if stds is None else stds[number], "N")
        time = None if times is None else times[number]
        answers.append((task, Answered(verdict="identified", headline="found", time=time, values=(gain,))))
    return Batch(tuple(answers), agreements(answers), folder / "out")
