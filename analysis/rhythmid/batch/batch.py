"""Many recordings analysed; their answers are stored, compared and shown together."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rhythmid.batch.agreement import LEVEL, Agreement, agreements, copies
from rhythmid.batch.answered import Answered
from rhythmid.batch.kept import Kept, brief
from rhythmid.batch.manifest import Manifest
from rhythmid.batch.task import Task, tasks_of
from rhythmid.batch.workers import by_cluster, by_processes
from rhythmid.errors import InputError
from rhythmid.progress import Tell, counted, silent
from rhythmid.report.quantity import pretty_name
from rhythmid.result import Result, Row, axis_or_new
from rhythmid.statistics import NORMAL_95

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from rich.console import Console

MOST_NAMED = 4  # parameters in a headline


@dataclass(frozen=True)
class Batch(Result):
    """The answers to a manifest.

    Attributes
    ----------
    answers : every task of the manifest, in its order, with its answer or the reason of its failure.
    agreements : every parameter that several answers estimate, compared.
    folder : folder with the answers, the table and the index page.

    Examples
    --------
    `found.agreements` compares each parameter over the runs, `found.to_dataframe()` holds all values; see `batch`.
    """

    answers: tuple[tuple[Task, Answered], ...]
    agreements: tuple[Agreement, ...]
    folder: Path

    @property
    def failures(self) -> dict[Task, str]:
        """Why there is no answer, by task."""
        return {task: one.failure for task, one in self.answers if one.failure}

    @property
    def copies(self) -> dict[Task, Task]:
        """Answers to copies of a recording, each with the answer that counts in the comparison."""
        return copies(self.answers)

    @property
    def headline(self) -> str:
        """How many recordings were analysed, and which parameters do not agree."""
        count, failed = len(self.answers), len(self.failures)
        answered = f"{count - failed} of {count} answered" if failed else f"{count} answered"
        if twice := len(self.copies):
            answered += f", {twice} of them {'a copy' if twice == 1 else 'copies'} of another recording, which count{'s' * (twice == 1)} once"
        compared = [one for one in self.agreements if one.verdict != "too few runs"]
        if not compared:
            return f"{answered}; no parameter was estimated twice"
        differ = [one for one in compared if one.different]
        if not differ:
            return f"{answered}; all {len(compared)} parameters agree"
        said = list(dict.fromkeys(f"{pretty_name(one.name)} ({', '.join(one.different)})" for one in differ))
        more = [f"{len(said) - MOST_NAMED} more"] if len(said) > MOST_NAMED else []
        named = "; ".join([*said[:MOST_NAMED], *more])
        return f"{answered}; {len(differ)} of {len(compared)} parameters differ: {named}"

    def tables(self) -> Mapping[str, Sequence[Row]]:
        """`values`, a row for each number of each answer and one for each failure; `agreement`; `answers`."""
        twice = self.copies
        return {
            "values": [row for task, one in self.answers for row in _value_rows(task, one)],
            "agreement": [_agreement_row(one) for one in self.agreements],
            "answers": [
                {**_answer_row(task, one), "copy_of": twice[task].name if task in twice else ""}
                for task, one in self.answers
            ],
        }

    def to_dict(self) -> dict[str, Any]:
        """The content of `batch --json`: the tables, and the level of the tests."""
        return {
            "headline": self.headline,
            "level": LEVEL,
            **{name: list(rows) for name, rows in self.tables().items()},
        }

    def show(self, console: "Console") -> None:
        """Print what agrees and what does not, and what failed."""
        from rhythmid.batch.printed import show

        show(self, console)

    def plot(self, axis: "Axes | None" = None, parameter: str | None = None) -> "Axes":
        """Draw one parameter over the runs with 95 % intervals, each rig in a colour.

        Parameters
        ----------
        axis : Matplotlib axis; if None, an axis of a new figure.
        parameter : its name, "element.parameter"; if None, the first one that was compared.

        Raises
        ------
        InputError
            If no answer estimates it.
        """
        known = [one for one in self.agreements if one.runs and parameter in (None, one.name)]
        if not known:
            raise InputError(f"no answer estimates {parameter or 'a parameter'}")
        axis, one = axis_or_new(axis), known[0]
        for group in one.groups:
            shown = [(place, run) for place, run in enumerate(one.runs, start=1) if run.task.group == group]
            values, halves = [run.value for _, run in shown], [NORMAL_95 * run.std for _, run in shown]
            axis.errorbar([place for place, _ in shown], values, halves, fmt="o", label=group or None)
        axis.set(xlabel="run", ylabel=f"{pretty_name(one.name)} [{one.unit}]")
        if any(one.groups):
            # above the axis: inside, it would hide error bars
            axis.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=len(one.groups), frameon=False)
        return axis


def batch(
    manifest: Manifest | Mapping[str, Any] | str | Path,
    out: str | Path | None = None,
    jobs: int | None = None,
    scheduler: str | None = None,
    tell: Tell = silent,
    command: str = "",
) -> Batch:
    """Analyse every recording of a manifest, and compare the answers.

    Answers that are stored in `out` are not computed again, unless the recording, model, signals or options have changed.

    Parameters
    ----------
    manifest : a manifest file, or its content as a mapping with paths relative to the working directory.
    out : folder for answers, `table.csv`, `table.parquet` (with pyarrow) and `index.html`; NAME_batch if not given.
    jobs : number of parallel processes; by default the number of processors.
    scheduler : address of a Dask scheduler whose workers do the work instead; they must see the same paths.
    tell : function that is called with the progress.
    command : the command line, for the index page.

    Returns
    -------
    Batch
        With the reason in the place of the answer if a recording could not be analysed.

    Raises
    ------
    InputError
        For an error in the manifest, a model or a signals file, and for an `out` that holds something else.

    Examples
    --------
    >>> import tempfile, numpy as np, rhythmid as rh
    >>> folder, t = tempfile.mkdtemp(), np.arange(0.0, 2.0, 0.01)
    >>> for run in ("a", "b"):
    ...     swing = np.column_stack([t, 0.3 * np.cos(5 * t + ord(run))])
    ...     np.savetxt(f"{folder}/{run}.csv", swing, delimiter=",", header="t,angle", comments="")
    >>> _ = open(f"{folder}/signals.yaml", "w").write("time: {column: t}\\noutput: {column: angle, unit: rad}\\n")
    >>> made = rh.batch({"command": "check", "signals": f"{folder}/signals.yaml", "entries": [{"bags": f"{folder}/*.csv"}]}, f"{folder}/out")
    >>> made.headline
    '2 answered; no parameter was estimated twice'
    """
    if jobs is not None and jobs < 1:
        raise InputError(f"--jobs {jobs}: a whole number greater than 0 is expected")
    if jobs is not None and scheduler is not None:
        raise InputError("--jobs is for this machine, --scheduler for a cluster: give one of them")
    if isinstance(manifest, Mapping):
        manifest = Manifest.of(manifest)
    elif not isinstance(manifest, Manifest):
        manifest = Manifest.load(manifest)
    kept = Kept(Path(f"{manifest.name}_batch") if out is None else Path(out))
    tell("looking at the recordings")
    tasks = tasks_of(manifest)
    answers = {task: one for task in tasks if (one := kept.get(task)) is not None}
    if answers:
        tell(f"{len(answers)} of {len(tasks)} answers are kept already")
    waiting = [task for task in tasks if task not in answers]
    kept.begin()
    work = by_processes(waiting, jobs) if scheduler is None else by_cluster(waiting, scheduler)
    for task, answered in counted(work if waiting else (), len(waiting), "answers", tell):
        kept.put(task, answered)
        answers[task] = brief(answered)
        if answered.failure:
            tell(f"{task.name}: {answered.failure}")
    ordered = tuple((task, answers[task]) for task in tasks)
    found = Batch(ordered, agreements(ordered), kept.folder)
    _write(found, kept, command)
    return found


def _write(found: Batch, kept: Kept, command: str) -> None:
    from rhythmid.batch.present import present
    from rhythmid.batch.table import write_csv, write_parquet
    from rhythmid.report.page import write_page

    rows = found.tables()["values"]
    write_csv(found.folder / "table.csv", rows)
    write_parquet(found.folder / "table.parquet", rows)
    write_page(found.folder / "index.html", present(found, kept.page, command))


def _where(task: Task, one: Answered) -> dict[str, Any]:
    model, signals = task.labels
    time = None if one.time is None else datetime.fromtimestamp(one.time, UTC).isoformat()
    return {
        "bag": task.bag, "group": task.group, "command": task.command, "model": model, "signals": signals,
        "joint": task.joint or "", "time": time, "verdict": one.verdict, "failure": one.failure,
    }  # fmt: skip


def _value_rows(task: Task, one: Answered) -> list[Row]:
    where = _where(task, one)
    nothing = {"name": None, "value": None, "std": None, "unit": None}
    return [where | asdict(value) for value in one.values] or [where | nothing]


def _answer_row(task: Task, one: Answered) -> Row:
    missing = " + ".join(one.missing)
    more = {"missing": missing, "headline": one.headline, "seconds": one.seconds, "memory": one.memory}
    return _where(task, one) | more


def _agreement_row(one: Agreement) -> Row:
    slope = one.slope
    return {
        "subject": one.subject, "name": one.name, "runs": len(one.runs), "left_out": one.left_out,
        "groups": len(one.groups), "value": one.mean, "std": one.std, "unit": one.unit, "between": one.between,
        "birge": one.birge, "runs_p": one.runs_p, "groups_p": one.groups_p,
        "slope": None if slope is None else slope.value, "slope_std": None if slope is None else slope.std,
        "slope_per": one.per, "trend_p": None if slope is None else slope.p_value,
        "verdict": one.verdict, "different": ", ".join(one.different),
    }  # fmt: skip
