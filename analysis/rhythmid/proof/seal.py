"""The truth of a case, sealed in a file before the diagnosis: only its hash is told."""

import hashlib
import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

from rhythmid.errors import InputError
from rhythmid.output import write_json
from rhythmid.proof.draw import Case


def truth_of(case: Case, floors: dict[int, float]) -> dict[str, Any]:
    """Everything about a case as plain data; `floors` is the held-out records' noise as nrmse, by block length, and
    `parameters` the true values of the nominal model's."""
    return asdict(case) | {
        "floors": {str(block): floor for block, floor in floors.items()},
        "parameters": case.true_parameters,
    }


def seal(path: Path, truth: dict[str, Any]) -> str:
    """Write the truth and return its SHA-256."""
    path.parent.mkdir(parents=True, exist_ok=True)
    write_json(path, truth)
    return digest(path)


def digest(path: Path) -> str:
    """SHA-256 of a file."""
    return hashlib.sha256(path.read_bytes()).hexdigest()


def unseal(path: Path, told: str) -> dict[str, Any]:
    """The truth. Raises InputError when it is not the one whose hash was told."""
    if digest(path) != told:
        raise InputError(f"{path}: the seal is broken, its hash is not the one written before the diagnosis")
    return json.loads(path.read_text(encoding="utf-8"))
