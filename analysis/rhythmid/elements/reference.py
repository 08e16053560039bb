"""The reference page of the catalogue, written from the element files: `python -m rhythmid.elements.reference`."""

import ast
import math
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path

from rhythmid.elements.catalogue import load_catalogue
from rhythmid.elements.element import ELAPSED, LEADING, SLOTS, STEP, Element, Parameter, Scales
from rhythmid.elements.first_guess import GUESSES

SLOT_TITLES = {
    "command": "Command elements, on u",
    "actuator": "Actuator elements, on f = f₀ + u",
    "force": "Forces on the mass",
    "sensor": "Sensor elements, on y",
    "timing": "Timing of the measurements",
}
MOTION: Mapping[str, str] = {  # by `acts`: x and v of which frame
    "leg": "of the mass relative to the base",
    "body": "of the mass in the room",
    "transmission": "of the mass relative to the base",
    "modifier": "of the mass relative to the base",
    "constraint": "of the mass relative to the base",
    "transducer": "of the mass relative to the base",
    "feedback": "of the mass, as positions are measured",
    "observation": "of the mass, as positions are measured",
}
ACTS: Mapping[str, str] = {
    "leg": "a force between mass and base",
    "body": "a force between mass and room, such as a weight or the drag of the air",
    "transmission": "a force between mass and base of a gear that carries `load`: the other forces, without friction and damping",
    "modifier": "what changes the sum `leg` of all forces between mass and base, such as a loss of contact",
    "constraint": "a force that depends on the acceleration, too: on what that would be without it, and by how much it yields to each unit",
    "drive": "a force made on the robot, which depends on time alone; it goes through the actuator",
    "transducer": "an actuator on which the motion acts back",
    "feedback": "a controller, whose reference is the command",
    "observation": "the motion as controllers measure it",
}
PREAMBLE = """# The elements

Written by `python -m rhythmid.elements.reference > docs/elements.md` from the element files; change those, not this
page.

A model is an inertia and a list of elements. x is the position, v its rate, e = x − x₀ the deviation from the linear
spring's rest length, u the command, f₀ the forcing made on the robot, f the actuator force, y the measurement, t the
record's time. Forces act on the mass, positive along +x. Units are those of a translational machine; a rotational one
reads N as N·m, m as rad, kg as kg·m².

*Candidate* elements take part in the search for missing physics; the others are nominal, or exactly absorbed by
nominal parameters. An element has no effect when its *size* parameter has the value given under *Absent at*. Parameters marked *fixed* are
not estimated unless a model file says so. Names in brackets are synonyms.

## Which motion an effect sees

Where the input displaces the base (`kind: base_displacement`), x and v relative to the room differ from those relative to the base. Each element says
which of them it uses. With any other input they are the same; with `kind: base_acceleration` all positions are relative to the base.

{acts}

Friction and dampers marked *against base or room* act between mass and base, unless a model file says
`against: room`, as in `coulomb_friction: {{force: 1.0, against: room}}`. Where the base moves, the search tries both.

## Writing an element

An element is one file that ends with `ELEMENT = Element(…)`; it lies in a folder given with `--elements`. Copy the file of a
similar one. Its fields, besides names, equation, parameters and reference:

- `kernel`: a plain function in Python and `math`. Its first arguments depend on slot and `acts`, see the table
  below. Then follow the parameters, what it `borrows` from other elements (their parameters, the mass, the step), and its
  states. It returns its value, followed by the rates of its states: `return force, rate`.
- `history` and `dead_time`: those of its arguments of which the kernel also needs an earlier value, and the parameter
  that says how much earlier. The earlier values are its last arguments.
- `switches`: where the force changes form, for the phase portraits of reports: `("v", "")` at zero velocity, `("x", "kink")` at
  the position given by the parameter `kink`.
- `acts`: which motion a force sees, and where it is added; `leg` by default.
- `size`: the parameter that scales the effect, and `absent` (0 by default) its value at which the effect is zero.
  The score test varies this parameter alone. With `rigid=True` the size may be too large for records to determine, as the stiffness of a stop;
  of other effects a name is stated only where they determine it.
- `starts`: first guesses from the records' scales, a function such as
  `lambda s: [{{"force": 0.02 * s.force, "transition": 0.1 * s.velocity}}]`. A factor of ten is accurate enough for a size,
  which the score test scales. Frequencies and lengths need several guesses, at the distance of the local minima. An empty list says that
  this motion does not show the effect. Without `starts` the guesses follow from the units: {guesses}. A parameter with a
  default keeps it. An element without a guess is not tried, and the answer says why.
- `ranges`: bounds, from the scales, within which the name of the effect applies; `confusable`, `special_case_of`, `needless_with`:
  effects with which it could be confused. With `repeats=True` a machine may lack several of it, each with parameters of its own.

| slot | `acts` | the kernel is given | x and v are |
| --- | --- | --- | --- |
{kernels}

The scales: {scales}.
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
    if element.history:
        facts.append(f"- Keeps the past of {_names(element.history)} over its `{element.dead_time}`.")
    if element.rotational:
        facts.append("- For rotational machines only.")
    if element.controlled:
        facts.append("- For machines whose controller is in the model.")
    if element.kernel is not None and element.slot == "force" and element.acts in MOTION:
        facts.append(f"- Sees x and v {MOTION[element.acts]}.")
    if element.against is not None:
        facts.append("- Acts against base or room.")
    if element.takes:
        facts.append(
            f"- Takes a signal in {element.takes}; so do the command elements, and the actuators before it."
        )
    if element.displaced_base:
        facts.append("- For machines on a base that the input displaces.")
    if element.driven:
        facts.append("- For machines whose actuator makes a force.")
    facts.append("- Candidate." if element.candidate else "- Not a candidate.")
    if element.special_case_of:
        facts.append(f"- Special case of {_names(element.special_case_of)}.")
    facts += [f"- Confusable with `{name}`: {how}." for name, how in element.confusable.items()]
    facts.append(f"- Reference: {element.reference}.")
    return "\n".join([*lines, *facts, ""])


def _preamble() -> str:
    """The page's introduction, with lists generated from the code."""
    acts = "\n".join(
        f"- `{name}`: {what}{'; x and v ' + MOTION[name] if name in MOTION else ''}."
        for name, what in ACTS.items()
    )
    kernels = "\n".join(
        f"| {slot} | `{name}` | {', '.join(f'`{one}`' for one in given)} | "
        f"{MOTION.get(name, '') if 'x' in given else ''} |"
        for (slot, name), given in LEADING.items()
    )
    scales = ", ".join(f"`{one.name}`" for one in fields(Scales))
    return PREAMBLE.format(acts=acts, kernels=kernels, scales=scales, guesses=GUESSES)


def reference(catalogue: Mapping[str, Element]) -> str:
    """The whole page as Markdown, in the order of the signal path."""
    parts = [_preamble()]
    for slot in SLOTS:
        elements = [element for _, element in sorted(catalogue.items()) if element.slot == slot]
        if elements:
            parts += [f"## {SLOT_TITLES[slot]}\n", *(describe(element) for element in elements)]
    return "\n".join(parts)


if __name__ == "__main__":
    print(reference(load_catalogue()), end="")
