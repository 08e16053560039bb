"""One score card and one reliability diagram of several campaigns."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from matplotlib.figure import Figure

from rhythmid.output import write_json, write_text
from rhythmid.proof.campaign import read_campaign
from rhythmid.proof.card import markdown, summary
from rhythmid.proof.reliability import draw_reliability
from rhythmid.proof.replay import replayed
from rhythmid.proof.score import Score
from rhythmid.report.figures import save_figure

SIZE = (4.6, 4.2)  # inches, of the diagram


def pool(out: Path, folders: Sequence[Path]) -> list[Score]:
    """Score the kept answers of several campaigns together, without simulating.

    Writes `proof.md`, `proof.json` and `reliability.png` to `out`. Cases are named after their campaign's folder, because campaigns
    with different seeds have cases of the same name. Raises InputError for a folder without a campaign or without an answer.
    """
    scores, commands = [], []
    for folder in folders:
        campaign = read_campaign(folder)
        found, _ = replayed(folder, campaign.tasks)
        scores += [replace(one, case=f"{folder.name}/{one.case}") for one in found]
        commands.append(f"{campaign.command}: {len(found)} of {campaign.cases}")
    out.mkdir(parents=True, exist_ok=True)
    write_text(out / "proof.md", markdown(scores, "\n    ".join(commands)))
    write_json(out / "proof.json", {"commands": commands, **summary(scores)})
    figure = Figure(figsize=SIZE, layout="constrained")
    draw_reliability(figure.subplots(), scores)
    save_figure(figure, out / "reliability.png")
    return scores
