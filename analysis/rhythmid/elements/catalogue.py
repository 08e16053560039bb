"""The catalogue: all elements in the slot folders, in the user's own folders and in installed packages.

A file in one of these folders is part of the catalogue, with one `ELEMENT` per file. There is no list to maintain.
"""

import importlib.util
import inspect
import sys
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from difflib import get_close_matches
from functools import cache, lru_cache
from importlib.machinery import SourceFileLoader
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from types import CodeType, ModuleType

from rhythmid.elements.element import SLOTS, Element, Scales
from rhythmid.errors import InputError

ENTRY_POINT_GROUP = "rhythmid.elements"
BUILT_IN = Path(__file__).parent


class _Source(SourceFileLoader):
    """Loads a user's file from its source only: it writes no cache files and sees every change."""

    def get_code(self, fullname: str) -> CodeType:
        return self.source_to_code(self.get_data(self.path), self.path)


def _module(path: Path) -> ModuleType:
    if BUILT_IN in path.parents:
        spec = importlib.util.spec_from_file_location(
            f"rhythmid.elements.{path.parent.name}.{path.stem}", path
        )
    else:
        name = f"_element_{path.stem}"
        spec = importlib.util.spec_from_file_location(name, path, loader=_Source(name, str(path)))
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # inspect.getsource needs to find it
    try:
        spec.loader.exec_module(module)
    except Exception as error:  # any exception of a user's file is bad input, not an internal failure
        raise InputError(
            f"{path}: this element file does not load: {type(error).__name__}: {error}"
        ) from error
    return module


def load_element(path: Path) -> Element:
    """The one `ELEMENT` of a file. Raises InputError where there is none."""
    element = getattr(_module(path), "ELEMENT", None)
    if not isinstance(element, Element):
        raise InputError(f"{path}: defines no ELEMENT; an element file ends with ELEMENT = Element(...)")
    _check_arguments(element, path)
    return replace(element, source=str(path))


def _check_arguments(element: Element, path: Path) -> None:
    """Raise InputError where the functions of an element do not accept their arguments."""
    leading = {"delay": ("stamps",), "sampler": ("rng",)}
    what = next(name for name in ("kernel", "delay", "sampler") if getattr(element, name) is not None)
    expected = (
        leading[what] + tuple(p.name for p in element.parameters) if what in leading else element.arguments
    )
    try:
        given = tuple(inspect.signature(getattr(element, what)).parameters)
    except (TypeError, ValueError):  # not Python source; this is reported when it is compiled
        return
    # a kernel is called by position, so its argument names are free but not their order
    fits = given == expected if what in leading else len(given) == len(expected)
    if not fits or (given != expected and set(given) == set(expected)):
        kind = f"slot={element.slot!r}" + (f", acts={element.acts!r}" if what == "kernel" else "")
        raise InputError(
            f"{path}: the {what} of {element.name!r} takes ({', '.join(given)}); for {kind} and its parameters it is given "
            f"({', '.join(expected)})"
        )


def _files(folder: Path) -> Iterator[Path]:
    for path in sorted(folder.glob("*.py")):
        if not path.name.startswith("_"):
            yield path


@cache
def _built_in() -> tuple[Element, ...]:
    """The package's own elements, whose files are read once; those of users may change between two calls."""
    return tuple(load_element(path) for slot in SLOTS for path in _files(BUILT_IN / slot))


@lru_cache(maxsize=8)
def _declared(search_path: tuple[str, ...]) -> tuple[EntryPoint, ...]:
    """Elements of the packages that are installed along Python's search path; every package's metadata is read for them."""
    return tuple(entry_points(group=ENTRY_POINT_GROUP))


@dataclass(frozen=True)
class Catalogue(Mapping[str, Element]):
    """Elements by name."""

    elements: Mapping[str, Element]

    def __getitem__(self, name: str) -> Element:
        try:
            return self.elements[name]
        except KeyError:
            near = get_close_matches(name, self.elements, 1)
            hint = f"; did you mean {near[0]!r}?" if near else "; see the element reference for the names"
            raise InputError(f"unknown element {name!r}{hint}") from None

    def __contains__(self, name: object) -> bool:
        return name in self.elements

    def __iter__(self) -> Iterator[str]:
        return iter(self.elements)

    def __len__(self) -> int:
        return len(self.elements)

    def without(self, *names: str) -> "Catalogue":
        """The catalogue without the named elements."""
        return Catalogue({name: element for name, element in self.elements.items() if name not in names})

    def within(self, scales: Scales) -> "Catalogue":
        """The catalogue with every element limited to the range in which its name applies, for records with these
        scales."""
        return Catalogue({name: element.within(scales) for name, element in self.elements.items()})


def load_catalogue(folders: Iterable[str | Path] = ()) -> Catalogue:
    """All elements: built in, from installed packages (entry points `rhythmid.elements`), and from `folders`.

    Parameters
    ----------
    folders
        Each holds element files, directly or in sub-folders named after the slots.

    Raises
    ------
    InputError
        For a folder that is missing or empty, a file that does not load, and a name that is defined twice.
    """
    found: dict[str, Element] = {}

    def add(element: Element) -> None:
        if element.name in found:
            raise InputError(
                f"{element.source}: element {element.name!r} is already defined in {found[element.name].source}; "
                "give it another name"
            )
        found[element.name] = element

    for element in _built_in():
        add(element)
    for entry in _declared(tuple(sys.path)):
        add(replace(entry.load(), source=entry.value))
    for given in folders:
        folder = Path(given)
        if not folder.is_dir():
            raise InputError(f"{folder}: no such folder of elements")
        paths = list(_files(folder)) + [path for slot in SLOTS for path in _files(folder / slot)]
        if not paths:
            raise InputError(f"{folder}: holds no element files (*.py)")
        for path in paths:
            add(load_element(path))
    return Catalogue(found)
