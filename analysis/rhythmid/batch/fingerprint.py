"""A digest of the files on which an answer depends."""

import hashlib
import json
from collections.abc import Iterable, Iterator
from os.path import relpath
from pathlib import Path
from typing import Any

from rhythmid.document import Node, read
from rhythmid.errors import InputError

YAML = (".yaml", ".yml")


class Fingerprint:
    """Digests of files below, or named relative to, one folder. Each file is read once.

    Text files are compared by their content. Recordings, which may be large, are compared by name, size and time of the last change.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._texts: dict[Path, list[Any]] = {}
        self._recordings: dict[Path, list[Any]] = {}

    def __call__(self, options: Any, texts: Iterable[Path], recordings: Iterable[Path]) -> str:
        """Digest, in hexadecimal digits, of plain `options`, of text files and of recordings. Raises InputError for a text that cannot be read."""
        content = [
            options,
            [self._text(path) for path in texts],
            [self._recording(path) for path in recordings],
        ]
        return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()

    def _text(self, path: Path) -> list[Any]:
        """Name and content of a text, and the state of the files that it names, such as tables or a body's meshes."""
        if path not in self._texts:
            try:
                content = hashlib.sha256(path.read_bytes()).hexdigest()
            except OSError as error:
                raise InputError(f"{path}: cannot be read: {error.strerror}") from None
            named = sorted(_files_named(read(path), path.parent)) if path.suffix in YAML else []
            self._texts[path] = [
                relpath(path, self._folder),
                content,
                [self._recording(one) for one in named],
            ]
        return self._texts[path]

    def _recording(self, path: Path) -> list[Any]:
        """Name, size [bytes] and last change [ns] of a recording's files."""
        if path not in self._recordings:
            files = sorted(one for one in path.rglob("*") if one.is_file()) if path.is_dir() else [path]
            states = [(relpath(file, self._folder), file.stat()) for file in files if file.exists()]
            found = [(name, state.st_size, state.st_mtime_ns) for name, state in states]
            named = _files_named(read(path), path.parent) if path.suffix in YAML else ()
            self._recordings[path] = [found, [self._recording(one) for one in sorted(named)]]
        return self._recordings[path]


def _files_named(node: Node, folder: Path) -> Iterator[Path]:
    """Existing files whose names occur in a document."""
    if isinstance(node.value, (dict, list)):
        inner = node.value.values() if isinstance(node.value, dict) else node.value
        for one in inner:
            yield from _files_named(one, folder)
    elif isinstance(node.value, str) and node.value:
        try:
            if (folder / node.value).is_file():
                yield folder / node.value
        except (OSError, ValueError):  # text that cannot be a file name
            return
