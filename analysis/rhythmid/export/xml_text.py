"""XML as text: elements with attributes, comments that are valid whatever they quote, two spaces per level."""

import xml.etree.ElementTree as tree
from collections.abc import Iterable

from rhythmid.export.joint import number


def vector(values: Iterable[float]) -> str:
    """Numbers with spaces between."""
    return " ".join(number(value) for value in values)


def add(parent: tree.Element, tag: str, text: str | None = None, /, **attributes: str) -> tree.Element:
    """A new last child of an element."""
    child = tree.SubElement(parent, tag, attributes)
    child.text = text
    return child


def comment(parent: tree.Element, text: str) -> None:
    """A comment as last child. XML allows no two hyphens in a row there."""
    while "--" in text:
        text = text.replace("--", "- -")
    parent.append(tree.Comment(f" {text} "))


def document(root: tree.Element) -> str:
    """The whole text, with its declaration."""
    tree.indent(root, "  ")
    return f'<?xml version="1.0" encoding="utf-8"?>\n{tree.tostring(root, encoding="unicode")}\n'
