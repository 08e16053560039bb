"""Diagnosis of a case that uses only the records and the nominal model in its folder."""

import resource
import time
import traceback
from pathlib import Path
from typing import Any

from rhythmid.diagnose.diagnosis import diagnose
from rhythmid.elements.catalogue import Catalogue
from rhythmid.errors import InputError
from rhythmid.model import Model
from rhythmid.proof.perform import JUDGE, LEARN, NOMINAL
from rhythmid.record.read import load_records


def _processor_time() -> float:
    """Processor time [s] of this process and its finished children."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(one.ru_utime + one.ru_stime for one in used)


def _records(folder: Path) -> list[Path]:
    """Bags, and signals files of tables."""
    return sorted(path for path in folder.iterdir() if path.is_dir() or path.suffix == ".yaml")


def examine(folder: Path, catalogue: Catalogue, budget: float | None = None) -> dict[str, Any]:
    """The diagnosis as plain data, within a `budget` [s] if one is given.

    Added are `seconds`, `processor_seconds`, `phases` (seconds since the start, step that began) and the length of the held-out
    records' block averages. A failure is an answer, too: `failure` holds its message.
    """
    began, used = time.monotonic(), _processor_time()
    phases: list[tuple[float, str]] = []

    def tell(what: str) -> None:
        phases.append((round(time.monotonic() - began, 2), what))

    answer: dict[str, Any] = {}
    try:
        tell("reading the records")
        nominal = Model.of_one_axis(folder / NOMINAL, catalogue)
        learn = load_records(_records(folder / LEARN))
        judge = load_records(_records(folder / JUDGE))
        found = diagnose(learn, nominal, judge, catalogue, tell, budget)
        answer = found.diagnosis.to_dict() | {"block": found.block, "evidence": found.ledger()}
    except InputError as error:
        answer = {"failure": f"refused: {error}"}
    except Exception:  # a fault in the diagnosis counts as a wrong answer
        answer = {"failure": traceback.format_exc()}
    spent = {"seconds": time.monotonic() - began, "processor_seconds": _processor_time() - used}
    return answer | spent | {"phases": phases}
