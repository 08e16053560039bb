"""A YAML document that knows the line of each value, so that an error message can name file and line."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Any, NoReturn

import yaml

from rhythmid.errors import InputError

# characters of a document: a minute to read; the largest written by hand have some thousands
LARGEST = 4 << 20
MOST_VALUES = 200_000  # values of a document, with those repeated by aliases: a few lines of aliases can expand to billions
LONGEST_PATH = 1024  # characters; as long as YAML lets a plain key be


@dataclass(frozen=True)
class Node:
    """A value of the document: a mapping of Nodes, a list of Nodes or a plain value, with its place."""

    value: Any
    place: str  # "file.yaml:12"
    path: str  # "force[1].linear_spring.stiffness"

    def fail(self, problem: str) -> NoReturn:
        """Raise InputError at this place."""
        raise InputError(f"{self.place}: {self.path + ': ' if self.path else ''}{problem}")

    @property
    def plain(self) -> Any:
        """The value without places."""
        if isinstance(self.value, dict):
            return {key: node.plain for key, node in self.value.items()}
        if isinstance(self.value, list):
            return [node.plain for node in self.value]
        return self.value

    def at(self, key: str | int) -> "Node":
        """The value at a key or an index; the node itself if there is none."""
        if isinstance(self.value, dict) and key in self.value:
            return self.value[key]
        if isinstance(self.value, list) and isinstance(key, int) and key < len(self.value):
            return self.value[key]
        return self

    def mapping(self, known: Iterable[str] | None = None) -> "dict[str, Node]":
        """The value as a mapping; with `known`, any other key is refused."""
        if not isinstance(self.value, dict):
            self.fail("a mapping (key: value) is expected here")
        if known is not None:
            known = list(known)
            for key, node in self.value.items():
                if key not in known:
                    node.fail(unknown_key(str(key), known))
        return self.value

    def items(self) -> "list[Node]":
        """The value as a list; an empty value counts as an empty list."""
        if self.value is None:
            return []
        if not isinstance(self.value, list):
            self.fail("a list (- item) is expected here")
        return self.value


def unknown_key(key: str, known: Sequence[str]) -> str:
    """Message about an unknown key."""
    near = get_close_matches(key, known, 1)
    return f"unknown key; {f'did you mean {near[0]!r}?' if near else 'known: ' + ', '.join(known)}"


def as_node(plain: Any, name: str, path: str = "") -> Node:
    """A value that does not come from a document, such as a parameter in JSON, as a node; `name` stands for its place."""
    if isinstance(plain, Mapping):
        held = {str(k): as_node(v, name, f"{path}.{k}" if path else str(k)) for k, v in plain.items()}
        return Node(held, name, path)
    if isinstance(plain, (list, tuple)):
        return Node([as_node(item, name, f"{path}[{i}]") for i, item in enumerate(plain)], name, path)
    return Node(plain, name, path)


def _node(
    raw: yaml.Node | None,
    name: str,
    path: str,
    loader: yaml.SafeLoader,
    left: Iterator[int],
    line: int | None = None,
) -> Node:
    """`line` is the line of the key of this value; the value itself may begin further down. `left` counts down the values
    that the document may still hold."""
    if raw is None:
        return Node(None, name, path)
    if len(path) > LONGEST_PATH:
        raise InputError(f"{name}: is nested too deeply, or has a key of more than {LONGEST_PATH} characters")
    if next(left, None) is None:
        raise InputError(f"{name}: holds more than {MOST_VALUES} values, those of aliases included")
    place = f"{name}:{(raw.start_mark.line if line is None else line) + 1}"
    if isinstance(raw, yaml.MappingNode):
        found: dict[str, Node] = {}
        for key_node, value_node in raw.value:
            if not isinstance(key_node, yaml.ScalarNode):
                raise InputError(f"{name}:{key_node.start_mark.line + 1}: a key is a single word")
            key = str(key_node.value)
            inner = _node(
                value_node, name, f"{path}.{key}" if path else key, loader, left, key_node.start_mark.line
            )
            if key in found:
                inner.fail("is given twice")
            found[key] = inner
        return Node(found, place, path)
    if isinstance(raw, yaml.SequenceNode):
        return Node(
            [_node(item, name, f"{path}[{i}]", loader, left) for i, item in enumerate(raw.value)], place, path
        )
    try:
        return Node(loader.construct_object(raw), place, path)
    except ValueError as error:  # for example a date that does not exist
        raise InputError(f"{place}: {path}: {error}") from None
    except (LookupError, AttributeError, TypeError, OverflowError):
        raise InputError(f"{place}: {path}: {raw.value!r} is no {raw.tag.rsplit(':', 1)[-1]}") from None


def parse(text: str, name: str) -> Node:
    """The document in `text`; `name` stands for it in messages. Raises InputError when it is not YAML."""
    if len(text) > LARGEST:
        raise InputError(f"{name}: is too large: {len(text)} characters, {LARGEST} are the most")
    try:
        loader = yaml.SafeLoader(text)
        try:
            return _node(loader.get_single_node(), name, "", loader, iter(range(MOST_VALUES)))
        finally:
            loader.dispose()
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        line = f":{mark.line + 1}" if mark else ""
        reason = getattr(error, "problem", None) or getattr(error, "reason", None) or error
        raise InputError(f"{name}{line}: is not valid YAML: {reason}") from None
    except RecursionError:
        raise InputError(f"{name}: is nested too deeply") from None


def read(path: str | Path) -> Node:
    """The document in the file `path`. Raises InputError when it cannot be read or is not YAML."""
    try:
        with Path(path).open(encoding="utf-8") as file:
            text = file.read(LARGEST + 1)
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "is not a text file"
        raise InputError(f"{path}: cannot be read: {reason}") from None
    return parse(text, str(path))
