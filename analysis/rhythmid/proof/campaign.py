"""Many cases, several at a time, each drawn, sealed, diagnosed, opened and scored; what is done is never done again."""

import json
import multiprocessing
import os
import shutil
import time
import traceback
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from rhythmid.elements.catalogue import load_catalogue
from rhythmid.errors import InputError
from rhythmid.output import write_json, write_text
from rhythmid.proof.card import markdown, summary
from rhythmid.proof.draw import KINDS, Kind, draw_case
from rhythmid.proof.examine import examine
from rhythmid.proof.perform import perform
from rhythmid.proof.score import Estimated, Score, score
from rhythmid.proof.seal import seal, truth_of, unseal

SHARES: dict[Kind, int] = {"single": 3, "null": 3, "pairs": 1, "left-out": 1}  # of a campaign of all kinds
LIFETIME = 40  # cases that a worker process does before a fresh one takes its place
SEALED, CASES = "sealed", "cases"
Report = Callable[["Sealed | Score"], None]


@dataclass(frozen=True)
class Task:
    """One case to be done."""

    seed: int
    kind: Kind
    index: int

    @property
    def name(self) -> str:
        return f"{self.kind}-{self.index:04d}"


@dataclass(frozen=True)
class Sealed:
    """Told before a diagnosis begins."""

    case: str
    sha256: str


@dataclass(frozen=True)
class Campaign:
    """What is to be proved: `cases` cases of a kind, or of all kinds in the proportions of `SHARES`."""

    seed: int
    kind: str
    cases: int

    @property
    def tasks(self) -> list[Task]:
        if self.kind != "all":
            only: list[Kind] = [kind for kind in KINDS if kind in (self.kind,)]
            return [Task(self.seed, only[0], index) for index in range(self.cases)]
        whole = sum(SHARES.values())
        order: list[Kind] = [kind for kind in KINDS for _ in range(SHARES[kind])]
        found: list[Task] = []
        counts: dict[Kind, int] = dict.fromkeys(KINDS, 0)
        for number in range(self.cases):
            kind = order[(number * 3) % whole]  # 3 and the sum of the shares have no common divisor
            found.append(Task(self.seed, kind, counts[kind]))
            counts[kind] += 1
        return found

    @property
    def command(self) -> str:
        return f"rhythmid proof --kind {self.kind} --cases {self.cases} --seed {self.seed}"


def _prepare(task: Task, out: Path) -> Sealed:
    """Draw a case, write its bags and seal the truth."""
    case = draw_case(task.seed, task.kind, task.index)
    folder = out / CASES / task.name
    if folder.exists():
        shutil.rmtree(folder)
    floors = perform(case, folder, [task.seed, KINDS.index(task.kind), task.index, 1_000_000])
    told = seal(out / SEALED / f"{task.name}.json", truth_of(case, floors))
    return Sealed(task.name, told)


def _diagnose(task: Task, out: Path, absent: Sequence[str]) -> None:
    """Diagnose from the case's folder; `absent` are the elements that the catalogue is robbed of."""
    folder = out / CASES / task.name
    answer = examine(folder, load_catalogue().without(*absent))
    write_json(folder / "answer.json", answer)


def _absent(task: Task, out: Path) -> tuple[str, ...]:
    """Which elements the catalogue loses: the one thing of the truth that must be known beforehand."""
    if task.kind != "left-out":
        return ()
    return tuple(json.loads((out / SEALED / f"{task.name}.json").read_text(encoding="utf-8"))["absent"])


def _open(task: Task, out: Path, told: str, keep: bool) -> Score:
    """Open the seal, score, and clear away the bags."""
    folder = out / CASES / task.name
    truth = unseal(out / SEALED / f"{task.name}.json", told)
    answer = json.loads((folder / "answer.json").read_text(encoding="utf-8"))
    made = score(truth, answer, load_catalogue())
    write_json(folder / "score.json", asdict(made))
    if not keep:
        for part in ("learn", "judge"):
            shutil.rmtree(folder / part, ignore_errors=True)
    return made


def read_score(path: Path) -> Score:
    """A score written before."""
    data = json.loads(path.read_text(encoding="utf-8"))
    for name in ("effects", "machine"):
        data[name] = tuple(Estimated(**one) for one in data[name])
    for name in ("true", "named", "absent"):
        data[name] = tuple(data[name])
    data["families"] = tuple(tuple(group) for group in data["families"])
    return Score(**data)


def _pin(cores: Sequence[int]) -> None:
    if cores and hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, cores)


def _shares(jobs: int) -> list[list[int]]:
    """Processors of each worker: together all of them, no two workers on the same one while there are enough."""
    if not hasattr(os, "sched_getaffinity"):
        return [[] for _ in range(jobs)]
    cores = sorted(os.sched_getaffinity(0))
    if jobs > len(cores):
        return [[cores[worker % len(cores)]] for worker in range(jobs)]
    return [cores[worker::jobs] for worker in range(jobs)]


class _Worker:
    """A process of its own that does one case after another, and is replaced when it dies or has grown old."""

    def __init__(self, cores: Sequence[int]) -> None:
        self._cores = cores
        self._pool: ProcessPoolExecutor | None = None

    def submit(self, step: Callable[..., Any], *arguments: Any) -> Future:
        if self._pool is None:
            self._pool = ProcessPoolExecutor(
                1,
                multiprocessing.get_context("spawn"),
                _pin,
                (self._cores,),
                max_tasks_per_child=3 * LIFETIME,
            )
        return self._pool.submit(step, *arguments)

    def forget(self) -> None:
        if self._pool is not None:
            self._pool.shutdown(wait=False, cancel_futures=True)
            self._pool = None


def _steps(task: Task, out: Path, keep: bool, worker: _Worker, report: Report) -> Iterator[Future]:
    """The steps of a case, each a future of its worker: sealed first, opened last."""
    ready = worker.submit(_prepare, task, out)
    yield ready
    sealed = ready.result()
    with (out / "seals.txt").open("a", encoding="utf-8") as told:
        told.write(f"{time.strftime('%Y-%m-%dT%H:%M:%S')}  {sealed.sha256}  {sealed.case}\n")
    report(sealed)
    done = worker.submit(_diagnose, task, out, _absent(task, out))
    yield done
    done.result()
    scored = worker.submit(_open, task, out, sealed.sha256, keep)
    yield scored
    report(scored.result())


def begin(out: Path, campaign: Campaign, resume: bool) -> None:
    """Prepare the folder. Raises InputError when it holds another campaign, or this one without `resume`."""
    about = out / "campaign.json"
    if about.exists():
        known = json.loads(about.read_text(encoding="utf-8"))
        if not resume:
            raise InputError(
                f"{out}: holds a campaign already; continue it with --resume, or choose another folder"
            )
        if (known["seed"], known["kind"]) != (campaign.seed, campaign.kind):
            raise InputError(
                f"{out}: holds the campaign --kind {known['kind']} --seed {known['seed']}; only --cases may change"
            )
    elif out.exists() and any(out.iterdir()):
        raise InputError(f"{out}: is not empty and holds no campaign; choose another folder")
    out.mkdir(parents=True, exist_ok=True)
    write_json(about, asdict(campaign))


def scores_in(out: Path, tasks: Sequence[Task]) -> list[Score]:
    """Scores of the cases that are done."""
    paths = [out / CASES / task.name / "score.json" for task in tasks]
    return [read_score(path) for path in paths if path.exists()]


def write_card(out: Path, campaign: Campaign) -> list[Score]:
    """Write the score card, `proof.md` and `proof.json`, of the cases that are done."""
    tasks = campaign.tasks
    scores = scores_in(out, tasks)
    write_text(out / "proof.md", markdown(scores, campaign.command, len(scores) == len(tasks)))
    write_json(out / "proof.json", {"command": campaign.command, **summary(scores)})
    return scores


def carry_out(
    out: Path, tasks: Sequence[Task], jobs: int, report: Report, keep: bool = False
) -> dict[str, str]:
    """Do the cases that have no score yet, `jobs` at a time, each worker on processors of its own.

    Returns the failures of the proof itself (not of a diagnosis, which are scored), by case.
    """
    left = [task for task in tasks if not (out / CASES / task.name / "score.json").exists()]
    waiting = iter(left)
    failures: dict[str, str] = {}
    running: dict[Future, tuple[_Worker, Task, Iterator[Future]]] = {}

    def advance(worker: _Worker, task: Task, steps: Iterator[Future]) -> bool:
        try:
            running[next(steps)] = worker, task, steps
            return True
        except StopIteration:
            return False
        except BrokenProcessPool:
            worker.forget()
            failures[task.name] = "the process died"
        except Exception:  # whatever went wrong with one case, the others go on
            failures[task.name] = traceback.format_exc()
        return False

    def start(worker: _Worker) -> None:
        for task in waiting:
            if advance(worker, task, _steps(task, out, keep, worker, report)):
                return

    workers = [_Worker(cores) for cores in _shares(jobs)]
    try:
        for worker in workers:
            start(worker)
        while running:
            done, _ = wait(running, return_when=FIRST_COMPLETED)
            for future in done:
                worker, task, steps = running.pop(future)
                if not advance(worker, task, steps):
                    start(worker)
    finally:
        for worker in workers:
            worker.forget()
    return failures
