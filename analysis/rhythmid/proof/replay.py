"""Answers that were kept, held against the opened seals once more: nothing is drawn and nothing simulated.

Where an answer holds the evidence that it was reached by, the verdict is reached anew from it, so that a change of the
verdict's rules is measured on every case that was ever done.
"""

import importlib
import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from rhythmid.elements.catalogue import load_catalogue
from rhythmid.errors import InputError
from rhythmid.output import write_json, write_text
from rhythmid.proof.campaign import CASES, SEALED, Campaign, Task
from rhythmid.proof.card import markdown, summary
from rhythmid.proof.score import Score, score
from rhythmid.proof.seal import unseal

EVIDENCE = "evidence"
REDECIDES = "rhythmid.diagnose.replay"
Redecide = Callable[[dict[str, Any]], dict[str, Any]]


def redecider() -> Redecide | None:
    """What reaches a verdict anew from an answer's evidence; None where the diagnosis offers nothing of the kind."""
    try:
        return importlib.import_module(REDECIDES).redecide
    except ModuleNotFoundError as error:
        if error.name != REDECIDES:
            raise
        return None


def told_hashes(out: Path) -> dict[str, str]:
    """Hashes of the truths by case, as they were told before the diagnosis; the last one counts."""
    path = out / "seals.txt"
    if not path.exists():
        return {}
    lines = [line.split() for line in path.read_text(encoding="utf-8").splitlines()]
    return {case: told for _, told, case in lines}


def replay(answer: dict[str, Any], redecide: Redecide | None) -> dict[str, Any]:
    """The answer that the evidence leads to now; the same one where it holds no evidence."""
    if redecide is None or EVIDENCE not in answer:
        return answer
    kept = {name: answer[name] for name in ("seconds", "processor_seconds", "block") if name in answer}
    return redecide(answer) | kept


def replay_campaign(out: Path, campaign: Campaign, tasks: Sequence[Task]) -> tuple[list[Score], int]:
    """Score the kept answers of these cases, and write `replay.md` and `replay.json` beside the campaign's own card.

    Returns the scores and how many verdicts were reached anew. Raises InputError where no answer was kept.
    """
    told, redecide, catalogue = told_hashes(out), redecider(), load_catalogue()
    scores: list[Score] = []
    anew = 0
    for task in tasks:
        path = out / CASES / task.name / "answer.json"
        if not path.exists() or task.name not in told:
            continue
        truth = unseal(out / SEALED / f"{task.name}.json", told[task.name])
        answer = json.loads(path.read_text(encoding="utf-8"))
        anew += redecide is not None and EVIDENCE in answer
        scores.append(score(truth, replay(answer, redecide), catalogue))
    if not scores:
        raise InputError(f"{out}: holds no answer yet; nothing can be replayed")
    write_text(out / "replay.md", markdown(scores, f"{campaign.command} --replay", len(scores) == len(tasks)))
    write_json(out / "replay.json", {"command": f"{campaign.command} --replay", **summary(scores)})
    return scores, anew
