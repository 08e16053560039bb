"""The truth of a case, sealed in a file before the diagnosis: only its hash is published."""

import hashlib
import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

from rhythmid.errors import InputError
from rhythmid.output import write_json
from rhythmid.proof.draw import Case


def truth_of(case: Case, floors: dict[int, float]) -> dict[str, Any]:
    """All data of a case as plain data.

    `floors` is the relative noise of the held-out records, by block length; `parameters` are the true values of the nominal
    model's parameters.
    """
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
    """The truth. Raises InputError when its hash is not the published one."""
    if digest(path) != told:
        raise InputError(f"{path}: the seal is broken, its hash is not the one written before the diagnosis")
    return json.loads(path.read_text(encoding="utf-8"))
