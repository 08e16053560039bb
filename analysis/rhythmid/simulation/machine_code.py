"""Cache of the machine code of generated modules on disk.

A module's name is a hash of its text. A changed element gives a new module; a combination that was used before is
loaded from disk. A module's text contains the names of the modules that it imports, so it changes with them.
"""

import hashlib
import importlib.util
import os
import re
import sys
import threading
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path

from numba.core.errors import NumbaError

from rhythmid.errors import InputError

_LOCK = threading.Lock()
COLOUR = re.compile(r"\x1b\[[0-9;]*m")  # the compiler uses colours where it can
# functions of generated modules that are no kernels
OURS = {"rhs", "run", "piece_at", "value_at", "slope_at"}


def cache_folder() -> Path:
    """Folder of generated modules: RHYTHMID_CACHE, else XDG_CACHE_HOME/rhythmid, else ~/.cache/rhythmid."""
    own = os.environ.get("RHYTHMID_CACHE")
    if own:
        return Path(own)
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "rhythmid"


@dataclass(frozen=True)
class Module:
    """Source text of a generated module, with the generated modules that it imports by their names."""

    text: str
    imports: tuple["Module", ...] = ()

    @cached_property
    def name(self) -> str:
        return f"rhythmid_kernel_{hashlib.sha256(self.text.encode()).hexdigest()[:24]}"


@lru_cache(maxsize=256)
def load_run(module: Module) -> Callable[..., int]:
    """`run` of a generated module, compiled or, where its text was compiled before, from the cache on disk.

    Raises InputError where the cache cannot be written, or where an element's kernel does not compile.
    """
    with _LOCK:  # a second process or thread finds a complete module
        for needed in (*module.imports, module):
            if needed.name not in sys.modules:
                _load(needed)
        return sys.modules[module.name].run


def _load(module: Module) -> None:
    """Write a module's text where it does not exist yet, and import it."""
    folder = cache_folder()
    path = folder / f"{module.name}.py"
    if not path.exists():
        try:
            folder.mkdir(parents=True, exist_ok=True)
            partial = folder / f".{module.name}.{os.getpid()}"
            partial.write_text(module.text, encoding="utf-8")
            _put(partial, path)
        except OSError as error:
            raise InputError(
                f"{folder}: compiled models cannot be kept there ({error.strerror}); "
                "set RHYTHMID_CACHE to a writable folder"
            ) from None
    spec = importlib.util.spec_from_file_location(module.name, path)
    assert spec is not None and spec.loader is not None
    made = importlib.util.module_from_spec(spec)
    sys.modules[module.name] = made
    try:
        spec.loader.exec_module(made)
    except BaseException as error:
        del sys.modules[module.name]
        if not isinstance(error, NumbaError):
            raise
        texts = "\n".join(one.text for one in (*module.imports, module))
        raise InputError(_complaint(texts, str(error))) from None


def _put(partial: Path, path: Path) -> None:
    """Give a complete file its final name, unless another process has done so meanwhile.

    A replaced file is a different one for numba: it would be compiled again, and the cached code of the first would
    be overwritten while other processes read it.
    """
    try:
        os.link(partial, path)
    except FileExistsError:
        pass
    except OSError:  # a file system without links
        os.replace(partial, path)
    partial.unlink(missing_ok=True)


def _complaint(text: str, complaint: str) -> str:
    """One line from the compiler's long error message, with the elements that it mentions."""
    kernels = set(re.findall(r"^def (\w+)\(", text, re.MULTILINE)) - OURS
    named = sorted(one for one in kernels if len(kernels) == 1 or re.search(rf"\b{one}\(", complaint))
    lines = [line.strip() for line in COLOUR.sub("", complaint).splitlines()]
    lines = [
        line
        for line in lines
        if line and not line.startswith(("Failed in", "There are", "- Of which", "During"))
    ]
    return f"element {' or '.join(named) or '?'}: its kernel does not compile: {' '.join(lines[:2])[:200]}"
