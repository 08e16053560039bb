"""Which parameters agree from run to run and from rig to rig, and which change with time."""

import math
from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from rhythmid.batch.answered import Answered
from rhythmid.batch.scatter import Slope, groups_agree, holm, homogeneous, random_effects, trend
from rhythmid.batch.task import Task
from rhythmid.report.quantity import pretty_name

LEVEL = 0.05  # probability that any parameter of a batch is reported to differ although there is only the stated noise
# of time, the longest that the runs span twice
UNITS = ((86400.0, "day"), (3600.0, "h"), (60.0, "min"), (1.0, "s"))
Verdict = Literal["agrees", "differs", "too few runs"]
RUN = "run"  # unit of time if no clock gives it: the number of the run


@dataclass(frozen=True)
class Run:
    """One estimate of a parameter; `time` in seconds from 1970, None if the clock does not give it."""

    task: Task
    value: float
    std: float
    time: float | None


@dataclass(frozen=True)
class Agreement:
    """One parameter over all runs that estimate it with the same command, model and channels.

    Attributes
    ----------
    subject : command, model, signals and joint, and for diagnoses the effects that are named, in words.
    runs, left_out : estimates that are compared; number of estimates without value or standard deviation.
    groups : rigs among them.
    mean, std, between : random-effects mean, its standard deviation, and the scatter τ beyond the stated standard deviations [unit].
    birge : square root of Cochran's Q per degree of freedom within the rigs: 1 where the stated intervals are right.
    runs_p, groups_p, slope : tests of the runs of each rig against their stated intervals, of the rigs against their runs, and of a trend over
        `per`; None if they cannot be made. If each rig has only one run, `runs_p` is that of all runs.
    different : which of "run to run", "rig to rig" and "trend" are significant, all tests of the batch considered.
    """

    subject: str
    name: str
    unit: str
    runs: tuple[Run, ...]
    left_out: int
    groups: tuple[str, ...]
    mean: float | None = None
    std: float | None = None
    between: float | None = None
    birge: float | None = None
    runs_p: float | None = None
    groups_p: float | None = None
    slope: Slope | None = None
    per: str = RUN
    different: tuple[str, ...] = ()

    @property
    def verdict(self) -> Verdict:
        """In a word."""
        if self.runs_p is None and self.slope is None:
            return "too few runs"
        return "differs" if self.different else "agrees"

    @property
    def tests(self) -> dict[str, float]:
        """p-values by what they test."""
        slope = None if self.slope is None else self.slope.p_value
        made = {"run to run": self.runs_p, "rig to rig": self.groups_p, "trend": slope}
        return {name: p for name, p in made.items() if p is not None}


def agreements(answers: Iterable[tuple[Task, Answered]]) -> tuple[Agreement, ...]:
    """Compare every estimated parameter of the answers. Answers that are not usable and copies of a recording do not count."""
    answers = tuple(answers)
    twice = copies(answers)
    runs: dict[tuple[str, str, str], list[Run]] = defaultdict(list)
    without: dict[tuple[str, str, str], int] = defaultdict(int)
    for task, answered in answers:
        if task.command == "check" or answered.failure or task in twice:
            continue
        for one in answered.values:
            key = (subject(task, answered), one.name, one.unit)
            if one.std == 0.0:  # known beforehand
                continue
            if answered.verdict == "not identified" or not (_finite(one.value) and _finite(one.std)):
                without[key] += 1
            else:
                assert one.value is not None and one.std is not None
                runs[key].append(Run(task, one.value, one.std, answered.time))
    keys = dict.fromkeys([*runs, *without])
    made = [_compared(key, runs[key], without[key]) for key in sorted(keys, key=lambda key: key[0])]
    return _judged(made)


def copies(answers: Iterable[tuple[Task, Answered]]) -> dict[Task, Task]:
    """Answers to copies of a recording, each with the first answer to the same content and question."""
    first: dict[tuple[object, ...], Task] = {}
    found: dict[Task, Task] = {}
    for task, answered in answers:
        if not answered.content or answered.failure:
            continue
        question = (answered.content, task.command, task.labels, task.joint, task.variant)
        original = first.setdefault(question, task)
        if original is not task:
            found[task] = original
    return found


def subject(task: Task, answered: Answered) -> str:
    """Key of the estimates that are compared: those of the same model from the same channels."""
    effects = [f"with {' and '.join(map(pretty_name, answered.missing))}"] if answered.missing else []
    return " · ".join(
        [task.command, *(one for one in (*task.labels, task.joint, task.variant) if one), *effects]
    )


def _finite(value: float | None) -> bool:
    return value is not None and math.isfinite(value)


def _compared(key: tuple[str, str, str], runs: Sequence[Run], without: int) -> Agreement:
    groups = [run.task.group for run in runs]
    found = Agreement(*key, tuple(runs), without, tuple(dict.fromkeys(groups)))
    if not runs:
        return found
    values, stds = np.array([run.value for run in runs]), np.array([run.std for run in runs])
    mean = random_effects(values, stds)
    found = replace(found, mean=mean.value, std=mean.std, between=mean.between)
    if len(runs) < 2:
        return found
    times, per = _times(runs)
    repeated = homogeneous(values, stds, groups) or homogeneous(values, stds, [""] * len(runs))
    assert repeated is not None
    return replace(
        found,
        birge=repeated[0],
        runs_p=repeated[1],
        groups_p=groups_agree(values, stds, groups),
        slope=trend(values, stds, groups, times),
        per=per,
    )


def _times(runs: Sequence[Run]) -> tuple[np.ndarray, str]:
    """Times of the runs and their unit: from the recordings' clocks, or the numbers of the runs if one clock gives no time."""
    known = [run.time for run in runs if run.time is not None]
    if len(known) < len(runs):
        return np.arange(1.0, len(runs) + 1.0), RUN
    since = np.array(known) - min(known)
    size, unit = next((one for one in UNITS if since.max() >= 2.0 * one[0]), UNITS[-1])
    return since / size, unit


def _judged(found: Sequence[Agreement]) -> tuple[Agreement, ...]:
    """The same with the tests that are significant at `LEVEL` among all tests of the batch."""
    tests = [(number, name, p) for number, one in enumerate(found) for name, p in one.tests.items()]
    adjusted = holm([p for *_, p in tests])
    flagged = {(number, name) for (number, name, _), p in zip(tests, adjusted) if p < LEVEL}
    return tuple(
        replace(one, different=tuple(name for name in one.tests if (number, name) in flagged))
        for number, one in enumerate(found)
    )
