"""`rhythmid proof`: conceal effects, diagnose, open the seals and count."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from rhythmid.commands.options import Quiet
from rhythmid.commands.terminal import Terminal
from rhythmid.errors import InputError

if TYPE_CHECKING:
    from rich.console import Console

    from rhythmid.proof.campaign import Sealed
    from rhythmid.proof.score import Score

Kinds = Literal["single", "pairs", "null", "left-out", "all"]
Machines = Literal["hopper", "axis", "joint", "pendulum", "shaken", "servo", "decay", "motor", "all"]

EXAMPLES = (
    "rhythmid proof --cases 8 --kind single --out folder",
    "rhythmid proof --out folder --resume",
    "rhythmid proof --pool single --pool null --out card",
)


def proof(
    out: Annotated[Path, typer.Option("--out", help="Folder for seals, answers and the score card.")],
    cases: Annotated[int, typer.Option("--cases", min=1, help="Number of cases.")] = 24,
    seed: Annotated[int, typer.Option("--seed", min=0, help="Seed of all that is drawn.")] = 0,
    kind: Annotated[Kinds, typer.Option("--kind", help="What is concealed.")] = "all",
    machine: Annotated[
        Machines, typer.Option("--machine", help="Which machine; by default all of them in turn.")
    ] = "all",
    cluttered: Annotated[
        bool,
        typer.Option(
            "--cluttered",
            help="Add three small effects beside the main one, and faults of the log: jitter, outliers, rounding.",
        ),
    ] = False,
    budget: Annotated[
        float, typer.Option("--budget", min=0.0, help="Seconds in which each diagnosis is due; 0: no limit.")
    ] = 0.0,
    jobs: Annotated[
        int, typer.Option("--jobs", min=1, help="Cases in parallel; they share the processors evenly.")
    ] = 2,
    resume: Annotated[bool, typer.Option("--resume", help="Continue an interrupted campaign.")] = False,
    again: Annotated[
        bool, typer.Option("--replay", help="Score the answers in --out again, without simulating.")
    ] = False,
    pooled: Annotated[
        list[Path] | None,
        typer.Option(
            "--pool",
            help="Score the answers of this campaign's folder, without simulating; may be repeated for one card of all.",
        ),
    ] = None,
    only: Annotated[list[str] | None, typer.Option("--only", help="Only this case; may be repeated.")] = None,
    keep: Annotated[bool, typer.Option("--keep-bags", help="Keep the records of finished cases.")] = False,
    quiet: Quiet = False,
) -> None:
    """Draw random machines with concealed effects, seal the truth, diagnose their records, open the seals and score the answers."""
    from rich import progress

    from rhythmid.proof.campaign import Campaign, Sealed, Task, begin, carry_out, scores_in, write_card
    from rhythmid.report.terminal_table import print_markdown

    def chosen(campaign: Campaign) -> list[Task]:
        tasks = campaign.tasks
        unknown = sorted(set(only or ()) - {task.name for task in tasks})
        if unknown:
            raise InputError(f"--only {unknown[0]}: is none of the cases {tasks[0].name} … {tasks[-1].name}")
        return [task for task in tasks if not only or task.name in only]

    terminal = Terminal(quiet)
    console = terminal.answer
    if again:
        _replay(out, console, chosen)
        return
    if pooled:
        _pool(out, pooled, console)
        return
    campaign = Campaign(seed, kind, cases, machine, cluttered, budget)
    tasks = chosen(campaign)
    begin(out, campaign, resume)
    columns = [
        progress.TextColumn("{task.description}"), progress.BarColumn(), progress.MofNCompleteColumn(),
        progress.TimeElapsedColumn(), progress.TimeRemainingColumn(),
    ]  # fmt: skip
    with progress.Progress(*columns, console=terminal.progress) as shown:
        bar = shown.add_task("cases", total=len(tasks), completed=len(scores_in(out, tasks)))

        def report(news: "Sealed | Score") -> None:
            if not isinstance(news, Sealed):
                shown.advance(bar)
            shown.console.print(_line(news), highlight=False, soft_wrap=True)

        failures = carry_out(out, tasks, jobs, report, keep)
    write_card(out, campaign)
    print_markdown(console, (out / "proof.md").read_text(encoding="utf-8"))
    for name, failure in failures.items():
        console.print(f"[red]{name} could not be done:[/] {failure}", highlight=False, soft_wrap=True)
    console.print(f"{out / 'proof.md'}, {out / 'proof.json'}")
    if failures:
        raise typer.Exit(1)


def _line(news: "Sealed | Score") -> str:
    """What is told of a case when it is sealed, and when it is scored."""
    from rhythmid.proof.campaign import Sealed

    if isinstance(news, Sealed):
        return f"{news.case}  sealed  {news.sha256}"
    answer = " + ".join(news.named) or news.verdict
    return (
        f"{news.case}  {news.outcome:10s}  {' + '.join(news.true) or 'nothing'}  →  {answer}"
        f"  ({news.faintest:.2f} σ, {news.seconds:.0f} s)"
    )


def _replay(out: Path, console: "Console", chosen) -> None:
    """Score kept answers of the campaign that the folder holds."""
    from rhythmid.proof.campaign import read_campaign
    from rhythmid.proof.replay import replay_campaign
    from rhythmid.report.terminal_table import print_markdown

    campaign = read_campaign(out)
    scores, anew = replay_campaign(out, campaign, chosen(campaign))
    print_markdown(console, (out / "replay.md").read_text(encoding="utf-8"))
    console.print(f"{len(scores)} answers scored, {anew} of them decided anew from their evidence")
    console.print(f"{out / 'replay.md'}, {out / 'replay.json'}")


def _pool(out: Path, folders: list[Path], console: "Console") -> None:
    """Score kept answers of several campaigns together."""
    from rhythmid.proof.pool import pool
    from rhythmid.report.terminal_table import print_markdown

    scores = pool(out, folders)
    print_markdown(console, (out / "proof.md").read_text(encoding="utf-8"))
    console.print(f"{len(scores)} answers of {len(folders)} campaign{'s' if len(folders) > 1 else ''} scored")
    console.print(f"{out / 'proof.md'}, {out / 'proof.json'}, {out / 'reliability.png'}")
