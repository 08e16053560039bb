"""Untidy logs: is the verdict the same as for the clean record?

    python benchmarks/untidy_logs.py [--seed N] [--cases N] [--kind NAME …] [--machine NAME …] [--effect NAME …] [--budget S]

A pendulum (200 Hz), a mass on a spring and a lightly damped joint with hardly any noise (500 Hz) are simulated, each with Coulomb friction that the nominal model lacks and with nothing
concealed, and written as a table of time, command and position. Each kind of fault changes a copy of the table at random places. The
table is then read and diagnosed as by a user, with signals.yaml and model.yaml. Printed for each case: the verdict and the names,
the friction's level where it is stated with its standard deviation, the error on held-out data and the seconds; at the end, for each
kind, how many verdicts and names are those of the clean record.
"""

import argparse
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from bench_case import Array, write_table
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from rhythmid.diagnose.diagnosis import diagnose
from rhythmid.elements.catalogue import load_catalogue
from rhythmid.errors import InputError
from rhythmid.excitation.sequence import build
from rhythmid.model import Model
from rhythmid.record.read import read_record
from rhythmid.simulation.signal import zero_order_hold
from rhythmid.simulation.simulate import simulate

ARRIVAL = (2e-4, 6e-4)  # s by which commands are late under `command_jitter`
STAMPED = 0.3  # standard deviation of the errors of the stamps under `stamp_jitter`, in sample periods
IRREGULAR = 0.15  # standard deviation of the times under `jittered`, in sample periods
HELD = 0.01  # s between writes, on average, under `held_back`
WRITING = 2e-5  # s that it takes to write a row
SETTLED = 2.0  # s of the run before the table begins
Table = dict[str, Array]  # the columns t [s], u, y of equal length
Fault = Callable[[np.random.Generator, Table], Table]


@dataclass(frozen=True)
class Machine:
    """A machine to simulate: `nominal` is the model's text, `start` the values that the simulated machine really has."""

    nominal: str
    truth: dict[str, float]
    excitation: dict
    friction: float
    rate: float
    length: float
    noise: float
    units: tuple[str, str]
    hold: str  # line of signals.yaml, or nothing if a new user would not write it


MACHINES = {
    "pendulum": Machine(
        """
inertia: {mass: {value: 0.05, unit: kg*m^2, fixed: true}}
force:
  - pendulum_gravity: {moment: {value: 1.1, unit: N*m}}
  - viscous_damper: {damping: {value: 0.06, unit: N*m*s/rad}}
""",
        {"pendulum_gravity.moment": 1.0, "viscous_damper.damping": 0.05},
        {"type": "multisine", "rms": 0.6, "period": 20.0, "periods": 2, "band": [0.1, 2.0]},
        0.09, 200.0, 32.0, 2e-4, ("N*m", "rad"), "",
    ),
    "joint": Machine(
        """
inertia: {mass: {value: 0.02, unit: kg*m^2, fixed: true}}
force:
  - linear_spring: {stiffness: {value: 4.5, unit: N*m/rad}, rest_length: {value: 0.0, unit: rad}}
  - viscous_damper: {damping: {value: 0.015, unit: N*m*s/rad}}
""",
        {"linear_spring.stiffness": 4.0, "viscous_damper.damping": 0.012},
        {"type": "multisine", "rms": 0.3, "period": 12.0, "periods": 2, "band": [0.2, 8.0]},
        0.04, 500.0, 20.0, 1e-6, ("N*m", "rad"), ", hold: zero",
    ),
    "mass": Machine(
        """
inertia: {mass: {value: 1.0, unit: kg, fixed: true}}
force:
  - linear_spring: {stiffness: {value: 220.0, unit: N/m}, rest_length: {value: 0.0, unit: m}}
  - viscous_damper: {damping: {value: 2.5, unit: N*s/m}}
""",
        {"linear_spring.stiffness": 200.0, "viscous_damper.damping": 2.0},
        {"type": "multisine", "rms": 3.0, "period": 12.0, "periods": 2, "band": [0.3, 6.0]},
        0.3, 500.0, 20.0, 2e-5, ("N", "m"), ", hold: zero",
    ),
}  # fmt: skip

MACHINES["joint_fast_commands"] = replace(  # the motion that jitter of arrival excites is far above its noise
    MACHINES["joint"], excitation=MACHINES["joint"].excitation | {"band": [0.2, 60.0]}
)


def simulated(machine: Machine, friction: float, seed: int, kind: str) -> Table:
    """The clean table: commands held from their stamp, positions with noise. Under `command_jitter` each command acts
    later by a uniform ARRIVAL; under `jittered` commands are sent and positions sampled at irregular times, which the stamps tell."""
    rng = np.random.default_rng(seed)
    model = Model.from_text(machine.nominal, "model.yaml").with_values(machine.truth)
    if friction > 0.0:
        model = model.with_element(load_catalogue()["coulomb_friction"], {"force": friction})
    stamps = np.arange(int((machine.length + SETTLED) * machine.rate)) / machine.rate
    if kind == "jittered":
        late = rng.normal(0.0, IRREGULAR / machine.rate, len(stamps))
        stamps = np.sort(stamps + late.clip(-0.45 / machine.rate, 0.45 / machine.rate))
    command = build(machine.excitation | {"seed": seed})(stamps)
    arrival = stamps + rng.uniform(*ARRIVAL, len(stamps)) if kind == "command_jitter" else stamps
    run = simulate(model, stamps, zero_order_hold(arrival, command))
    kept = stamps >= SETTLED
    output = run.output + rng.normal(0.0, machine.noise, len(stamps))
    return {"t": stamps[kept] - SETTLED, "u": command[kept], "y": output[kept]}


def rows(table: Table, chosen: NDArray[np.bool_] | NDArray[np.int64]) -> Table:
    return {name: column[chosen] for name, column in table.items()}


def without(table: Table, lost: NDArray[np.int64]) -> Table:
    """The table without these rows, the first and last of which always stay."""
    keep = np.ones(len(table["t"]), bool)
    keep[lost] = False
    keep[[0, -1]] = True
    return rows(table, keep)


def spans(rng: np.random.Generator, table: Table, count: int, length: float) -> NDArray[np.int64]:
    """Rows of `count` spans of `length` [s] that do not touch, at least half a second from either end."""
    t = table["t"]
    room = (t[-1] - 1.0 - count * 1.5 * length) / count
    begins = [0.5 + k * (room + 1.5 * length) + rng.uniform(0.0, room) for k in range(count)]
    return np.flatnonzero(np.any([(t >= b) & (t < b + length) for b in begins], axis=0))


def few_lost(rng: np.random.Generator, table: Table) -> Table:
    return without(table, rng.choice(len(table["t"]), len(table["t"]) // 100, replace=False))


def bursts(rng: np.random.Generator, table: Table) -> Table:
    n = len(table["t"])
    first = rng.choice(n, n // 1000 + 3, replace=False)
    return without(
        table, np.unique(np.clip([f + k for f in first for k in range(rng.integers(2, 11))], 0, n - 1))
    )


def measurements_lost(rng: np.random.Generator, table: Table) -> Table:
    """Positions that are missing (empty fields) where the commands are there: single ones, and a span of 0.3 s."""
    y = table["y"].copy()
    y[rng.choice(len(y), len(y) // 100, replace=False)] = np.nan
    y[spans(rng, table, 1, 0.3)] = np.nan
    return table | {"y": y}


def lost_apart(rng: np.random.Generator, table: Table) -> Table:
    """Commands and positions that are missing (empty fields) one by one, each for itself, as two topics lose messages."""
    found = {name: table[name].copy() for name in ("u", "y")}
    for column in found.values():
        column[1 + rng.choice(len(column) - 2, len(column) // 100, replace=False)] = np.nan
    return table | found


def together(rng: np.random.Generator, table: Table) -> Table:
    """Stamps that are out, 1 % of the rows lost, a gap of 0.3 s, and rows that come twice or out of order, in one table."""
    for fault in (stamps_out, FAULTS["gap"], few_lost, duplicated, reordered):
        table = fault(rng, table)
    return table


def duplicated(rng: np.random.Generator, table: Table) -> Table:
    n = len(table["t"])
    return rows(table, np.sort(np.concatenate([np.arange(n), rng.choice(n, n // 100, replace=False)])))


def reordered(rng: np.random.Generator, table: Table) -> Table:
    order = np.arange(len(table["t"]))
    for k in rng.choice(len(order) // 4 - 1, len(order) // 200, replace=False):
        order[4 * k : 4 * k + 2] = order[4 * k : 4 * k + 2][::-1]
    return rows(table, order)


def rounded(rng: np.random.Generator, table: Table) -> Table:
    """Positions rounded to a step of a two-thousandth of their range, but for three in a hundred."""
    step = float(np.ptp(table["y"])) / 2000.0
    y = step * np.round(table["y"] / step)
    free = rng.choice(len(y), 3 * len(y) // 100, replace=False)
    y[free] = table["y"][free]
    return table | {"y": y}


def stamps_out(rng: np.random.Generator, table: Table) -> Table:
    """Positions whose stamps do not say when they were taken: each is that of another time than the row's, by at most a period."""
    t, period = table["t"], float(np.median(np.diff(table["t"])))
    late = np.clip(STAMPED * period * rng.standard_normal(len(t)), -period, period)
    return table | {"y": CubicSpline(t, table["y"])(np.clip(t + late, t[0], t[-1]))}


def held_back(rng: np.random.Generator, table: Table) -> Table:
    """Rows that were held and written in bursts, each with the time of writing."""
    t = table["t"]
    release = t[0] + np.cumsum(rng.uniform(0.0, 2.0 * HELD, int(2 * np.ptp(t) / HELD) + 2))
    late = release[np.searchsorted(release, t)] + WRITING * (np.arange(len(t)) % 10)
    written = np.asarray(np.maximum.accumulate(late) + 1e-7 * np.arange(len(t)), dtype=float)
    return table | {"t": written}


FAULTS: dict[str, Fault] = {
    "clean": lambda rng, table: table,
    "few_lost": few_lost,
    "bursts": bursts,
    "gap": lambda rng, table: without(table, spans(rng, table, 1, 0.3)),
    "gaps": lambda rng, table: without(table, spans(rng, table, 5, 2.0)),
    "measurements_lost": measurements_lost,
    "lost_apart": lost_apart,
    "duplicated": duplicated,
    "reordered": reordered,
    "jittered": lambda rng, table: table,  # made by the simulation
    "rounded": rounded,
    "held_back": held_back,
    "stamp_jitter": stamps_out,
    "command_jitter": lambda rng, table: table,  # made by the simulation
    "together": together,
}


def written(folder: Path, machine: Machine, table: Table) -> tuple[Path, Path]:
    """signals.yaml and model.yaml in the folder."""
    folder.mkdir(parents=True)
    write_table(folder / "log.csv", table)
    force, length = machine.units
    (folder / "signals.yaml").write_text(
        f"time: {{column: t}}\ntables: {{file: log.csv}}\ninput: {{column: u, unit: {force}{machine.hold}}}\n"
        f"output: {{column: y, unit: {length}}}\n"
    )
    (folder / "model.yaml").write_text(machine.nominal.strip() + "\n")
    return folder / "signals.yaml", folder / "model.yaml"


def answered(signals: Path, model: Path, budget: float | None) -> tuple[str, str]:
    """The verdict with its names, and the figures behind it in one line."""
    begun = time.monotonic()
    try:
        said = diagnose([read_record(signals)], Model.load(model), budget=budget).diagnosis
    except InputError as error:
        return f"refused: {error}", ""
    names = " + ".join(effect.element for effect in said.missing)
    level = [
        f"{value.value:.5g} ± {value.std or 0.0:.2g}"
        for effect in said.missing
        for name, value in effect.parameters.items()
        if name == "force"
    ]
    error = said.augmented.heldout_nrmse if said.missing else said.refitted_nominal.heldout_nrmse
    told = f"{' '.join(level):22} {100 * (error or 0.0):.3g} % {said.scoring.kind} {time.monotonic() - begun:.0f} s"
    return f"{said.verdict} {names}".strip(), told


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--cases", type=int, default=2, help="random cases of each kind, machine and effect")
    parser.add_argument("--kind", nargs="+", choices=FAULTS, default=list(FAULTS))
    parser.add_argument("--machine", nargs="+", choices=MACHINES, default=list(MACHINES))
    parser.add_argument(
        "--effect", nargs="+", choices=("friction", "nothing"), default=("friction", "nothing")
    )
    parser.add_argument("--budget", type=float, help="seconds of search of each diagnosis")
    given = parser.parse_args()
    right: Counter[str] = Counter()
    total: Counter[str] = Counter()
    with tempfile.TemporaryDirectory() as work:
        for name in given.machine:
            machine = MACHINES[name]
            for effect in given.effect:
                wanted = "missing_physics coulomb_friction" if effect == "friction" else "consistent"
                friction = machine.friction if effect == "friction" else 0.0
                for kind in given.kind:
                    for case in range(given.cases):
                        seed = given.seed + case
                        table = simulated(machine, friction, seed, kind)
                        spoilt = FAULTS[kind](np.random.default_rng(1000 + seed), table)
                        files = written(Path(work) / f"{name}-{effect}-{kind}-{seed}", machine, spoilt)
                        verdict, told = answered(*files, given.budget)
                        total[kind] += 1
                        right[kind] += verdict == wanted
                        print(
                            f"{name:9} {effect:9} {kind:18} {seed:3}  {verdict == wanted!s:6} {verdict:45} {told}",
                            flush=True,
                        )
    for kind, count in total.items():
        print(f"{kind:18} {right[kind]} of {count}")


if __name__ == "__main__":
    main()
