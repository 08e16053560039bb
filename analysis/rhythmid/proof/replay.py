"""Score stored answers again against the opened seals, without drawing or simulating.

Where an answer contains its evidence, the verdict is derived from it again. A change of the verdict's rules can so be measured on
every case that was ever run.
"""

import json
from collections.abc import Sequence
from pathlib import Path

from rhythmid.diagnose.replay import redecide
from rhythmid.elements.catalogue import load_catalogue
from rhythmid.errors import InputError
from rhythmid.output import write_json, write_text
from rhythmid.proof.campaign import CASES, SEALED, Campaign, Task
from rhythmid.proof.card import markdown, summary
from rhythmid.proof.score import Score, score
from rhythmid.proof.seal import unseal

EVIDENCE = "evidence"


def told_hashes(out: Path) -> dict[str, str]:
    """Hashes of the truths by case, as reported before the diagnosis; the last one counts."""
    path = out / "seals.txt"
    if not path.exists():
        return {}
    lines = [line.split() for line in path.read_text(encoding="utf-8").splitlines()]
    return {case: told for _, told, case in lines}


def replayed(out: Path, tasks: Sequence[Task]) -> tuple[list[Score], int]:
    """Scores of the stored answers of these cases, and the number of verdicts that were derived again.

    Raises InputError where no answer was stored.
    """
    told, catalogue = told_hashes(out), load_catalogue()
    scores: list[Score] = []
    anew = 0
    for task in tasks:
        path = out / CASES / task.name / "answer.json"
        if not path.exists() or task.name not in told:
            continue
        truth = unseal(out / SEALED / f"{task.name}.json", told[task.name])
        answer = json.loads(path.read_text(encoding="utf-8"))
        anew += EVIDENCE in answer
        scores.append(score(truth, redecide(answer), catalogue))
    if not scores:
        raise InputError(f"{out}: holds no answer yet; nothing can be replayed")
    return scores, anew


def replay_campaign(out: Path, campaign: Campaign, tasks: Sequence[Task]) -> tuple[list[Score], int]:
    """Score the stored answers of these cases, and write `replay.md` and `replay.json` beside the campaign's own card.

    Returns and raises what `replayed` does.
    """
    scores, anew = replayed(out, tasks)
    write_text(out / "replay.md", markdown(scores, f"{campaign.command} --replay", len(scores) == len(tasks)))
    write_json(out / "replay.json", {"command": f"{campaign.command} --replay", **summary(scores)})
    return scores, anew
