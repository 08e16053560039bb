"""Results as files: written completely or not at all, and never over an existing file."""

import json
import math
import os
import sys
import tempfile
from contextlib import suppress
from pathlib import Path
from typing import Any

from rhythmid.errors import InputError

STANDARD_OUTPUT = Path("-")  # the name for standard output instead of a file
PARTIAL = ".{}.partial"  # name of a result while it is written


def require_new(*paths: Path | None) -> None:
    """Refuse, before any work, results that would overwrite existing files or one another, or that cannot be written."""
    given = [path for path in paths if path is not None and path != STANDARD_OUTPUT]
    for number, path in enumerate(given):
        if os.path.lexists(path):
            raise InputError(f"{path}: exists already; name another file or remove it")
        if path.absolute() in [other.absolute() for other in given[:number]]:
            raise InputError(f"{path}: is named for two results; give each a file of its own")
        require_writable(path)


def require_writable(path: Path) -> None:
    """Refuse a result that cannot be written. Missing folders above it will be created."""
    folder = next(parent for parent in path.absolute().parents if os.path.lexists(parent))
    longest = os.pathconf(folder, "PC_NAME_MAX") - len(PARTIAL.format(""))
    if any(len(os.fsencode(part)) > longest for part in path.parts):
        raise InputError(f"{path}: cannot be written: a name in it is longer than {longest} bytes")
    try:  # permissions are not sufficient: a file system may be read-only or full, or may not hold files
        probe, name = tempfile.mkstemp(prefix=".rhythmid.", dir=folder)
        os.close(probe)
        os.unlink(name)
    except OSError as error:
        raise InputError(f"{path}: the folder {folder} cannot be written to: {error.strerror}") from None


def write_text(path: Path, text: str) -> None:
    """Write a result file completely or not at all, and create missing folders above it."""
    partial = path.with_name(PARTIAL.format(path.name))
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        partial.write_text(text, encoding="utf-8")
        os.replace(partial, path)
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {error.strerror}") from None
    finally:
        with suppress(OSError):  # remains after an interruption or on a full disk
            partial.unlink()


def write_json(path: Path, content: Any) -> None:
    """Write a JSON result, to standard output where the path is `-`; numbers that are not finite become null."""
    text = json.dumps(_finite(content), indent=2, allow_nan=False) + "\n"
    if path == STANDARD_OUTPUT:
        sys.stdout.write(text)
    else:
        write_text(path, text)


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
