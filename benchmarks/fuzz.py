"""A fuzzing campaign over all readers of untrusted files: an input is refused in one line, or accepted; nothing else may happen.

python benchmarks/fuzz.py [--target NAME …] [--count N] [--seconds S] [--seed N] [--log FILE] [--replay TARGET:NUMBER]

Valid inputs of each target are corrupted (mutation.py, fuzz_targets.py) and read in a separate process, which is monitored from
outside. Failures are: any exception except an InputError of one short line, a NumPy warning, an end by a signal, more time or
memory than TIME_LIMIT and MEMORY_LIMIT, and anything written outside the input's own folder, started or unpickled. Input number k
of a target is the same for the same seed. With --log a later call continues where the last one ended. Exit code 1 if anything
failed.
"""

import argparse
import json
import math
import mmap
import os
import random
import resource
import shutil
import struct
import sys
import tempfile
import time
import traceback
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from fuzz_targets import TARGETS, Target

from rhythmid.errors import InputError
from rhythmid.units import Units

TIME_LIMIT = 5.0  # s of the processor for one input, of which none is larger than some kB
PATIENCE = 60.0  # s of wall-clock time: the computer may be busy
MEMORY_LIMIT = 512  # MiB that one input may take
ADDRESS_SPACE = 8 << 30  # bytes, beyond which the process gets no memory, to protect this computer
WARM_UP = 6  # valid inputs that are read first
KNOWN_UNIT, UNKNOWN_UNIT = (
    "mm",
    "furlings",
)  # neither is the machine's: the first is converted for the message
BATCH = 1000  # inputs that one process reads
LONGEST_LINE = 1500  # characters of an error message that is still one clear line
KEPT = 20  # failures of one kind that are listed by number
FORBIDDEN = (
    "os.system",
    "os.exec",
    "os.posix_spawn",
    "subprocess.Popen",
    "pickle.find_class",
    "socket.connect",
)


@dataclass
class Tally:
    """Outcomes of a target's inputs."""

    inputs: int = 0
    refused: int = 0
    accepted: int = 0
    worst_time: float = 0.0  # s
    worst_memory: int = 0  # MiB
    failures: dict[str, list[int]] = field(default_factory=dict)  # kind -> numbers of inputs
    failed: int = 0

    def fail(self, kind: str, number: int) -> None:
        self.failed += 1
        listed = self.failures.setdefault(kind, [])
        if len(listed) < KEPT:
            listed.append(number)

    def add(self, other: "Tally") -> None:
        self.inputs += other.inputs
        self.refused += other.refused
        self.accepted += other.accepted
        self.failed += other.failed
        self.worst_time = max(self.worst_time, other.worst_time)
        self.worst_memory = max(self.worst_memory, other.worst_memory)
        for kind, numbers in other.failures.items():
            self.failures[kind] = [*self.failures.get(kind, []), *numbers][:KEPT]


class Watch:
    """Notes what a reader does besides reading. An audit hook cannot be removed, so there is one that is switched on and off."""

    def __init__(self) -> None:
        self.folder = ""
        self.seen: list[str] = []
        sys.addaudithook(self._hear)

    def _hear(self, event: str, arguments: tuple[Any, ...]) -> None:
        if not self.folder:
            return
        if event in FORBIDDEN:
            self.seen.append(event)
        elif event == "open" and isinstance(arguments[0], (str, bytes)):
            flags = arguments[2] if isinstance(arguments[2], int) else 0
            if flags & (os.O_WRONLY | os.O_RDWR | os.O_CREAT) and not os.fsdecode(arguments[0]).startswith(
                self.folder
            ):
                self.seen.append(f"writes {os.fsdecode(arguments[0])}")

    @contextmanager
    def over(self, folder: Path) -> Iterator[None]:
        """Within the block only `folder` may be written to."""
        self.seen.clear()
        self.folder = str(folder)
        try:
            yield
        finally:
            self.folder = ""


def attempt(
    target: Target, data: bytes, folder: Path, number: int, watch: Watch | None = None
) -> tuple[str, str]:
    """Outcome of an input: ("accepted" or "refused" or "failed", and how it failed)."""
    try:
        if watch is None:
            target.use(data, folder, number)
        else:
            with watch.over(folder):
                target.use(data, folder, number)
        outcome = "accepted"
    except InputError as error:
        line = str(error)
        if not line.strip() or "\n" in line or len(line) > LONGEST_LINE or not line.isprintable():
            return "failed", f"refusal is not one clear line ({len(line)} characters)"
        outcome = "refused"
    except BaseException as error:
        if isinstance(error, KeyboardInterrupt):
            raise
        return "failed", _where(error)
    if watch is not None and watch.seen:
        return "failed", watch.seen[0]
    return outcome, ""


def _where(error: BaseException) -> str:
    """An exception's type and the last line of rhythmid's code that it passed."""
    frames = traceback.extract_tb(error.__traceback__)
    ours = [frame for frame in frames if "/rhythmid/" in frame.filename] or frames
    return f"{type(error).__name__} at {Path(ours[-1].filename).name}:{ours[-1].lineno}"


def _peak() -> int:
    """Largest resident memory of this process since the last reset [MiB]."""
    with open("/proc/self/status", encoding="ascii") as status:
        return next(int(line.split()[1]) for line in status if line.startswith("VmHWM")) // 1024


def _reset_peak() -> None:
    with open("/proc/self/clear_refs", "w", encoding="ascii") as file:
        file.write("5")


def _batch(
    target: Target, seed: int, first: int, last: int, until: float, place: mmap.mmap, scratch: Path
) -> Tally:
    """Read the inputs first … last - 1 in this process, or as many as the time allows; `place` tells the watcher which one it is at, and since when."""
    tally, watch = Tally(), Watch()
    resource.setrlimit(resource.RLIMIT_AS, (ADDRESS_SPACE, ADDRESS_SPACE))
    warnings.simplefilter("error", RuntimeWarning)
    for number in range(first, last):
        if time.monotonic() > until:
            break
        data = target.hostile(seed, number)
        folder = scratch / str(number)
        folder.mkdir(parents=True)
        tempfile.tempdir = str(folder)
        _reset_peak()
        place[:16] = struct.pack("<qd", number, time.monotonic())
        before, begun = _peak(), time.process_time()
        outcome, kind = attempt(target, data, folder, number, watch)
        spent, memory = time.process_time() - begun, _peak() - before
        if outcome != "failed" and memory > MEMORY_LIMIT:
            outcome, kind = "failed", f"takes more than {MEMORY_LIMIT} MiB"
        if outcome != "failed" and spent > TIME_LIMIT:
            outcome, kind = "failed", f"takes more than {TIME_LIMIT:g} s"
        tally.inputs += 1
        tally.refused += outcome == "refused"
        tally.accepted += outcome == "accepted"
        tally.worst_time = max(tally.worst_time, spent)
        tally.worst_memory = max(tally.worst_memory, memory)
        if outcome == "failed":
            tally.fail(kind, number)
        shutil.rmtree(folder, ignore_errors=True)
    return tally


def watched(
    target: Target, seed: int, first: int, last: int, until: float, scratch: Path
) -> tuple[Tally, int]:
    """The batch in a process of its own: its tally, and the number of the input to go on with."""
    place = mmap.mmap(-1, 16)
    place[:16] = struct.pack("<qd", first, time.monotonic())
    result = scratch / "result.json"
    child = os.fork()
    if child == 0:
        try:
            result.write_text(json.dumps(asdict(_batch(target, seed, first, last, until, place, scratch))))
        except BaseException:
            traceback.print_exc()
        os._exit(0)
    reason = ""
    while True:
        ended, status = os.waitpid(child, os.WNOHANG)
        if ended:
            break
        number, begun = struct.unpack("<qd", place[:16])
        if time.monotonic() - begun > PATIENCE and not reason:
            reason = f"no answer within {PATIENCE:g} s"
            os.kill(child, 9)
        time.sleep(0.05)
    number = struct.unpack("<qd", place[:16])[0]
    if result.exists():
        tally = Tally(**json.loads(result.read_text()))
        result.unlink()
        return tally, first + tally.inputs
    shutil.rmtree(scratch / str(number), ignore_errors=True)
    # what came before the fatal input is read again: outcomes are the same, and nothing is counted twice
    tally = watched(target, seed, first, number, math.inf, scratch)[0] if number > first else Tally()
    tally.inputs += 1
    tally.fail(reason or f"died of signal {os.WTERMSIG(status)}", number)
    return tally, number + 1


def load_units() -> None:
    """Load the registry of units, as the first foreign unit does, because a library reads its own pickle while it is loaded."""
    for unit in (KNOWN_UNIT, UNKNOWN_UNIT):
        with suppress(InputError):
            Units().check(unit, "m", "warm-up")


def warm_up(target: Target, scratch: Path) -> None:
    """Read valid inputs: what a reader loads and compiles once is neither an input's time or memory nor a file that it writes."""
    load_units()
    for spare in range(WARM_UP):
        (folder := scratch / f"warm{spare}").mkdir(exist_ok=True)
        with suppress(Exception):
            target.use(random.Random(spare).choice(target.valid()), folder, spare)
        shutil.rmtree(folder)


def campaign(target: Target, seed: int, first: int, count: int, until: float, scratch: Path) -> Tally:
    """At most `count` inputs from number `first` on, until the clock reads `until`."""
    warm_up(target, scratch)
    total, number = Tally(), first
    while number < first + count and time.monotonic() < until:
        tally, number = watched(target, seed, number, min(number + BATCH, first + count), until, scratch)
        total.add(tally)
    return total


def table(tallies: dict[str, Tally]) -> str:
    """One line per target, and the failures by kind."""
    lines = [
        f"{'target':12}{'inputs':>9}{'refused':>9}{'accepted':>9}{'crashes':>9}{'worst s':>9}{'peak MiB':>9}"
    ]
    total = Tally()
    for name, tally in tallies.items():
        lines.append(_row(name, tally))
        total.add(tally)
    lines.append(_row("all", total))
    for name, tally in tallies.items():
        lines += [f"{name}: {kind}: {numbers}" for kind, numbers in tally.failures.items()]
    return "\n".join(lines)


def _row(name: str, tally: Tally) -> str:
    return (
        f"{name:12}{tally.inputs:>9}{tally.refused:>9}{tally.accepted:>9}{tally.failed:>9}{tally.worst_time:>9.2f}"
        f"{tally.worst_memory:>9}"
    )


def replay(target: Target, seed: int, number: int, scratch: Path) -> int:
    """Read one input here, with its traceback; the file stays in the scratch folder."""
    warnings.simplefilter("error", RuntimeWarning)
    print(target.hostile(seed, number)[:2000])
    target.use(target.hostile(seed, number), scratch, number)
    return 0


def main() -> int:
    parser = argparse.ArgumentParser(description="Fuzz everything that reads files of others.")
    parser.add_argument("--target", nargs="+", choices=TARGETS, default=list(TARGETS))
    parser.add_argument("--count", type=int, default=2000, help="inputs for each target")
    parser.add_argument("--seconds", type=float, default=float("inf"), help="for each target, at most")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--log", type=Path, help="tallies so far; read first, written after each target")
    parser.add_argument("--replay", metavar="TARGET:NUMBER", help="read one input, with its traceback")
    given = parser.parse_args()
    shared = "/dev/shm" if os.path.isdir("/dev/shm") else None
    with tempfile.TemporaryDirectory(prefix="rhythmid-fuzz-", dir=shared) as folder:
        if given.replay:
            name, number = given.replay.split(":")
            return replay(TARGETS[name], given.seed, int(number), Path(folder))
        logged = json.loads(given.log.read_text()) if given.log and given.log.exists() else {}
        tallies = {name: Tally(**tally) for name, tally in logged.get(str(given.seed), {}).items()}
        for name in given.target:
            tally = tallies.setdefault(name, Tally())
            until = time.monotonic() + given.seconds
            tally.add(campaign(TARGETS[name], given.seed, tally.inputs, given.count, until, Path(folder)))
            print(_row(name, tally), flush=True)
            if given.log:
                logged[str(given.seed)] = {key: asdict(one) for key, one in tallies.items()}
                given.log.write_text(json.dumps(logged))
    print(table(tallies))
    return int(any(tally.failed for tally in tallies.values()))


if __name__ == "__main__":
    sys.exit(main())
