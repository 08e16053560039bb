"""The live twin on simulated machines: the time to report a change of physics, the slot, and the rate of false alarms.

    python benchmarks/watch.py changes --runs 34         # of each of three machines; every run is changed in four ways
    python benchmarks/watch.py days --pieces 12 --hours 2    # healthy operation, each piece another machine

Machines are drawn at random about three designs. The model is not the true one, but is identified by `rhythmid identify` from a record of the same
machine. Each run has its own noise and excitation. The changes: friction doubled, 5 ms more delay of the command, or of the
measurement, a payload of 5 % of the inertia. A change counts as reported if a warning comes within 10 s. Its slot is evaluated
10 s after the change, and is right if it is named first. The joint has no forcing, so that its
command delay cannot be separated from its measurement delay: there exactly these two slots are right, in any order.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from machines_at_work import DESIGNS, DRIVES, RATE, Machine, Operation, Stretch, drawn
from numpy.typing import NDArray

from rhythmid.elements.catalogue import load_catalogue
from rhythmid.identify.identify import identify
from rhythmid.model import INERTIA, Model
from rhythmid.record.clock_time import DAY
from rhythmid.record.record import Channel, Record
from rhythmid.twin.changes import DELAYS
from rhythmid.twin.settings import Settings
from rhythmid.twin.twin import Status, Twin

Array = NDArray[np.float64]
HEALTHY = 60.0  # s
WITHIN = 10.0  # s
LEAD = 12.0  # s before a change at which a calibrated twin starts
IDENTIFIED = 40.0  # s of record for the identification
CHUNK = 60.0  # s simulated at a time
FRICTION = {
    "hopper": "switched_damper.stance",
    "lift": "coulomb_friction.force",
    "joint": "coulomb_friction.force",
}
CHANGES = {
    "friction": "force",
    "command delay": "command",
    "measurement delay": "sensor",
    "payload": "inertia",
}
EITHER = frozenset({"command", "sensor"})  # of a delay if only command and output are known
LATER = 0.005  # s


def record(made: Stretch) -> Record:
    """A stretch as a record."""
    forced = Channel(made.time, made.forcing, "N") if np.any(made.forcing) else None
    return Record(
        "stretch", Channel(made.stamp, made.measured, "m"), Channel(made.time, made.command, "N"), forced
    )


def identified(machine: Machine, seed: int, keep: Path | None, off: float | None) -> Model:
    """The identified model of a machine, starting from its design; read from the folder `keep` if it is there.

    With `off` the true parameters, each wrong by about that share, and the delays by that share of `LATER`, which is much quicker.
    """
    if off is not None:
        errors = off * np.random.default_rng([seed, 4]).standard_normal(len(machine.truth.free))
        values = {
            name: machine.truth.value(name) * (1.0 + error)
            if name not in DELAYS
            else machine.truth.value(name) + LATER * error
            for name, error in zip(machine.truth.free, errors)
        }
        return machine.truth.with_values({name: max(0.0, value) for name, value in values.items()})
    file = None if keep is None else keep / f"{machine.name}_{seed}.yaml"
    if file is not None and file.exists():
        return Model.load(file)
    found = _identified(machine, seed)
    if file is not None:
        found.save(file)
    return found


def _identified(machine: Machine, seed: int) -> Model:
    made = Operation(machine, seed).run(machine.truth, 0.0, IDENTIFIED)
    design = Model.from_text(DESIGNS[machine.name], machine.name, load_catalogue())
    return identify([record(made)], design).model


def fed(twin: Twin, made: Stretch) -> Iterator[Status]:
    """The reports of a twin on a piece of record that arrives in steps of a second."""
    step = round(RATE)
    for first in range(0, len(made.time), step):
        part = slice(first, first + step)
        twin.push("input", made.time[part], made.command[part])
        if "forcing" in twin.samples:
            twin.push("forcing", made.time[part], made.forcing[part])
        twin.push("output", made.stamp[part], made.measured[part])
        yield from twin.advance()


def changed(model: Model, change: str, name: str) -> Model:
    """The machine after a change."""
    parameter, factor, more = {
        "friction": (FRICTION[name], 2.0, 0.0),
        "payload": (INERTIA, 1.05, 0.0),
        "command delay": ("input_delay.delay", 1.0, LATER),
        "measurement delay": ("measurement_delay.delay", 1.0, LATER),
    }[change]
    return model.with_values({parameter: model.value(parameter) * factor + more})


@dataclass(frozen=True)
class Outcome:
    """Of one change: seconds until it was reported, None if not within ten; the reported slot; alarms before it."""

    machine: str
    seed: int
    change: str
    after: float | None
    slot: str | None
    rivals: tuple[str, ...]
    early: bool

    @property
    def named(self) -> frozenset[str | None]:
        """The slots that were named; empty where the change was not reported in time."""
        return frozenset() if self.after is None else frozenset({self.slot, *self.rivals})

    @property
    def inseparable(self) -> bool:
        """Whether the measurements do not separate the change from one in another slot."""
        return DRIVES[self.machine][0] == 0.0 and CHANGES[self.change] in EITHER

    @property
    def right(self) -> bool:
        """Whether the answer is right: the slot first, or both slots if they are not separable."""
        if self.inseparable:
            return self.named == EITHER
        return self.after is not None and self.slot == CHANGES[self.change]

    @property
    def alone(self) -> bool:
        """Whether one slot alone was named, and it was right."""
        return self.right and not self.rivals


def one_run(machine: Machine, model: Model, seed: int) -> list[Outcome]:
    """All changes of one run."""
    operation, forced = Operation(machine, seed), machine.forcing[0] != 0.0
    learnt = operation.run(machine.truth, 0.0, HEALTHY + 2.0)
    twin = Twin(model, Settings(healthy=HEALTHY), forced)
    for _ in fed(twin, learnt):
        pass
    start = HEALTHY + 2.0
    at = start + LEAD + float(np.random.default_rng([seed, 2]).uniform(0.0, 2.0))
    lead = operation.run(machine.truth, start, at, learnt.end)
    found = []
    for change in CHANGES:
        after = operation.run(changed(machine.truth, change, machine.name), at, at + WITHIN + 1.0, lead.end)
        live = Twin(model, Settings(), forced, twin.calibration)
        joined = [
            Stretch(*(np.concatenate([a[:-1], b]) for a, b in zip(vars(lead).values(), vars(after).values())))
        ]
        said = [status for part in joined for status in fed(live, part)]
        change_seen = at + operation.delay
        early = any(one.since is not None and one.time < change_seen for one in said)
        seen = [one.time - change_seen for one in said if one.since is not None and one.time >= change_seen]
        last = [one for one in said if one.time <= change_seen + WITHIN][-1].isolation
        soon = seen[0] if seen and seen[0] <= WITHIN else None
        slot, rivals = (None, ()) if last is None else (last.slot, last.rivals)
        found.append(Outcome(machine.name, seed, change, soon, slot, rivals, early))
    return found


def changes(
    runs: int, machines: int, names: list[str], seed: int, keep: Path | None, off: float | None
) -> None:
    """Print how soon changes are reported, and with which slot. What the folder `keep` holds of earlier calls counts as well."""
    outcomes: list[Outcome] = []
    file = None if keep is None else keep / "outcomes.jsonl"
    if file is not None and file.exists():
        outcomes = [Outcome(**json.loads(line)) for line in file.read_text(encoding="utf-8").splitlines()]
    done = {(one.machine, one.seed) for one in outcomes}
    for name in names:
        rng = np.random.default_rng([seed, list(DESIGNS).index(name)])
        for number in range(machines):
            machine = drawn(name, rng)
            begun = time.monotonic()
            model = identified(machine, 1000 * (seed + 1) + number, keep, off)
            took = time.monotonic() - begun
            begun = time.monotonic()
            for run in range(number, runs, machines):
                own = 100_000 * seed + 10_000 * number + run
                if (name, own) in done:
                    continue
                found = one_run(machine, model, own)
                outcomes += found
                if file is not None:
                    with file.open("a", encoding="utf-8") as lines:
                        lines.writelines(json.dumps(vars(one)) + "\n" for one in found)
            print(
                f"{name} {number}: identified in {took:.0f} s, runs in {time.monotonic() - begun:.0f} s",
                flush=True,
            )
        show([one for one in outcomes if one.machine == name], name)
    show(outcomes, "all")


def show(outcomes: list[Outcome], title: str) -> None:
    """A line for each change."""
    for change, slot in CHANGES.items():
        mine = [one for one in outcomes if one.change == change]
        times = sorted(one.after for one in mine if one.after is not None)
        if not mine:
            continue
        middle = f"median {np.median(times):.2f} s, longest {times[-1]:.2f} s" if times else "never"
        wrong = [
            f"{one.machine}: {' or '.join((str(one.slot), *one.rivals))}" for one in mine if not one.right
        ]
        listed = sum(slot in one.named for one in mine)
        print(
            f"{title:7s} {change:18s} reported {len(times)} of {len(mine)} ({middle}); slot {slot}: right {sum(o.right for o in mine)}, "
            f"named alone {sum(o.alone for o in mine)} of {sum(not o.inseparable for o in mine)} that can be, among those named {listed}; "
            f"alarms before the change: {sum(o.early for o in mine)}; wrong: {wrong}", flush=True
        )  # fmt: skip


def days(
    pieces: int,
    hours: float,
    names: list[str],
    seed: int,
    false_alarms: float,
    keep: Path | None,
    off: float | None,
) -> None:
    """Print the number of alarms in healthy operation."""
    total, alarms = 0.0, 0
    largest: list[float] = []
    for piece in range(pieces):
        name = names[piece % len(names)]
        machine = drawn(name, np.random.default_rng([seed, piece, 3]))
        model = identified(machine, 500_000 + 1000 * seed + piece, keep, off)
        operation = Operation(machine, seed + 77 * piece)
        twin = Twin(model, Settings(healthy=HEALTHY, false_alarms=false_alarms), machine.forcing[0] != 0.0)
        begun, state, events, last, peak = time.monotonic(), None, set(), 0.0, 0.0
        for start in np.arange(0.0, hours * 3600.0, CHUNK):
            made = operation.run(machine.truth, float(start), float(start) + CHUNK, state)
            state = made.end
            made = Stretch(*(one[:-1] for one in vars(made).values()))
            for status in fed(twin, made):
                if status.level != "learning":
                    last, peak = status.time, max(peak, status.mismatch)
                if status.since is not None:
                    events.add(status.since)
        watched = max(0.0, last - HEALTHY)
        total, alarms = total + watched, alarms + len(events)
        largest.append(peak)
        print(
            f"{name} {piece}: {watched / 3600.0:.2f} h watched in {time.monotonic() - begun:.0f} s, {len(events)} alarms, "
            f"largest statistic {peak:.2f} of its threshold; {total / DAY:.2f} days, {alarms} alarms so far", flush=True
        )  # fmt: skip
    print(f"{alarms} false alarms in {total / DAY:.2f} days; {false_alarms:g} a day are allowed")


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    commands = parser.add_subparsers(dest="command", required=True)
    one = commands.add_parser("changes")
    one.add_argument("--runs", type=int, default=34)
    one.add_argument("--machines", type=int, default=4, help="drawn of each design")
    two = commands.add_parser("days")
    two.add_argument("--pieces", type=int, default=12)
    two.add_argument("--hours", type=float, default=2.0)
    two.add_argument("--false-alarms", type=float, default=1.0)
    for sub in (one, two):
        sub.add_argument("--designs", nargs="+", choices=list(DESIGNS), default=list(DESIGNS))
        sub.add_argument("--keep", type=Path, help="folder for models and outcomes, to go on with later")
        sub.add_argument(
            "--off-by", type=float, help="share by which parameters are off, instead of identification"
        )
        sub.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    if given.command == "changes":
        changes(given.runs, given.machines, given.designs, given.seed, given.keep, given.off_by)
    else:
        days(
            given.pieces, given.hours, given.designs, given.seed, given.false_alarms, given.keep, given.off_by
        )


if __name__ == "__main__":
    main()
