"""Run many cases in parallel: each is drawn, sealed, diagnosed, opened and scored; finished cases are not repeated."""

import json
import multiprocessing
import os
import shutil
import threading
import time
import traceback
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter

from rhythmid.elements.catalogue import load_catalogue
from rhythmid.errors import InputError
from rhythmid.output import write_json, write_text
from rhythmid.proof.card import markdown, summary
from rhythmid.proof.draw import KINDS, Kind, draw_case
from rhythmid.proof.examine import examine
from rhythmid.proof.machines.designs import DESIGNS
from rhythmid.proof.perform import perform
from rhythmid.proof.score import Score, score
from rhythmid.proof.seal import seal, truth_of, unseal

# proportions in a campaign of all kinds
SHARES: dict[Kind, int] = {"single": 3, "null": 3, "pairs": 1, "left-out": 1}
LIFETIME = 40  # cases after which a worker process is replaced
ALL = "all"  # machines
SEALED, CASES = "sealed", "cases"
Report = Callable[["Sealed | Score"], None]


@dataclass(frozen=True)
class Task:
    """One case to run; `budget` [s] limits its diagnosis, 0 means no limit."""

    seed: int
    kind: Kind
    index: int
    design: str = "hopper"
    cluttered: bool = False
    budget: float = 0.0

    @property
    def name(self) -> str:
        return f"{self.kind}{'-cluttered' if self.cluttered else ''}-{self.design}-{self.index:04d}"

    @property
    def stream(self) -> list[int]:
        """Seeds of the noise, different for every case."""
        apart = [list(DESIGNS).index(self.design), int(self.cluttered)]
        return [self.seed, KINDS.index(self.kind), self.index, 1_000_000, *(apart if any(apart) else [])]


@dataclass(frozen=True)
class Sealed:
    """The hash of a sealed truth, reported before the diagnosis begins."""

    case: str
    sha256: str


@dataclass(frozen=True)
class Campaign:
    """A set of cases.

    `cases` cases of one kind, or of all kinds in the proportions of `SHARES`; on one machine or on all in turn; with or without
    clutter.
    """

    seed: int
    kind: str
    cases: int
    machine: str = ALL
    cluttered: bool = False
    budget: float = 0.0

    @property
    def tasks(self) -> list[Task]:
        whole = sum(SHARES.values())
        order: list[Kind] = [kind for kind in KINDS for _ in range(SHARES[kind])]
        machines = list(DESIGNS) if self.machine == ALL else [self.machine]
        found: list[Task] = []
        counts: dict[Kind, int] = dict.fromkeys(KINDS, 0)
        for number in range(self.cases):
            # 3 and the sum of the shares are coprime
            drawn: list[Kind] = [one for one in KINDS if one == self.kind] or [order[(number * 3) % whole]]
            kind = drawn[0]
            index, machine = divmod(counts[kind], len(machines))
            found.append(Task(self.seed, kind, index, machines[machine], self.cluttered, self.budget))
            counts[kind] += 1
        return found

    @property
    def command(self) -> str:
        more = "".join(
            [
                f" --machine {self.machine}" if self.machine != ALL else "",
                " --cluttered" if self.cluttered else "",
                f" --budget {self.budget:g}" if self.budget else "",
            ]
        )
        return f"rhythmid proof --kind {self.kind}{more} --cases {self.cases} --seed {self.seed}"


def _prepare(task: Task, out: Path) -> Sealed:
    """Draw a case, write its records and seal the truth."""
    case = draw_case(task.seed, task.kind, task.index, design=task.design, cluttered=task.cluttered)
    folder = out / CASES / task.name
    if folder.exists():
        shutil.rmtree(folder)
    floors = perform(case, folder, task.stream)
    told = seal(out / SEALED / f"{task.name}.json", truth_of(case, floors))
    return Sealed(task.name, told)


def _diagnose(task: Task, out: Path, absent: Sequence[str]) -> None:
    """Diagnose from the case's folder; `absent` are the elements removed from the catalogue."""
    folder = out / CASES / task.name
    answer = examine(folder, load_catalogue().without(*absent), task.budget or None)
    write_json(folder / "answer.json", answer)


def _absent(task: Task, out: Path) -> tuple[str, ...]:
    """Elements removed from the catalogue: the only part of the truth that must be known before the diagnosis."""
    if task.kind != "left-out":
        return ()
    return tuple(json.loads((out / SEALED / f"{task.name}.json").read_text(encoding="utf-8"))["absent"])


def _open(task: Task, out: Path, told: str, keep: bool) -> Score:
    """Open the seal, score, and remove the bags."""
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
    return TypeAdapter(Score).validate_python(json.loads(path.read_text(encoding="utf-8")))


def _begin(cores: Sequence[int], parent: int) -> None:
    """Use only these processors, and end when the `parent` has ended: a signal that ends it does not reach its workers."""
    if cores and hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, cores)
    threading.Thread(target=_end_with, args=(parent,), daemon=True).start()


def _end_with(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(1.0)
    os._exit(1)


def _shares(jobs: int) -> list[list[int]]:
    """Processors of each worker; all are used, and no two workers share one while there are enough."""
    if not hasattr(os, "sched_getaffinity"):
        return [[] for _ in range(jobs)]
    cores = sorted(os.sched_getaffinity(0))
    if jobs > len(cores):
        return [[cores[worker % len(cores)]] for worker in range(jobs)]
    return [cores[worker::jobs] for worker in range(jobs)]


class _Worker:
    """A process that runs one case after another, and is replaced when it dies or after `LIFETIME` cases."""

    def __init__(self, cores: Sequence[int]) -> None:
        self._cores = cores
        self._pool: ProcessPoolExecutor | None = None

    def submit(self, step: Callable[..., Any], *arguments: Any) -> Future:
        if self._pool is None:
            self._pool = ProcessPoolExecutor(
                1,
                multiprocessing.get_context("spawn"),
                _begin,
                (self._cores, os.getpid()),
                max_tasks_per_child=3 * LIFETIME,
            )
        return self._pool.submit(step, *arguments)

    def forget(self) -> None:
        if self._pool is not None:
            self._pool.shutdown(wait=False, cancel_futures=True)
            self._pool = None


def _steps(task: Task, out: Path, keep: bool, worker: _Worker, report: Report) -> Iterator[Future]:
    """The steps of a case, each a future of its worker: the first seals, the last opens."""
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


def read_campaign(out: Path) -> Campaign:
    """The campaign stored in a folder. Raises InputError when there is none."""
    about = out / "campaign.json"
    if not about.exists():
        raise InputError(f"{out}: holds no campaign")
    try:
        return Campaign(**json.loads(about.read_text(encoding="utf-8")))
    except (TypeError, ValueError):
        raise InputError(f"{about}: is not the description of a campaign") from None


def begin(out: Path, campaign: Campaign, resume: bool) -> None:
    """Prepare the folder. Raises InputError when it holds another campaign, or this one without `resume`."""
    about = out / "campaign.json"
    if about.exists():
        if not resume:
            raise InputError(
                f"{out}: holds a campaign already; continue it with --resume, or choose another folder"
            )
        if replace(read_campaign(out), cases=campaign.cases) != campaign:
            raise InputError(
                f"{out}: holds the campaign {read_campaign(out).command}; only --cases may change"
            )
    elif out.exists() and any(out.iterdir()):
        raise InputError(f"{out}: is not empty and holds no campaign; choose another folder")
    out.mkdir(parents=True, exist_ok=True)
    write_json(about, asdict(campaign))


def scores_in(out: Path, tasks: Sequence[Task]) -> list[Score]:
    """Scores of the finished cases."""
    paths = [out / CASES / task.name / "score.json" for task in tasks]
    return [read_score(path) for path in paths if path.exists()]


def write_card(out: Path, campaign: Campaign) -> list[Score]:
    """Write the score card of the finished cases, `proof.md` and `proof.json`."""
    tasks = campaign.tasks
    scores = scores_in(out, tasks)
    write_text(out / "proof.md", markdown(scores, campaign.command, len(scores) == len(tasks)))
    write_json(out / "proof.json", {"command": campaign.command, **summary(scores)})
    return scores


def carry_out(
    out: Path, tasks: Sequence[Task], jobs: int, report: Report, keep: bool = False
) -> dict[str, str]:
    """Run the cases that have no score yet, `jobs` at a time, each worker on its own processors.

    Returns failures of the proof itself, by case; failures of a diagnosis are scored.
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
        except Exception:  # the other cases continue, whatever went wrong with this one
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
