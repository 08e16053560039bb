"""A parameter's value in a model: what is known about it, and its form in a file."""

import math
from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import ConfigDict, Field, StrictBool, TypeAdapter

from rhythmid.document import Node
from rhythmid.elements.element import Parameter
from rhythmid.units import Units
from rhythmid.validation import NUMBER, Number, Range, Word, validated


@dataclass(frozen=True)
class Prior:
    """Gaussian prior of a parameter."""

    __pydantic_config__ = ConfigDict(extra="forbid")
    mean: Number
    std: Annotated[Number, Field(gt=0)]


@dataclass(frozen=True)
class Value:
    """A parameter's value in a model; one that is not `fixed` is estimated."""

    value: float
    unit: str
    fixed: bool = False
    bounds: tuple[float, float] = (-math.inf, math.inf)
    prior: Prior | None = None


@dataclass(frozen=True)
class _Entry:
    """A parameter as it is written: {value: …, unit: …}."""

    __pydantic_config__ = ConfigDict(extra="forbid")
    value: Number
    unit: Word | None = None
    fixed: StrictBool | None = None
    bounds: Range | None = None
    prior: Prior | None = None


_ENTRY: TypeAdapter[_Entry] = TypeAdapter(_Entry)


def entry_of(value: Value, usual: Parameter) -> dict[str, Any]:
    """A parameter as a file holds it, without what is usual."""
    entry: dict[str, Any] = {"value": float(value.value), "unit": value.unit}
    if value.fixed or usual.fixed:
        entry["fixed"] = value.fixed
    if tuple(value.bounds) != tuple(usual.bounds):
        entry["bounds"] = [float(value.bounds[0]), float(value.bounds[1])]
    if value.prior is not None:
        entry["prior"] = {"mean": float(value.prior.mean), "std": float(value.prior.std)}
    return entry


def value_of(node: Node, parameter: Parameter, units: Units) -> Value:
    """Parameter from `{value: …, unit: …}` or from a bare number in the machine's own units."""
    whole = isinstance(node.value, dict)
    given = validated(node, _ENTRY) if whole else _Entry(validated(node, NUMBER))
    unit = units.of(parameter.unit)
    if given.unit is not None:
        units.check(given.unit, parameter.unit, f"{node.at('unit').place}: {node.path}")
    low, high = parameter.bounds
    if given.bounds is not None:
        low, high = max(given.bounds[0], low), min(given.bounds[1], high)
    if not low <= given.value <= high:
        node.fail(f"{given.value:g} {unit} is outside [{low:g}, {high:g}] ({parameter.description})")
    fixed = parameter.fixed if given.fixed is None else given.fixed
    return Value(given.value, unit, fixed, (low, high), given.prior)
