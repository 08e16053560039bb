"""The answer to one task: the result of its command, as plain data and as a page."""

import resource
import shlex
import sys
import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from threadpoolctl import threadpool_limits

from rhythmid.batch.manifest import Command, DiagnoseOptions, IdentifyOptions
from rhythmid.batch.task import Task, loaded
from rhythmid.body.machine import Machine
from rhythmid.diagnose.diagnosis import diagnose
from rhythmid.diagnose.joints.joint_diagnosis import diagnose_machine
from rhythmid.elements.catalogue import load_catalogue
from rhythmid.errors import InputError
from rhythmid.identify.identifiability import offset_of
from rhythmid.identify.identify import identify, paper_hopper
from rhythmid.identify.joints.joint_identification import identify_machine
from rhythmid.model import Model
from rhythmid.record.bag_report import BagReport, quality_report
from rhythmid.record.joint_record import JointRecord, JointSignals, load_joint_records
from rhythmid.record.read import load_records
from rhythmid.record.record import Record
from rhythmid.record.same_recording import content_digest
from rhythmid.record.signals import Signals
from rhythmid.record.time_origin import CALENDAR
from rhythmid.report.page import Page, render

# bytes per unit in which the system reports the largest memory of a process
KIBIBYTE = 1 if sys.platform == "darwin" else 1024
LONGEST_REASON = 300  # characters of a reason


@dataclass(frozen=True)
class Value:
    """A number with its standard deviation and unit; None where it is not determined or not estimated."""

    name: str
    value: float | None
    std: float | None
    unit: str


@dataclass(frozen=True)
class Answered:
    """What is kept of one answer.

    Attributes
    ----------
    failure : why there is no answer, in one line; empty if there is one.
    headline : the answer in one sentence.
    verdict : in one word: that of a diagnosis, else "identified", "not identified", "usable".
    missing : effects that a diagnosis names.
    time : when the recording began, in seconds from 1970; None if its clock does not give it.
    seconds : time that the answer took.
    memory : largest memory of its process [bytes].
    values : what was estimated or measured.
    content : digest of the measured samples. Answers with the same digest are those of one recording and its copies.
    result : the content of the command's `--json`.
    page : its report as HTML; not part of the JSON.
    """

    failure: str = ""
    headline: str = ""
    verdict: str = ""
    missing: tuple[str, ...] = ()
    time: float | None = None
    seconds: float = 0.0
    memory: float = 0.0
    values: tuple[Value, ...] = ()
    content: str = ""
    result: Mapping[str, Any] | None = None
    page: str = ""

    def to_dict(self) -> dict[str, Any]:
        """All but the page, as plain JSON data."""
        return {key: value for key, value in asdict(self).items() if key != "page"}

    @classmethod
    def of(cls, content: Mapping[str, Any]) -> "Answered":
        """From what `to_dict` made. Raises KeyError or TypeError for anything else."""
        values = tuple(Value(**one) for one in content["values"])
        return cls(**{**content, "values": values, "missing": tuple(content["missing"])})


def answer(task: Task) -> Answered:
    """The answer to a task, or the reason why there is none."""
    began = time.perf_counter()
    try:
        with threadpool_limits(1):  # one answer per processor at a time
            found = COMMANDS[task.command](task)
    except InputError as error:
        found = failed(str(error))
    except Exception as error:  # a failure of one recording must not affect the other answers
        found = failed(f"{type(error).__name__}: {error}")
    memory = KIBIBYTE * float(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
    return replace(found, seconds=time.perf_counter() - began, memory=memory)


def failed(reason: str) -> Answered:
    """No answer, and why, in one line."""
    line = " ".join(reason.split())
    return Answered(
        line if len(line) <= LONGEST_REASON else line[: LONGEST_REASON - 1] + "…", verdict="failed"
    )


def command_line(task: Task) -> str:
    """The single command that gives the same answer."""
    words = ["rhythmid", task.command, *map(str, task.sources)]
    words += [] if task.signals is None else ["--signals", str(task.signals)]
    words += [] if task.model is None else ["--model", str(task.model)]
    words += [word for folder in task.elements for word in ("--elements", str(folder))]
    words += [word for path in task.holdout for word in ("--holdout", str(path))]
    if isinstance(task.options, DiagnoseOptions) and task.options.budget is not None:
        words += ["--budget", f"{task.options.budget:g}"]
    if isinstance(task.options, IdentifyOptions):
        for name, value in asdict(task.options).items():
            if value != getattr(IdentifyOptions(), name):
                words += [
                    f"--{name.replace('_', '-')}",
                    *map(str, value if isinstance(value, tuple) else [value]),
                ]
    return shlex.join(words)


def _signals(task: Task) -> Signals | None:
    if task.signals is None:
        return None
    return (
        Signals.load(task.signals)
        if task.joint is None
        else JointSignals.load(task.signals).joints[task.joint]
    )


def _records(task: Task) -> tuple[list[Record], list[Record]]:
    """Records for the fit, and held-out records."""
    signals = _signals(task)
    return load_records(task.sources, signals), load_records(task.holdout, signals)


def _joint_records(task: Task) -> tuple[list[JointRecord], list[JointRecord]]:
    assert task.signals is not None  # otherwise the manifest was refused
    signals = JointSignals.load(task.signals)
    return load_joint_records(task.sources, signals), load_joint_records(task.holdout, signals)


def _model(task: Task) -> Model | Machine:
    catalogue = load_catalogue(task.elements)
    return paper_hopper() if task.model is None else loaded(task.model, task.machine, catalogue)


def _began(records: Iterable[Record]) -> float | None:
    """When the first of the records began [s from 1970]."""
    began = min((record.start_ns * 1e-9 for record in records), default=0.0)
    return began if began > CALENDAR else None


def _values(estimates: Mapping[str, Any]) -> tuple[Value, ...]:
    return tuple(Value(name, one.value, one.std, one.unit) for name, one in estimates.items())


def _identified(task: Task) -> Answered:
    from rhythmid.identify.present import present

    model = _model(task)
    if isinstance(model, Machine):
        return _identified_machine(task, model)
    options = task.options
    assert isinstance(options, IdentifyOptions)
    records, _ = _records(task)
    offset = offset_of(options.clock_offset, options.clock_offset_std)
    forcing = options.forcing if offset is None else "clock_unknown"
    found = identify(records, model, method=options.method, forcing=forcing, offset=offset, htf=options.htf)
    return Answered(
        headline=found.headline,
        verdict="identified" if found.usable else "not identified",
        time=_began(records),
        content=content_digest(records),
        values=_values(found.estimates),
        result=found.to_dict(),
        page=render(present(found, command_line(task), _name(task))),
    )


def _identified_machine(task: Task, machine: Machine) -> Answered:
    records, _ = _joint_records(task)
    found = identify_machine(records, machine)
    headline = f"{len(found.parameters)} parameters identified" if found.usable else found.headline
    return Answered(
        headline=headline,
        verdict="identified" if found.usable else "not identified",
        time=_began(one for record in records for one in record.joints.values()),
        content=content_digest(records),
        values=_values(found.parameters),
        result=found.to_dict(),
        page=render(_plain(task, headline, _values(found.parameters), found.notes, found.machine.to_yaml())),
    )


def _diagnosed(task: Task) -> Answered:
    from rhythmid.diagnose.answer.present import present

    options, catalogue, model = task.options, load_catalogue(task.elements), _model(task)
    assert isinstance(options, DiagnoseOptions)
    if isinstance(model, Machine):
        return _diagnosed_machine(task, model)
    records, unseen = _records(task)
    found = diagnose(records, model, unseen, catalogue, budget=options.budget)
    diagnosis = found.diagnosis
    return Answered(
        headline=found.headline,
        verdict=diagnosis.verdict,
        missing=tuple(sorted(one.element for one in diagnosis.missing)) if found.stands else (),
        time=_began(records),
        content=content_digest(records),
        values=_values(diagnosis.parameters),
        result=found.to_dict(),
        page=render(present(found, model, records, unseen, command_line(task), _name(task))),
    )


def _diagnosed_machine(task: Task, machine: Machine) -> Answered:
    assert isinstance(task.options, DiagnoseOptions)
    records, unseen = _joint_records(task)
    answer = diagnose_machine(
        records, machine, unseen, load_catalogue(task.elements), budget=task.options.budget
    )
    found = answer.diagnosis
    values, notes = _values(found.parameters), (*found.assumptions, *found.notes)
    return Answered(
        headline=found.summary,
        verdict=found.verdict,
        missing=tuple(sorted(f"{one.place}: {one.element}" for one in found.missing)),
        time=_began(one for record in records for one in record.joints.values()),
        content=content_digest(records),
        values=values,
        result=found.to_dict(),
        page=render(_plain(task, found.summary, values, notes, answer.machine.to_yaml())),
    )


def _checked(task: Task) -> Answered:
    reports = [quality_report(path, _signals(task)) for path in task.sources]
    problems = [problem for report in reports for problem in report.problems]
    if problems:
        raise InputError("; ".join(problems))
    lines = tuple(line.strip() for report in reports for line in report.lines())
    remarks = sum(len(one.complaints()) for report in reports for one in report.channels.values())
    notes = sum(len(report.notes) for report in reports)
    headline = f"usable, {remarks} remarks on its channels, {notes} notes"
    return Answered(
        headline=headline,
        verdict="usable",
        values=tuple(value for report in reports for value in _measures(report)),
        content=content_digest([report.record for report in reports if report.record is not None]),
        result={"records": [report.to_dict() for report in reports]},
        page=render(_plain(task, headline, (), lines, None)),
    )


def _measures(report: BagReport) -> Iterable[Value]:
    """What `check` measures of a recording: numbers without standard deviations."""
    yield Value("duration", report.duration, None, "s")
    for role, channel in report.channels.items():
        timing = channel.timing
        yield Value(f"{role}.rate", timing.rate, None, "Hz")
        yield Value(f"{role}.jitter_std", timing.jitter_std, None, "s")
        yield Value(f"{role}.gaps", float(timing.gaps), None, "1")
        yield Value(f"{role}.lost", float(timing.lost), None, "1")
        yield Value(f"{role}.clipped", float(channel.clipped), None, "1")


def _plain(
    task: Task, headline: str, values: tuple[Value, ...], lines: Iterable[str], model: str | None
) -> Page:
    """A page for commands that have none of their own."""
    from rhythmid.report.blocks import Bullets, Section, Tiles
    from rhythmid.report.sections import parameters_table, reproduce_section

    estimates = {one.name: {"value": one.value, "std": one.std, "unit": one.unit} for one in values}
    sections = [Section("Parameters", (parameters_table(estimates),))] if values else []
    notes = tuple(lines)
    sections += [Section("What was found" if not values else "Notes", (Bullets(notes),))] if notes else []
    sections.append(reproduce_section(command_line(task), {} if model is None else {"Model": model}))
    title = f"{task.command.capitalize()}: {task.name}"
    return Page(
        title, f"{task.command} of {task.bag}", task.name, headline, "plain", Tiles(()), tuple(sections)
    )


def _name(task: Task) -> str:
    return "the paper's hopper" if task.model is None else Path(task.model).name


COMMANDS: Mapping[Command, Callable[[Task], Answered]] = {
    "check": _checked,
    "diagnose": _diagnosed,
    "identify": _identified,
}
