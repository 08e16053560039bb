"""Model of a machine: an inertia and a list of elements along the signal path, written in a YAML file."""

import math
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, cast

import yaml
from pydantic import ConfigDict, TypeAdapter

from rhythmid.document import Node, parse, read
from rhythmid.elements.candidates import STIFFNESS, Setting
from rhythmid.elements.catalogue import Catalogue, load_catalogue
from rhythmid.elements.element import SLOTS, Against, Element, Parameter
from rhythmid.errors import InputError
from rhythmid.output import write_text
from rhythmid.units import ROTATIONAL, TRANSLATIONAL, Units, mass_unit
from rhythmid.validation import validated
from rhythmid.value import Value, entry_of, value_of

INERTIA = "inertia.mass"
CONTROLLER = "position_control"  # required by an element that acts on a controller's measurements
MASS = Parameter("mass", "kg", "inertia", bounds=(0.0, math.inf))


@dataclass(frozen=True)
class Term:
    """An element as a model uses it. `label` is its name, numbered when the model uses it more than once."""

    element: Element
    label: str
    values: Mapping[str, Value]

    @property
    def numbers(self) -> dict[str, float]:
        """Values of its parameters by name, in the model's units."""
        return {name: value.value for name, value in self.values.items()}

    @property
    def against(self) -> Against | None:
        """The body against which a friction or a damper acts; None if there is no choice."""
        return self.element.against


@dataclass(frozen=True)
class Model:
    """An inertia and the elements along the path command -> actuator -> force -> sensor.

    Attributes
    ----------
    mass
        The inertia.
    terms
        The elements in the order of the path.
    units
        Units of forces and positions.

    Examples
    --------
    >>> model = Model.from_text(
    ...     '''
    ... inertia: {mass: {value: 1.0, unit: kg, fixed: true}}
    ... force:
    ...   - linear_spring: {stiffness: {value: 200.0, unit: N/m}, rest_length: {value: 0.0, unit: m, fixed: true}}
    ...   - viscous_damper: {damping: {value: 1.0, unit: N*s/m}}
    ... '''
    ... )
    >>> sorted(model.free)
    ['linear_spring.stiffness', 'viscous_damper.damping']
    >>> model.with_values({"viscous_damper.damping": 1.5}).value("viscous_damper.damping")
    1.5
    """

    mass: Value
    terms: tuple[Term, ...]
    units: Units = TRANSLATIONAL

    @classmethod
    def load(cls, path: str | Path, catalogue: Catalogue | None = None) -> "Model":
        """The model in a YAML file. If the file has a `body:`, this is a `Machine`, which the functions of rhythmid also accept.

        Raises InputError naming line, parameter and unit of what is wrong.
        """
        document = read(path)
        if isinstance(document.value, dict) and "body" in document.value:
            from rhythmid.body.machine import Machine  # it needs MuJoCo, and imports this module

            return cast("Model", Machine.load(path, catalogue))
        return cls.from_document(document, catalogue)

    @classmethod
    def of_one_axis(cls, path: str | Path, catalogue: Catalogue | None = None) -> "Model":
        """The model of one axis in a YAML file. Raises InputError as `load` does, and for a machine of several joints."""
        return cls.from_document(read(path), catalogue)

    @classmethod
    def from_text(cls, text: str, name: str = "model", catalogue: Catalogue | None = None) -> "Model":
        """The model in a YAML text; `name` stands for it in messages."""
        return cls.from_document(parse(text, name), catalogue)

    @classmethod
    def from_document(cls, document: Node, catalogue: Catalogue | None = None) -> "Model":
        """The model in a document, or in a part of one."""
        return _model(document, load_catalogue() if catalogue is None else catalogue)

    @cached_property
    def parameters(self) -> dict[str, Value]:
        """All parameters, by "label.parameter"; the inertia is "inertia.mass"."""
        found = {INERTIA: self.mass}
        for term in self.terms:
            found |= {f"{term.label}.{name}": value for name, value in term.values.items()}
        return found

    @property
    def free(self) -> list[str]:
        """Names of the parameters that are estimated."""
        return [name for name, value in self.parameters.items() if not value.fixed]

    @property
    def held(self) -> list[str]:
        """Names of the parameters that the file fixes, without those that are fixed by their nature."""
        forms = {f"{term.label}.{p.name}" for term in self.terms for p in term.element.parameters if p.fixed}
        return [name for name, value in self.parameters.items() if value.fixed and name not in forms]

    @property
    def setting(self) -> Setting:
        """Properties that decide which effects the model could lack."""
        return Setting(
            frozenset((term.element.name, term.against) for term in self.terms),
            frozenset(self.parameters),
            frozenset(self.free),
            rotational=self.units.position == "rad",
            controlled=any(term.element.acts == "feedback" for term in self.terms),
            restored=any(
                term.element.family == STIFFNESS or term.element.name == "position_control"
                for term in self.terms
            ),
        )

    def value(self, name: str) -> float:
        """Value of one parameter. Raises InputError for an unknown name."""
        parameters = self.parameters
        if name not in parameters:
            raise InputError(f"the model has no parameter {name!r}; it has {', '.join(parameters)}")
        return parameters[name].value

    def with_parameters(self, changes: Mapping[str, Value]) -> "Model":
        """A copy with some parameters replaced. Raises InputError for an unknown name."""
        for name in changes:
            self.value(name)
        terms = tuple(
            replace(
                term,
                values={
                    name: changes.get(f"{term.label}.{name}", value) for name, value in term.values.items()
                },
            )
            for term in self.terms
        )
        return replace(self, mass=changes.get(INERTIA, self.mass), terms=terms)

    def with_values(self, values: Mapping[str, float]) -> "Model":
        """A copy with some parameter values replaced; bounds and priors stay."""
        current = self.parameters
        for name in values:
            self.value(name)
        return self.with_parameters({n: replace(current[n], value=float(v)) for n, v in values.items()})

    @property
    def turns(self) -> dict[str, float]:
        """Period of the effect of each element's parameter, by name; infinite where it is not periodic."""
        return {f"{t.label}.{p.name}": p.turn for t in self.terms for p in t.element.parameters}

    def unwound(self, about: "Model | None" = None) -> "Model":
        """An equivalent copy whose free phases lie within half a turn of those of `about`, or of zero."""
        turns = {name: turn for name, turn in self.turns.items() if math.isfinite(turn)}
        middle = {name: about.value(name) if about else 0.0 for name in self.free if name in turns}
        return self.with_values(
            {name: at + math.remainder(self.value(name) - at, turns[name]) for name, at in middle.items()}
        )

    def with_element(
        self,
        element: Element,
        values: Mapping[str, float] | None = None,
        fixed: bool = False,
    ) -> "Model":
        """A copy with one more element, at the end of its slot. Raises InputError for a parameter without a value."""
        given = dict(values or {})
        made: dict[str, Value] = {}
        for parameter in element.parameters:
            value = given.pop(parameter.name, parameter.default)
            if value is None:
                raise InputError(f"element {element.name!r}: parameter {parameter.name!r} needs a value")
            unit = self._units_at(element).of(parameter.unit)
            made[parameter.name] = Value(float(value), unit, fixed or parameter.fixed, parameter.bounds)
        if given:
            raise InputError(f"element {element.name!r} has no parameter {next(iter(given))!r}")
        taken = {term.label for term in self.terms}
        label = next(name for name in _labels(element.name) if name not in taken)
        extended = replace(self, terms=(*self.terms, Term(element, label, made)))
        extended.check_borrowed()
        return extended

    def _units_at(self, element: Element) -> Units:
        """Units of an element at the end of its slot: of a command element before a motor in volts, the motor's."""
        motors = [term.element for term in self.terms] if element.slot == "command" else []
        return _fed(self.units, motors)

    def without(self, label: str) -> "Model":
        """A copy without the term called `label`. Raises InputError when another element needs it."""
        reduced = replace(self, terms=tuple(term for term in self.terms if term.label != label))
        reduced.check_borrowed()
        return reduced

    def pruned(self, label: str) -> "Model":
        """A copy without the term called `label` and without those that need it."""
        reduced = replace(self, terms=tuple(term for term in self.terms if term.label != label))
        idle = next((term.label for term in reduced.terms if reduced.lacking(term.element) is not None), None)
        return reduced if idle is None else reduced.pruned(idle)

    def term(self, name: str) -> Term | None:
        """The first term whose label is `name`, None where there is none."""
        return next((term for term in self.terms if term.label == name), None)

    def borrowed(self, source: str, default: float | None) -> float | None:
        """Value of a parameter that an element borrows from another one, or `default` where that is absent."""
        parameters = self.parameters
        return parameters[source].value if source in parameters else default

    def check_borrowed(self) -> None:
        """Raise InputError when an element needs another one that the model lacks."""
        for term in self.terms:
            if (lacking := self.lacking(term.element)) is not None:
                raise InputError(f"element {term.label!r} needs {lacking!r}, which the model does not have")

    def lacking(self, element: Element) -> str | None:
        """Name of another element that `element` needs and the model lacks; None if there is none."""
        if element.acts == "observation" and not self.setting.controlled:
            return CONTROLLER
        for source, default in element.borrows.values():
            if self.borrowed(source, default) is None:
                return source.split(".")[0]
        return None

    def to_yaml(self) -> str:
        """The model as YAML text that `load` reads back."""
        content: dict[str, Any] = {}
        if self.units not in (TRANSLATIONAL, ROTATIONAL):
            content["units"] = {
                "force": self.units.force,
                "position": self.units.position,
                "mass": self.units.mass,
            }
        content["inertia"] = {"mass": entry_of(self.mass, MASS)}
        for slot in SLOTS:
            terms = [term for term in self.terms if term.element.slot == slot]
            if terms or slot != "timing":
                content[slot] = [{term.element.name: _body(term)} for term in terms]
        return yaml.safe_dump(content, sort_keys=False, default_flow_style=None, width=110)

    def save(self, path: str | Path) -> None:
        """Write the model file completely or not at all. Raises InputError when the place is not writable."""
        write_text(Path(path), self.to_yaml())


def _labels(name: str) -> Iterator[str]:
    yield name
    for number in range(2, 1000):
        yield f"{name}_{number}"


def _fed(units: Units, behind: Iterable[Element]) -> Units:
    """Units of the signal that later elements take: volts before a motor that is driven by a voltage."""
    taken = next((element.takes for element in behind if element.slot == "actuator" and element.takes), None)
    return units if taken is None else replace(units, force=taken)


def _body(term: Term) -> dict[str, Any]:
    body: dict[str, Any] = {
        name: entry_of(value, term.element.parameter(name)) for name, value in term.values.items()
    }
    return body | ({"against": "room"} if term.against == "room" else {})


@dataclass(frozen=True)
class _UnitNames:
    __pydantic_config__ = ConfigDict(extra="forbid")
    force: str = "N"
    position: str = "m"
    mass: str | None = None


_AGAINST: TypeAdapter[Against] = TypeAdapter(Against)
_UNIT_NAMES: TypeAdapter[_UnitNames] = TypeAdapter(_UnitNames)


def _units(document: dict[str, Node], mass: Node) -> Units:
    if "units" in document:
        given = validated(document["units"], _UNIT_NAMES)
        default = (
            "kg" if (given.force, given.position) == ("N", "m") else mass_unit(given.force, given.position)
        )
        return Units(given.force, given.position, default if given.mass is None else given.mass)
    unit = str(mass.at("unit").value) if isinstance(mass.value, dict) and "unit" in mass.value else ""
    plain = re.sub(r"[ ·]", "", unit.replace("**", "^").replace("²", "^2"))
    return ROTATIONAL if plain in ("kg*m^2", "kgm^2") else TRANSLATIONAL


def _term(item: Node, slot: str, catalogue: Catalogue, units: Units, taken: set[str]) -> Term:
    named = item.mapping()
    if len(named) != 1:
        item.fail("one element is expected here: - name: {parameter: {value: …, unit: …}}")
    name, body = next(iter(named.items()))
    try:
        element = catalogue[name]
    except InputError as error:
        raise InputError(f"{body.place}: {error}") from None
    if element.slot != slot:
        body.fail(f"{name} belongs under '{element.slot}:', not under '{slot}:'")
    names = [parameter.name for parameter in element.parameters]
    sides = ["against"] if element.against is not None else []
    given = {} if body.value is None else body.mapping([*names, *sides])
    if "against" in given:
        element = element.acting_against(validated(given["against"], _AGAINST))
    values: dict[str, Value] = {}
    for parameter in element.parameters:
        if parameter.name in given:
            values[parameter.name] = value_of(given[parameter.name], parameter, units)
        elif parameter.default is None:
            body.fail(
                f"parameter {parameter.name!r} is missing ({parameter.description}, {units.of(parameter.unit)})"
            )
        else:
            values[parameter.name] = Value(
                parameter.default, units.of(parameter.unit), True, parameter.bounds
            )  # parameters that are not in the file are not estimated
    label = next(label for label in _labels(name) if label not in taken)
    taken.add(label)
    return Term(element, label, values)


def _named(item: Node, catalogue: Catalogue) -> Iterator[Element]:
    """The element named by an entry of the path; None if the name is unknown."""
    if isinstance(item.value, dict):
        yield from (catalogue[str(name)] for name in item.value if str(name) in catalogue)


def _model(document: Node, catalogue: Catalogue) -> Model:
    if document.value is None:
        raise InputError(f"{document.place}: the model file is empty")
    sections = document.mapping(["units", "inertia", *SLOTS])
    if "inertia" not in sections:
        document.fail(
            "the model has no 'inertia:'; write inertia: {mass: {value: 1.0, unit: kg, fixed: true}}"
        )
    inertia = sections["inertia"].mapping(["mass"])
    if "mass" not in inertia:
        sections["inertia"].fail("'mass' is missing")
    units = _units(sections, inertia["mass"])
    mass = value_of(inertia["mass"], MASS, units)
    if mass.value <= 0.0:
        inertia["mass"].fail("must be greater than 0")
    taken: set[str] = set()
    places = [(item, slot) for slot in SLOTS if slot in sections for item in sections[slot].items()]
    terms: list[Term] = []
    for place, (item, slot) in enumerate(places):
        later = (other for other, where in places[place + 1 :] if where == "actuator")
        behind = [element for other in later for element in _named(other, catalogue)]
        at = _fed(units, behind) if slot in ("command", "actuator") else units
        terms.append(_term(item, slot, catalogue, at, taken))
    model = Model(mass, tuple(terms), units)
    for (item, _), term in zip(places, model.terms):
        if (lacking := model.lacking(term.element)) is not None:
            item.fail(f"{term.label} needs {lacking!r}, which the model does not have")
    return model
