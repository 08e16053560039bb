"""The reference page of the catalogue, written from the element files: `python -m rhythmid.elements.reference`."""

import ast
import math
from collections.abc import Mapping
from pathlib import Path

from rhythmid.elements.catalogue import load_catalogue
from rhythmid.elements.element import ELAPSED, SLOTS, STEP, Element, Parameter

SLOT_TITLES = {
    "command": "Command elements, on u",
    "actuator": "Actuator elements, on f = f₀ + u",
    "force": "Forces on the mass",
    "sensor": "Sensor elements, on y",
    "timing": "Timing of the measurements",
}
PREAMBLE = """# The elements

Written by `python -m rhythmid.elements.reference > docs/elements.md` from the element files; change those, not this
page.

A model is an inertia and a list of elements. x is the position, v its rate, e = x − x₀ the departure from the linear
spring's rest length, u the command, f₀ the forcing made on the robot, f the actuator force, y the measurement, t the
record's time. Forces act on the mass, positive along +x. Units are those of a translational machine; a rotational one
reads N as N·m, m as rad, kg as kg·m².

*Candidate* elements take part in the search for missing physics; the others are nominal, or exactly absorbed by
nominal parameters. An element is absent when its *size* parameter has the value given. Parameters marked *fixed* are
not estimated unless a model file says so. Names in brackets are other names of the same thing.
"""


def _number(value: float) -> str:
    return {math.inf: "∞", -math.inf: "−∞"}.get(value, f"{value:g}".replace("-", "−"))


def _row(parameter: Parameter) -> str:
    default = "" if parameter.default is None else _number(parameter.default)
    low, high = (_number(end) for end in parameter.bounds)
    notes = " (fixed)" if parameter.fixed else ""
    description = parameter.description.replace("|", "\\|")
    return f"| `{parameter.name}` | {parameter.unit} | {description}{notes} | {low} … {high} | {default} |"


def _prose(element: Element) -> str:
    """The docstring of the element's file."""
    return ast.get_docstring(ast.parse(Path(element.source).read_text(encoding="utf-8"))) or ""


def _names(names: tuple[str, ...]) -> str:
    return ", ".join(f"`{name}`" for name in names)


def describe(element: Element) -> str:
    """One element as Markdown."""
    lines = [f"### `{element.name}`", ""]
    others = f" ({', '.join(element.also_known_as)})" if element.also_known_as else ""
    lines += [f"**{element.title}**{others}", "", f"    {element.equation}", "", _prose(element), ""]
    lines += ["| parameter | unit | meaning | bounds | default |", "| --- | --- | --- | --- | --- |"]
    lines += [_row(parameter) for parameter in element.parameters]
    lines.append("")
    facts = []
    if element.size:
        facts.append(f"- Absent at `{element.size}` = {_number(element.absent)}.")
    borrowed = tuple(source for source, _ in element.borrows.values() if source not in (STEP, ELAPSED))
    if borrowed:
        facts.append(f"- Uses {_names(borrowed)}.")
    if element.states:
        facts.append(f"- States of its own: {_names(element.states)}.")
    if element.memories:
        facts.append(f"- Remembers: {_names(element.memories)}.")
    if element.rotational:
        facts.append("- For rotational machines only.")
    if element.controlled:
        facts.append("- For machines whose controller is in the model.")
    if element.displaced_base:
        facts.append("- For machines on a base that the input displaces.")
    facts.append("- Candidate." if element.candidate else "- Not a candidate.")
    if element.special_case_of:
        facts.append(f"- Special case of {_names(element.special_case_of)}.")
    facts += [f"- Told from `{name}`: {how}." for name, how in element.confusable.items()]
    facts.append(f"- Reference: {element.reference}.")
    return "\n".join([*lines, *facts, ""])


def reference(catalogue: Mapping[str, Element]) -> str:
    """The whole page as Markdown, in the order of the signal path."""
    parts = [PREAMBLE]
    for slot in SLOTS:
        elements = [element for _, element in sorted(catalogue.items()) if element.slot == slot]
        if elements:
            parts += [f"## {SLOT_TITLES[slot]}\n", *(describe(element) for element in elements)]
    return "\n".join(parts)


if __name__ == "__main__":
    print(reference(load_catalogue()), end="")
