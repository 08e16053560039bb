"""Memory and time of analysis on many long records.

    python benchmarks/long_records.py [--records N …] [--minutes M] [--rate HZ] [--command NAME …] [--forcing] [--budget S] [--longest S]
        [--seed N] [--keep FOLDER]

Simulates runs of a mass on a spring with Coulomb friction, each with a multisine of its own, and writes them as bags. Then runs
`rhythmid identify`, with the machine's own model, and `rhythmid diagnose`, with a nominal model that lacks the friction, on the first N
records, as separate processes. Printed for each: the largest memory of the process and those that it starts (proportional set size,
so that memory which forked processes share is counted once), the time, the processor time, the exit code and the first line of
the answer. Needs /proc.
"""

import argparse
import math
import os
import signal
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import yaml

LOOK = 0.5  # s between two measurements of the memory
MACHINE = """
inertia: {mass: {value: 1.0, unit: kg, fixed: true}}
force:
  - linear_spring: {stiffness: {value: 200.0, unit: N/m}, rest_length: {value: 0.0, unit: m}}
  - viscous_damper: {damping: {value: 2.0, unit: N*s/m}}
"""
FRICTION = "  - coulomb_friction: {force: {value: 0.3, unit: N}}\n"
RHYTHMID = [sys.executable, "-m", "rhythmid.cli"]


@dataclass(frozen=True)
class Used:
    """Cost of a command: memory [bytes], wall-clock and processor time [s], its exit code and its output."""

    memory: int
    seconds: float
    processor: float
    code: int
    answer: str


def family(root: int) -> list[int]:
    """The process and all its descendants."""
    parent: dict[int, int] = {}
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                parent[int(entry.name)] = int((entry / "stat").read_text().rpartition(")")[2].split()[1])
            except OSError:
                continue
    found = [root]
    for pid in found:
        found += [child for child, of in parent.items() if of == pid]
    return found


def memory_of(root: int) -> int:
    """Proportional set size [bytes] of a process and all its descendants."""
    total = 0
    for pid in family(root):
        try:
            lines = Path(f"/proc/{pid}/smaps_rollup").read_text().splitlines()
        except OSError:
            continue
        total += sum(1024 * int(line.split()[1]) for line in lines if line.startswith("Pss:"))
    return total


def measured(command: list[str], log: Path, longest: float) -> Used:
    """Run a command to its end, its messages of progress to `log`; after `longest` [s] it is interrupted as by Ctrl-C."""
    begun, most = time.monotonic(), 0
    with log.open("w") as errors, tempfile.TemporaryFile("w+") as output:
        process = subprocess.Popen(command, stdout=output, stderr=errors)
        while True:
            pid, status, usage = os.wait4(process.pid, os.WNOHANG)
            if pid:
                break
            most = max(most, memory_of(process.pid))
            if time.monotonic() - begun > longest:
                process.send_signal(signal.SIGINT)
                longest = math.inf
            time.sleep(LOOK)
        process.returncode = os.waitstatus_to_exitcode(status)
        output.seek(0)
        answer = next((line.strip() for line in output if line.strip()), "")
    seconds = time.monotonic() - begun
    return Used(most, seconds, usage.ru_utime + usage.ru_stime, process.returncode, answer)


def simulated(folder: Path, index: int, given: argparse.Namespace) -> Path:
    """A bag of one run."""
    bag = folder / f"record_{index}"
    if bag.exists():
        return bag
    length = 60.0 * given.minutes
    experiment = {
        "model": "machine.yaml",
        "excitation": {
            "type": "multisine", "rms": 3.0, "period": length / 6.0, "periods": 6, "band": [0.3, 6.0], "seed": given.seed + index,
        },
        "forcing": {"amplitude": 1.0 if given.forcing else 0.0, "frequency": 1.0, "phase": 0.0},
        "noise": {"measurement_std": 2e-5},
        "record": {"topics": ["excitation", "joint_states", "run", *(["forcing"] if given.forcing else [])]},
        "time": {"rate": given.rate},
        "duration": length,
        "seed": given.seed + index,
    }  # fmt: skip
    path = folder / f"experiment_{index}.yaml"
    path.write_text(yaml.safe_dump(experiment))
    machine = str(folder / "machine.yaml")
    command = [*RHYTHMID, "simulate", machine, "--experiment", str(path), "--out", str(bag)]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return bag


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--records", type=int, nargs="+", default=[2, 5, 20])
    parser.add_argument("--minutes", type=float, default=5.0, help="length of each record")
    parser.add_argument("--rate", type=int, default=1000, help="samples per second")
    parser.add_argument(
        "--command", nargs="+", choices=("identify", "diagnose"), default=("identify", "diagnose")
    )
    parser.add_argument("--forcing", action="store_true", help="a third channel, of a forcing of 1 N at 1 Hz")
    parser.add_argument("--budget", type=float, help="seconds of search of each diagnosis")
    parser.add_argument(
        "--longest",
        type=float,
        default=math.inf,
        help="seconds after which a command is interrupted (exit code 130)",
    )
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--keep", type=Path, help="folder for the bags, used again where they are there")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as work:
        folder = given.keep or Path(work)
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "machine.yaml").write_text(MACHINE + FRICTION)
        (folder / "nominal.yaml").write_text(MACHINE)
        bags = [str(simulated(folder, index, given)) for index in range(max(given.records))]
        for count in given.records:
            for name in given.command:
                model = folder / ("machine.yaml" if name == "identify" else "nominal.yaml")
                command = [*RHYTHMID, name, *bags[:count], "--model", str(model)]
                if name == "diagnose" and given.budget is not None:
                    command += ["--budget", str(given.budget)]
                used = measured(command, folder / f"{name}_{count}.log", given.longest)
                print(
                    f"{name:8} {count:3} records of {given.minutes:g} min at {given.rate} Hz: {used.memory / 2**20:6.0f} MiB, "
                    f"{used.seconds:5.0f} s, {used.processor:5.0f} s of processor time, exit code {used.code}  {used.answer}",
                    flush=True,
                )


if __name__ == "__main__":
    main()
