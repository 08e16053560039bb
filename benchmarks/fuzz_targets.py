"""The readers of untrusted files: for each reader valid inputs, their corruption, and the call that has to refuse or accept them.

A target's `use` returns if the input is accepted and raises InputError if it is refused; anything else is a failure.
"""

import random
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import fuzz_bags as bags
import fuzz_formats as formats
import fuzz_tables as tables
from fuzz_tables import TABLE
from mutation import Mutation, spoil_bytes, spoil_text

from rhythmid.elements.catalogue import Catalogue, load_catalogue
from rhythmid.experiment import Experiment
from rhythmid.identify.latency import Latency
from rhythmid.model import Model
from rhythmid.record.read import read_record
from rhythmid.record.signals import Signals


@dataclass(frozen=True)
class Target:
    """A reader under test.

    Attributes
    ----------
    name : as given on the command line.
    valid : makes the valid inputs.
    spoil : makes a hostile input from a valid one.
    use : reads it: input, an empty folder of its own, number of the input.
    """

    name: str
    valid: Callable[[], list[bytes]]
    spoil: Mutation
    use: Callable[[bytes, Path, int], None]

    def hostile(self, seed: int, number: int) -> bytes:
        """The input with this number; the same for the same seed."""
        rng = random.Random(f"{self.name}/{seed}/{number}")
        return self.spoil(rng, rng.choice(_valid(self)))


@cache
def _valid(target: Target) -> list[bytes]:
    return target.valid()


# YAML

MODEL = b"""
inertia: {mass: {value: 1.0, unit: kg, fixed: true}}
command: [{input_delay: {delay: {value: 0.01, unit: s}}}]
force:
  - linear_spring: {stiffness: {value: 200.0, unit: N/m, prior: {mean: 180.0, std: 20.0}}, rest_length: {value: 0.2, unit: m}}
  - viscous_damper: {damping: {value: 2.0, unit: N*s/m, bounds: [0.0, .inf]}}
"""
SIGNALS = b"""
time: {column: t_ms, scale: 0.001}
input: {file: run.csv, column: u, kind: force, hold: zero, scale: 2.0, offset: 0.1, unit: N}
output: {file: run.csv, column: y}
forcing: {amplitude: 12.0, frequency: 61.4, phase: 0.1}
use: [0.0, 5.0]
parameters: {position_control.proportional: 12.5}
"""
EXPERIMENT = b"""
model: model.yaml
excitation: {type: sequence, parts: [{type: chirp, amplitude: 0.02, band: [0, 7], sweep: 10.0, shift: {period: 1.0, count: 6}},
  {type: multisine, rms: 0.01, period: 5.0, band: [0.5, 4.0]}, {type: profile, points: [[0, 0], [1, 0.1]], length: 2.0}]}
forcing: {amplitude: 1.0, frequency: 1.0, phase: 0.0}
delays: {input: 0.04, measurement: {profile: delays.csv}}
noise: {measurement_std: 1.0e-5, correlation: 0.1, quantisation: 1.0e-6}
time: {mode: lockstep, rate: 1000, layout: processes, window: 50}
duration: 20
seed: 3
initial: {position: 0.2, velocity: 0.0}
safety: {max_effort: 0.1, ramp: 1.0, stale_after: 0.5, envelope: [0.0, 0.4]}
record: {path: demo_bag, storage: mcap, topics: [excitation, joint_states, forcing, run]}
namespace: /hopper
joint: leg
"""
LATENCY = b"delays: {input: {value: 0.04, std: 1.7e-05}, measurement: {value: null, std: null}, sum: {value: 0.1, std: 0.01}}\nmodel:\n"


def _use_model(data: bytes, folder: Path, number: int) -> None:
    (folder / "model.yaml").write_bytes(data)
    Model.from_text(Model.load(folder / "model.yaml", _catalogue()).to_yaml(), catalogue=_catalogue())


@cache
def _catalogue() -> Catalogue:
    return load_catalogue()


def _use_signals(data: bytes, folder: Path, number: int) -> None:
    (folder / "run.csv").write_bytes(TABLE)
    (folder / "signals.yaml").write_bytes(data)
    read_record(
        folder / "run.csv", Signals.load(folder / "signals.yaml")
    ) if b"run.csv" not in data else read_record(folder / "signals.yaml")


def _use_experiment(data: bytes, folder: Path, number: int) -> None:
    (folder / "model.yaml").write_bytes(MODEL)
    (folder / "delays.csv").write_bytes(b"time,delay\n0,0.01\n5,0.02\n")
    (folder / "experiment.yaml").write_bytes(data)
    Experiment.load(folder / "experiment.yaml").nodes()


def _use_latency(data: bytes, folder: Path, number: int) -> None:
    (folder / "latency.yaml").write_bytes(data)
    Latency.load(folder / "latency.yaml")


def _latencies() -> list[bytes]:
    return [LATENCY + b"".join(b"  " + line for line in MODEL.splitlines(keepends=True))]


TARGETS = {
    target.name: target
    for target in (
        Target("mcap", bags.mcaps, bags.spoil_mcap, bags.use_bag(".mcap")),
        Target("mcap.zstd", bags.mcaps, bags.spoil_packed_bag, bags.use_bag(".mcap.zstd")),
        Target("db3", bags.databases, bags.spoil_database, bags.use_bag(".db3")),
        Target("metadata", bags.metadata, spoil_text, bags.use_metadata),
        Target("recover", lambda: bags.mcaps() + bags.databases() * 2, bags.spoil_any_bag, bags.use_recover),
        Target("message", bags.messages, spoil_bytes, bags.use_message),
        Target("definition", bags.definitions, spoil_text, bags.use_definition),
        Target("model", lambda: [MODEL], spoil_text, _use_model),
        Target("signals", lambda: [SIGNALS, SIGNALS.replace(b"file: run.csv, ", b"")], spoil_text, _use_signals),
        Target("experiment", lambda: [EXPERIMENT], spoil_text, _use_experiment),
        Target("latency", _latencies, spoil_text, _use_latency),
        Target("csv", tables.texts, spoil_text, tables.use_table(".csv")),
        Target("csv.gz", tables.texts, tables.spoil_gzip, tables.use_table(".csv.gz")),
        Target("json", tables.jsons, spoil_text, tables.use_table(".json")),
        Target("npz", tables.npz_parts, tables.spoil_npz, tables.use_table(".npz")),
        Target("mat", tables.mats, spoil_bytes, tables.use_table(".mat")),
        Target("parquet", tables.parquets, spoil_bytes, tables.use_table(".parquet")),
        Target("dialect", formats.dialects, spoil_text, tables.use_table(".txt")),
        Target("folder", formats.folders, spoil_text, formats.use_folder),
        Target("xlsx", formats.workbooks, formats.spoil_workbook, tables.use_table(".xlsx")),
        Target("h5", formats.hdf5s, spoil_bytes, tables.use_table(".h5")),
        Target("npy", formats.npys, spoil_bytes, tables.use_table(".npy")),
        Target("object", formats.objects, spoil_bytes, tables.use_table(".mat")),
        Target("init", formats.long_tables, spoil_text, formats.use_init),
        Target("split", formats.several_runs, spoil_text, formats.use_split),
        Target("robot", formats.robots, spoil_text, formats.use_robot),
        Target("profile", formats.profiles, spoil_text, formats.use_profile),
    )
}  # fmt: skip
