"""A joint in the quantities of a simulator: inertia, damping, friction, stiffness, and an actuator with gain, lag and delay."""

import math
from collections.abc import Collection
from dataclasses import dataclass, field, fields
from typing import Any, Literal

from rhythmid.units import ROTATIONAL, TRANSLATIONAL, Units

DIGITS = 12  # significant digits of a number in a target's file: more than any parameter is determined to
Control = Literal["force", "position", "velocity"]


def _quantity(unit: str, meaning: str, absent: float = 0.0) -> Any:
    """A field in `unit` (of a translational joint); at the value `absent` the joint behaves as without it."""
    return field(default=absent, metadata={"unit": unit, "meaning": meaning})


def number(value: float) -> str:
    """A number as text with DIGITS digits, so that products of parameters show no rounding errors."""
    return repr(float(f"{value:.{DIGITS}g}"))


@dataclass(frozen=True)
class Quantity:
    """One number of a joint: its name in `Joint`, value, SI unit, and what it is."""

    name: str
    value: float
    unit: str
    meaning: str

    def __str__(self) -> str:
        unit = "" if self.unit == "1" else f" {self.unit}"
        return f"{self.name} {self.value:.6g}{unit} ({self.meaning})"


@dataclass(frozen=True)
class Joint:
    """One joint, in SI units: kg, m, N of a prismatic joint, kg*m^2, rad, N*m of a revolute one (REP-103).

    The actuator's force is `gain` times the delayed and lagged command (`control` "force"), or times
    `position_gain` (r - x) - `velocity_gain` v ("position"), or times `velocity_gain` (r - v) ("velocity"), with the
    delayed and lagged command as r. `remarks` name the effects of the model that these quantities express only approximately, or not at all.
    """

    name: str
    rotational: bool
    inertia: float = field(metadata={"unit": "kg", "meaning": "all that moves: link and rotor"})
    gravity: float = _quantity("m/s^2", "weight of the inertia along -x")
    weight_moment: float = _quantity("N", "gravity torque m g l of a link")
    hanging_position: float = _quantity("m", "angle at which the link hangs at rest")
    damping: float = _quantity("N*s/m", "viscous damping")
    quadratic_damping: float = _quantity("N*s^2/m^2", "damping with the square of the speed")
    friction: float = _quantity("N", "dry friction while sliding")
    friction_regularisation: float = _quantity(
        "1/kg", "regularisation of the dry friction, where that is a constraint"
    )
    friction_lead: float = _quantity("s", "by how much such a friction turns before the velocity")
    static_friction: float = _quantity("N", "dry friction at rest, where it is larger than while sliding")
    stiffness: float = _quantity("N/m", "spring stiffness")
    spring_reference: float = _quantity("m", "position at which the spring is free")
    quadratic_stiffness: float = _quantity("N/m^2", "stiffness with the square of the displacement")
    cubic_stiffness: float = _quantity("N/m^3", "stiffness with the cube of the displacement")
    constant_force: float = _quantity("N", "constant force along +x")
    position_gain: float = _quantity("N/m", "proportional gain of the joint's controller")
    velocity_gain: float = _quantity("N*s/m", "derivative or speed gain of the joint's controller")
    command_delay: float = _quantity("s", "delay of the command")
    command_lag: float = _quantity("s", "time constant of the command's low-pass")
    gain: float = _quantity("1", "force over commanded force", absent=1.0)
    actuator_lag: float = _quantity("s", "time constant of the actuator's force")
    actuator_delay: float = _quantity("s", "dead time of the actuator's force")
    effort_limit: float = _quantity("N", "largest force of the actuator", absent=math.inf)
    measurement_delay: float = _quantity("s", "delay of the measured position")
    control: Control = "force"
    remarks: tuple[str, ...] = ()

    @property
    def units(self) -> Units:
        """Units of force, position and inertia."""
        return ROTATIONAL if self.rotational else TRANSLATIONAL

    def unit(self, name: str) -> str:
        """SI unit of the quantity called `name`."""
        return next(self.units.of(one.metadata["unit"]) for one in fields(self) if one.name == name)

    @property
    def quantities(self) -> tuple[Quantity, ...]:
        """All numbers that differ from their neutral values, in the order of the fields."""
        return tuple(
            Quantity(one.name, value, self.unit(one.name), one.metadata["meaning"])
            for one in fields(self)
            if "unit" in one.metadata and (value := getattr(self, one.name)) != one.default
        )

    def inexpressible(self, expressed: Collection[str]) -> tuple[str, ...]:
        """The remarks, and a line for every quantity that is not among the `expressed` ones of a target."""
        missing = (one for one in self.quantities if one.name not in expressed)
        return (*self.remarks, *(f"not expressed: {one}" for one in missing))
