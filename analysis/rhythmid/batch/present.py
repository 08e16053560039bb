"""From a batch to its index page: what agrees and what does not, over the runs, and every answer with a link to its report."""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

from rhythmid.batch.agreement import LEVEL, RUN, Agreement
from rhythmid.batch.answered import Answered
from rhythmid.batch.task import Task
from rhythmid.batch.wording import p_value, trend_words
from rhythmid.report.blocks import (
    Block,
    Columns,
    Drawing,
    Fold,
    Heading,
    Paragraph,
    Section,
    Table,
    Tile,
    Tiles,
)
from rhythmid.report.page import Page, Tone
from rhythmid.report.quantity import NONE, estimate, number, pretty_name, pretty_unit, scaled, with_unit
from rhythmid.report.run_chart import Point, draw_runs, style
from rhythmid.report.sections import reproduce_section
from rhythmid.statistics import NORMAL_95

if TYPE_CHECKING:
    from rhythmid.batch.batch import Batch

Link = Callable[[Task], str]
MEBIBYTE = 2.0**20
NO_GROUP = "all runs"
MOST_OPEN = 30  # up to so many answers their lists are shown open


def present(found: "Batch", link: Link, command: str = "") -> Page:
    """The index page of a batch; `link` gives the link to the page of a task's answer."""
    answered = [pair for pair in found.answers if not pair[1].failure]
    sections = [
        *_failed(found.failures),
        *_copied(found.copies),
        *_agreement(found.agreements),
        *_over_runs(found.agreements, link),
        *_verdicts(answered),
        _answers(answered, link),
        reproduce_section(command, {}),
    ]
    verdict, words, tone = _verdict(found)
    return Page(
        title=f"Batch: {found.folder.name}",
        kicker=f"Batch of {len(found.answers)} answers in {found.folder.name}",
        verdict=verdict,
        words=words,
        tone=tone,
        tiles=_tiles(found),
        sections=tuple(sections),
    )


def _verdict(found: "Batch") -> tuple[str, str, Tone]:
    differ = [one for one in found.agreements if one.different]
    words = f"{found.headline}."
    if found.failures:
        return (
            f"{len(found.failures)} of {len(found.answers)} recordings could not be answered",
            words,
            "open",
        )
    if differ:
        return "Not all parameters agree", words, "found"
    if any(one.verdict == "agrees" for one in found.agreements):
        return "All parameters agree", words, "good"
    return "Every recording is answered", words, "plain"


def _tiles(found: "Batch") -> Tiles:
    groups = [group for group in dict.fromkeys(task.group for task, _ in found.answers) if group]
    seconds = [one.seconds for _, one in found.answers if not one.failure]
    compared = [one for one in found.agreements if one.verdict != "too few runs"]
    tiles = [
        Tile(
            "answers", str(len(seconds)), f"{len(found.failures)} failed" if found.failures else "none failed"
        ),
        Tile("parameters that differ", f"{sum(bool(one.different) for one in compared)} of {len(compared)}"),
    ]
    if groups:
        tiles.append(
            Tile("rigs", str(len(groups)), ", ".join(groups[:6]) + (", …" if len(groups) > 6 else ""))
        )
    if seconds:
        tiles.append(
            Tile("time of an answer", with_unit(number(sum(seconds) / len(seconds), 2), "s"), "mean")
        )
    return Tiles(tuple(tiles))


def _failed(failures: Mapping[Task, str]) -> list[Section]:
    if not failures:
        return []
    rows = tuple((task.name, reason) for task, reason in failures.items())
    said = "They are tried again when the same command is run again; all others are kept."
    return [
        Section(
            "Not answered", (Paragraph(said), Table("Each with its reason.", ("recording", "reason"), rows))
        )
    ]


def _copied(copies: Mapping[Task, Task]) -> list[Section]:
    if not copies:
        return []
    rows = tuple((task.name, original.name) for task, original in copies.items())
    said = "They hold the same samples as another recording, so only that one is compared."
    return [
        Section(
            "Copies",
            (Paragraph(said), Table("Each with the one that counts.", ("recording", "is a copy of"), rows)),
        )
    ]


def _agreement(found: Sequence[Agreement]) -> list[Section]:
    if not found:
        return []
    lead = (
        f"A shaded row is a parameter that differs. If the runs differ only by the stated noise, the chance of any shaded row on this page is at most {100 * LEVEL:g} %. "
        "Run to run: the ratio is the scatter of each rig's runs, divided by the scatter that their intervals state. If it is significantly above 1, the intervals are too small or the machine changes. "
        "Rig to rig: do the rigs differ by more than their runs do? Trend: does the parameter change with time within each rig?"
    )
    blocks: list[Block] = [Paragraph(lead)]
    for subject, own in _by_subject(found).items():
        blocks.append(_agreement_table(subject, own))
    return [Section("Which parameters agree", tuple(blocks))]


def _by_subject(found: Sequence[Agreement]) -> dict[str, list[Agreement]]:
    return {
        subject: [one for one in found if one.subject == subject]
        for subject in dict.fromkeys(one.subject for one in found)
    }


def _agreement_table(subject: str, found: Sequence[Agreement]) -> Table:
    columns = (
        "parameter",
        "runs",
        "mean",
        "scatter beyond the intervals",
        "run to run",
        "rig to rig",
        "trend",
        "verdict",
    )
    marked = tuple(number for number, one in enumerate(found) if one.different)
    caption = f"{subject}: mean over the runs with its 95 % interval, and p-values."
    return Table(caption, columns, tuple(_agreement_row(one) for one in found), marked)


def _agreement_row(one: Agreement) -> tuple[str, ...]:
    runs = f"{len(one.runs)}" + (f" ({one.left_out} more not determined)" if one.left_out else "")
    if one.mean is None or one.std is None:
        return pretty_name(one.name), runs, NONE, NONE, NONE, NONE, NONE, "not determined"
    factor, unit = scaled(max(abs(one.mean), NORMAL_95 * one.std), one.unit)
    between = NONE if not one.between else with_unit(number(factor * one.between, 2), unit)
    repeated = NONE if one.birge is None else f"p\u00a0{p_value(one.runs_p)}, ratio {number(one.birge, 2)}"
    said = f"differs: {', '.join(one.different)}" if one.different else one.verdict
    return (
        pretty_name(one.name), runs, estimate(one.mean, one.std, unit, factor), between, repeated,
        NONE if one.groups_p is None else f"p\u00a0{p_value(one.groups_p)}", trend_words(one), said,
    )  # fmt: skip


def _over_runs(found: Sequence[Agreement], link: Link) -> list[Section]:
    shown = [one for one in found if len(one.runs) > 1]
    if not shown:
        return []
    blocks: list[Block] = []
    subjects = _by_subject(shown)
    for subject, own in subjects.items():
        blocks += [Heading(subject)] if len(subjects) > 1 else []
        blocks.append(Columns(tuple(block for one in own for block in [_drawn(one)])))
        blocks += [_listed(one, link) for one in own]
    return [Section("Over the runs", tuple(blocks))]


def _drawn(one: Agreement) -> Drawing:
    assert one.mean is not None
    factor, unit = scaled(max(abs(run.value) for run in one.runs), one.unit)
    times = [run.time for run in one.runs]
    known = [time for time in times if time is not None]
    if one.per != RUN:
        size = {"day": 86400.0, "h": 3600.0, "min": 60.0, "s": 1.0}[one.per]
        places, label = (
            [(time - min(known)) / size for time in known],
            f"time since the first run [{one.per}]",
        )
    else:
        places, label = [float(place) for place in range(1, len(times) + 1)], "run"
    points = [
        Point(
            place, factor * run.value, factor * NORMAL_95 * run.std, run.task.group or NO_GROUP,
            f"{run.task.name}: {estimate(run.value, run.std, unit, factor)}",
        )
        for place, run in zip(places, one.runs)
    ]  # fmt: skip
    name = pretty_name(one.name)
    alt = f"{name} of {len(points)} runs with 95 % intervals; {_agreement_row(one)[-1]}"
    svg = draw_runs(alt, label, pretty_unit(unit) or "1", points, factor * one.mean)
    groups = list(dict.fromkeys(point.group for point in points))
    legend = tuple((style(number), group) for number, group in enumerate(groups)) if len(groups) > 1 else ()
    caption = f"95 % intervals of each run; dotted: the mean, {_agreement_row(one)[2]}."
    return Drawing(name, svg, caption, legend)


def _listed(one: Agreement, link: Link) -> Fold:
    """Every run's estimate, with how far it is from the mean."""
    assert one.mean is not None
    factor, unit = scaled(max(abs(run.value) for run in one.runs), one.unit)
    rows = tuple(
        (
            run.task.name, run.task.group or NONE, estimate(run.value, run.std, unit, factor),
            number((run.value - one.mean) / run.std, 2),
        )
        for run in one.runs
    )  # fmt: skip
    columns = ("recording", "rig", "value", "from the mean, in standard deviations")
    table = Table("Each leads to its report.", columns, rows, links=tuple(link(run.task) for run in one.runs))
    return Fold(f"{pretty_name(one.name)}: {len(rows)} runs", (table,))


def _verdicts(answered: Sequence[tuple[Task, Answered]]) -> list[Section]:
    """Verdicts and names of the diagnoses, counted for each rig."""
    diagnosed = [(task, one) for task, one in answered if task.command == "diagnose"]
    if not diagnosed:
        return []
    groups = list(dict.fromkeys(task.group or NO_GROUP for task, _ in diagnosed))
    said = Counter((_said(one), task.group or NO_GROUP) for task, one in diagnosed)
    totals = Counter(task.group or NO_GROUP for task, _ in diagnosed)
    rows = tuple(
        (words, *(f"{said[words, group]} of {totals[group]}" for group in groups))
        for words, _ in Counter(_said(one) for _, one in diagnosed).most_common()
    )
    return [Section("What the diagnoses say", (Table("Answers of each rig.", ("verdict", *groups), rows),))]


def _said(one: Answered) -> str:
    effects = ", ".join(map(pretty_name, one.missing))
    return pretty_name(one.verdict) + (f": {effects}" if effects else "")


def _answers(answered: Sequence[tuple[Task, Answered]], link: Link) -> Section:
    """Every answer with a link to its report, folded by rig if there are many."""
    if not answered:
        return Section("All answers", (Paragraph("There is none."),))
    groups = dict.fromkeys(task.group for task, _ in answered)
    folds = []
    for group in groups:
        own = [(task, one) for task, one in answered if task.group == group]
        title = f"{group or NO_GROUP}: {len(own)} answer{'s' * (len(own) != 1)}"
        folds.append(Fold(title, (_answers_table(own, link),), len(answered) <= MOST_OPEN))
    return Section("All answers", tuple(folds))


def _answers_table(answered: Sequence[tuple[Task, Answered]], link: Link) -> Table:
    rows = tuple(
        (
            task.name, task.command, one.headline, with_unit(number(one.seconds, 2), "s"),
            with_unit(number(one.memory / MEBIBYTE, 3), "MiB"),
        )
        for task, one in answered
    )  # fmt: skip
    columns = ("recording", "command", "answer", "time", "memory of its process")
    return Table("Each leads to its report.", columns, rows, links=tuple(link(task) for task, _ in answered))
