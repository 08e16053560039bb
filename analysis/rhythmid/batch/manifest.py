"""The manifest of a batch: which recordings, joints and models to analyse, by which command.

    command: identify                  # identify | diagnose | check
    model: hopper.yaml                 # or a list, or {name: file, …}: every recording with each
    signals: signals.yaml              # likewise; one with `joints:` stands for each of its joints
    entries:
      - {bags: "monday/*", group: rig A}
      - {bags: ["tuesday/*.mcap", extra/run7], group: rig B, options: {method: paper}}

All keys except `bags` and `together` may stand above the entries, as defaults. Paths and globs are relative to the manifest.
"""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, Field, TypeAdapter

from rhythmid.document import Node, parse, read
from rhythmid.identify.identifiability import Forcing
from rhythmid.identify.identify import Method
from rhythmid.ltp.nonparametric import HtfMethod
from rhythmid.plain_yaml import plain_yaml
from rhythmid.settings import KEYS
from rhythmid.validation import Number, Range, Word, validated

Command = Literal["identify", "diagnose", "check"]


def _listed(value: Any) -> Any:
    return [value] if isinstance(value, str) else value


def _named(value: Any) -> Any:
    """Files by name; a file that is given without a name has its file name."""
    given = _listed(value)
    if not isinstance(given, list) or not all(isinstance(one, str) for one in given):
        return given
    named = {Path(one).stem: one for one in given}
    if len(named) < len(given):
        raise ValueError("two files have the same name; name them: {first: one.yaml, second: other.yaml}")
    return named


def _some(value: Any) -> Any:
    if value is not None and not value:
        raise ValueError("is empty; name at least one, or leave the key out")
    return value


Several = Annotated[tuple[str, ...], BeforeValidator(_listed), AfterValidator(_some)]
Named = Annotated[dict[str, str], BeforeValidator(_named), AfterValidator(_some)]


@dataclass(frozen=True)
class CheckOptions:
    """`check` has none."""

    __pydantic_config__ = KEYS


@dataclass(frozen=True)
class IdentifyOptions:
    """As the options of `rhythmid identify`; `clock_offset` and `clock_offset_std` [s]."""

    __pydantic_config__ = KEYS

    method: Method = "joint"
    htf: HtfMethod = "auto"
    forcing: Forcing | None = None
    clock_offset: Range | None = None
    clock_offset_std: Annotated[Number, Field(ge=0)] | None = None


@dataclass(frozen=True)
class DiagnoseOptions:
    """As the options of `rhythmid diagnose`: globs of held-out records, and the budget of each answer [s]."""

    __pydantic_config__ = KEYS

    holdout: Several = ()
    budget: Annotated[Number, Field(gt=0)] | None = None


Options = CheckOptions | IdentifyOptions | DiagnoseOptions
OPTIONS: Mapping[Command, TypeAdapter[Any]] = {
    "check": TypeAdapter(CheckOptions),
    "identify": TypeAdapter(IdentifyOptions),
    "diagnose": TypeAdapter(DiagnoseOptions),
}


@dataclass(frozen=True, kw_only=True)
class Shared:
    """Defaults of all entries. None: not given.

    Attributes
    ----------
    group : the rig, or another criterion of the comparison.
    command : command that analyses each recording.
    model, signals : files by name; every recording is analysed with each.
    joints : those of a signals file with `joints:` that are analysed; all by default.
    elements : folders with the user's own elements.
    options : of the command.
    """

    __pydantic_config__ = KEYS

    group: Word | None = None
    command: Command | None = None
    model: Named | None = None
    signals: Named | None = None
    joints: Several | None = None
    elements: Several | None = None
    options: dict[str, Any] | None = None


@dataclass(frozen=True, kw_only=True)
class Entry(Shared):
    """Recordings that are analysed in the same way: each separately, or all `together` in one answer. `place` is its line in the file."""

    bags: Several
    together: bool = False


@dataclass(frozen=True, kw_only=True)
class _Manifest(Shared):
    entries: Annotated[tuple[Entry, ...], AfterValidator(_some)]


@dataclass(frozen=True)
class Settled:
    """An entry with the defaults of the manifest, its options, and its place in the file for error messages."""

    entry: Entry
    command: Command
    options: Any
    place: Node


@dataclass(frozen=True)
class Manifest:
    """Entries of a manifest, and the folder to which their paths are relative."""

    entries: tuple[Settled, ...]
    folder: Path
    name: str

    @classmethod
    def load(cls, path: str | Path) -> "Manifest":
        """The manifest in a YAML file. Raises InputError naming line and key of what is wrong."""
        return _manifest(read(path), Path(path).resolve().parent, Path(path).stem)

    @classmethod
    def of(cls, content: Mapping[str, Any], folder: str | Path = ".") -> "Manifest":
        """The same from a mapping, whose paths are relative to `folder`."""
        return _manifest(
            parse(plain_yaml(content, "manifest"), "manifest"), Path(folder).resolve(), "manifest"
        )


_WHOLE: TypeAdapter[_Manifest] = TypeAdapter(_Manifest)
SHARED = tuple(one.name for one in fields(Shared))


def _manifest(document: Node, folder: Path, name: str) -> Manifest:
    whole = validated(document, _WHOLE)
    places = document.at("entries").items()
    return Manifest(
        tuple(_settled(one, whole, document, place) for one, place in zip(whole.entries, places)),
        folder,
        name,
    )


def _settled(entry: Entry, whole: _Manifest, document: Node, place: Node) -> Settled:
    said = {name: getattr(entry, name) for name in SHARED}
    usual = {name: getattr(whole, name) for name in SHARED}
    command = entry.command or whole.command
    if command is None:
        place.fail("'command:' is missing, here or above the entries: identify, diagnose or check")
    given = [place] if command != (whole.command or command) else [document, place]
    options = {
        key: node
        for one in given
        if "options" in one.mapping() and one.at("options").value is not None
        for key, node in one.at("options").mapping().items()
    }
    found = validated(Node(options, place.place, f"{place.path}.options"), OPTIONS[command])
    merged = {name: usual[name] if said[name] is None else said[name] for name in SHARED}
    if command == "diagnose" and merged["model"] is None:
        place.fail(
            "'model:' is missing, here or above the entries: the nominal model that may lack something"
        )
    return Settled(Entry(**merged, bags=entry.bags, together=entry.together), command, found, place)
