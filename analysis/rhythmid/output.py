"""Results as files: written whole or not at all, and never over something that exists."""

import json
import math
import os
from pathlib import Path
from typing import Any

from rhythmid.errors import InputError


def require_new(path: Path | None) -> None:
    """Refuse, before any work, a result that would overwrite something or cannot be written."""
    if path is None:
        return
    if path.exists():
        raise InputError(f"{path}: exists already; name another file or remove it")
    folder = path.absolute().parent
    if not folder.is_dir():
        raise InputError(f"{path}: the folder {folder} does not exist")
    if not os.access(folder, os.W_OK):
        raise InputError(f"{path}: the folder {folder} is not writable")


def write_text(path: Path, text: str) -> None:
    """Write a result file whole or not at all."""
    partial = path.with_name(f".{path.name}.partial")
    try:
        partial.write_text(text, encoding="utf-8")
        os.replace(partial, path)
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {error.strerror}") from None


def write_json(path: Path, content: Any) -> None:
    """Write a JSON result; numbers that are not finite become null."""
    write_text(path, json.dumps(_finite(content), indent=2, allow_nan=False) + "\n")


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(key): _finite(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(item) for item in value]
    if hasattr(value, "tolist"):
        return _finite(value.tolist())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
