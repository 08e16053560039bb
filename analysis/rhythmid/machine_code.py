"""Machine code of generated modules, kept on disk.

A module's name is a hash of its text: change an element and a new module is compiled, use the same combination again and
the machine code comes from disk.
"""

import hashlib
import importlib.util
import os
import re
import sys
import threading
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path

from numba.core.errors import NumbaError

from rhythmid.errors import InputError

_LOCK = threading.Lock()


def cache_folder() -> Path:
    """Where generated modules live: RHYTHMID_CACHE, else XDG_CACHE_HOME/rhythmid, else ~/.cache/rhythmid."""
    own = os.environ.get("RHYTHMID_CACHE")
    if own:
        return Path(own)
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "rhythmid"


@lru_cache(maxsize=256)
def load_module(text: str) -> Callable[..., int]:
    """`run` of a generated module, compiled or, where this text was compiled before, from the cache on disk."""
    name = f"rhythmid_kernel_{hashlib.sha256(text.encode()).hexdigest()[:24]}"
    folder = cache_folder()
    path = folder / f"{name}.py"
    with _LOCK:
        if not path.exists():
            try:
                folder.mkdir(parents=True, exist_ok=True)
                partial = folder / f".{name}.{os.getpid()}"
                partial.write_text(text, encoding="utf-8")
                os.replace(partial, path)
            except OSError as error:
                raise InputError(
                    f"{folder}: compiled models cannot be kept there ({error.strerror}); "
                    "set RHYTHMID_CACHE to a writable folder"
                ) from None
        spec = importlib.util.spec_from_file_location(name, path)
        assert spec is not None and spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        sys.modules[name] = module
        try:
            spec.loader.exec_module(module)
        except NumbaError as error:
            raise InputError(_complaint(text, str(error))) from None
    return module.run


def _complaint(text: str, complaint: str) -> str:
    """One line of the compiler's page of complaint, with the elements that it mentions."""
    kernels = set(re.findall(r"^def (\w+)\(", text, re.MULTILINE)) - {"rhs", "run"}
    named = sorted(kernel for kernel in kernels if re.search(rf"\b{kernel}\(", complaint))
    lines = [line.strip() for line in complaint.splitlines()]
    lines = [
        line
        for line in lines
        if line and not line.startswith(("Failed in", "There are", "- Of which", "During"))
    ]
    return f"element {' or '.join(named) or '?'}: its kernel does not compile: {' '.join(lines[:2])[:200]}"
