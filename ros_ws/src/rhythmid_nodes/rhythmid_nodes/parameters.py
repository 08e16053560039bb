"""ROS parameters declared with description, unit and range; a wrong one is refused with one clear line."""

from __future__ import annotations

from dataclasses import dataclass
from difflib import get_close_matches
from typing import Any

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.node import Node
from rclpy.parameter import Parameter as RosParameter

from rhythmid.errors import InputError

Value = bool | int | float | str | list[str] | list[float]
_WORDS = {bool: "true or false", int: "a whole number", float: "a number", str: "text"}


@dataclass(frozen=True)
class Parameter:
    """One parameter of a node.

    Attributes
    ----------
    name, default, description
        As `ros2 param describe` shows them.
    unit
        SI unit, shown with the description and in refusals.
    bounds
        Closed range of a number.
    choices
        The words a text may be.
    items
        For a list without default: the type of its items.
    settable
        Whether it may be set while the node runs (`ros2 param set`).
    """

    name: str
    default: Value | None
    description: str
    unit: str = ""
    bounds: tuple[float, float] | None = None
    choices: tuple[str, ...] = ()
    items: type[str] | type[float] | None = None
    settable: bool = False

    @property
    def kind(self) -> RosParameter.Type:
        if self.default is not None:
            return RosParameter.Type.from_parameter_value(self.default)
        return RosParameter.Type.STRING_ARRAY if self.items is str else RosParameter.Type.DOUBLE_ARRAY

    def descriptor(self) -> ParameterDescriptor:
        unit = f" [{self.unit}]" if self.unit else ""
        choices = f" ({' | '.join(self.choices)})" if self.choices else ""
        descriptor = ParameterDescriptor(
            description=f"{self.description}{unit}{choices}", read_only=not self.settable
        )
        if self.bounds is not None:
            low, high = self.bounds
            if isinstance(self.default, float):
                descriptor.floating_point_range = [FloatingPointRange(from_value=low, to_value=high)]
            else:
                descriptor.integer_range = [IntegerRange(from_value=int(low), to_value=int(high))]
        return descriptor

    def check(self, value: Any) -> Any:
        """`value` as the parameter's type; raises InputError if it is of another type or outside its range."""
        if self.items is not None or isinstance(self.default, list):
            wanted = type(self.default[0]) if isinstance(self.default, list) else self.items
            assert wanted is not None
            if isinstance(value, (str, bytes)) or not hasattr(value, "__iter__"):
                raise InputError(f"parameter {self.name} = {value!r} must be a list: {self.description}")
            return [self._cast(item, wanted) for item in value]
        return self._in_range(self._cast(value, type(self.default)))

    def _cast(self, value: Any, wanted: type) -> Any:
        if wanted is float and type(value) is int:
            return float(value)  # `delay: 0` in a parameter file means 0.0
        if wanted is int and type(value) is float and value.is_integer():
            return int(value)  # and `rate: 500.0` means 500
        if type(value) is not wanted:
            raise InputError(
                f"parameter {self.name} = {value!r} must be {_WORDS[wanted]}: {self.description}"
            )
        return value

    def _in_range(self, value: Any) -> Any:
        if self.bounds is not None and not self.bounds[0] <= value <= self.bounds[1]:  # refuses NaN as well
            low, high = self.bounds
            raise InputError(
                f"parameter {self.name} = {value!r} must lie in [{low:g}, {high:g}] {self.unit}".rstrip()
            )
        if self.choices and value not in self.choices:
            raise InputError(f"parameter {self.name} = {value!r} must be one of {', '.join(self.choices)}")
        return value


def declare(node: Node, parameters: tuple[Parameter, ...]) -> dict[str, Any]:
    """Declare `parameters` on `node` and return their values by name; None for what has no default and is not given.

    Raises InputError for a value of the wrong type or out of range, and for an unknown name. Otherwise a
    misspelt `max_effort` would leave the default in effect on hardware.
    """
    given = node._parameter_overrides  # rclpy has no public way to see what was given but never declared
    known = {parameter.name for parameter in parameters}
    for name in given:
        if name not in known and not node.has_parameter(name) and not name.startswith("qos_overrides."):
            near = get_close_matches(name, known, n=1)
            mend = f"did you mean {near[0]}?" if near else f"this node has {', '.join(sorted(known))}"
            raise InputError(f"unknown parameter {name}; {mend}")
    values: dict[str, Any] = {}
    for parameter in parameters:
        value = parameter.default
        if parameter.name in given:
            value = parameter.check(given[parameter.name].value)
        values[parameter.name] = value
        node.declare_parameter(
            parameter.name,
            parameter.kind if value is None else value,
            parameter.descriptor(),
            ignore_override=True,
        )
    return values
