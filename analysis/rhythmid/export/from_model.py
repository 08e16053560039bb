"""A model's elements as quantities of a simulator: what a simulator can express becomes a number of the joint, the rest a remark."""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from rhythmid.errors import InputError
from rhythmid.export.joint import Control, Joint
from rhythmid.model import Model, Term
from rhythmid.units import ROTATIONAL, TRANSLATIONAL, Units, mass_unit

NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")  # a name that all targets accept
Values = Mapping[str, float]


@dataclass
class _Reading:
    """The joint so far, while the model's terms are read in the order of the signal path."""

    mass: float
    rotational: bool
    numbers: dict[str, float] = field(default_factory=dict)
    remarks: list[str] = field(default_factory=list)
    control: Control = "force"
    back_emf: float = 0.0  # damping by a motor's back-EMF, scaled by later gains
    springs: int = 0
    soft_friction: float = 0.0  # the part of the dry friction that is a constraint

    def get(self, name: str, absent: float = 0.0) -> float:
        return self.numbers.get(name, absent)

    def add(self, name: str, value: float) -> None:
        self.numbers[name] = self.get(name) + value

    def nearly(self, term: Term, how: str) -> None:
        self.remarks.append(f"only nearly expressed: {_described(term)}; {how}")

    def left_out(self, term: Term) -> None:
        self.remarks.append(f"not expressed: {_described(term)}")


def joint_of(model: Model, name: str) -> Joint:
    """The model's one joint, called `name`.

    Raises InputError if the units are not SI, the name is not valid in all targets, or two controllers close the loop.
    """
    if NAME.fullmatch(name) is None:
        raise InputError(
            f"--joint {name!r}: a joint's name has letters, digits and underscores, and begins with no digit"
        )
    if not _si(model.units):
        raise InputError(
            f"the model is in {model.units.mass}, {model.units.position} and {model.units.force}; simulators take SI: "
            "kg, m, N or kg*m^2, rad, N*m; scale the channels in signals.yaml and identify again"
        )
    reading = _Reading(model.mass.value, model.units.position == "rad")
    for term in model.terms:
        values = term.numbers
        if term.element.size and values.get(term.element.size) == term.element.absent:
            continue
        READERS.get(term.element.name, _unknown)(reading, term, values)
    _finish(reading)
    return Joint(
        name,
        reading.rotational,
        reading.mass,
        control=reading.control,
        remarks=tuple(reading.remarks),
        **reading.numbers,
    )


def _si(units: Units) -> bool:
    """Whether units are SI, with any name of the inertia's unit."""
    known = {(one.force, one.position): one for one in (TRANSLATIONAL, ROTATIONAL)}
    one = known.get((units.force, units.position))
    return one is not None and units.mass in (one.mass, mass_unit(one.force, one.position))


def _described(term: Term) -> str:
    """Label, equation and values of a term."""
    values = ", ".join(
        f"{name} {one.value:.6g}{'' if one.unit == '1' else ' ' + one.unit}"
        for name, one in term.values.items()
    )
    whole = f"{term.label}, {term.element.equation}" + (f", with {values}" if values else "")
    return " ".join(whole.split())  # a comment is one line


def _finish(reading: _Reading) -> None:
    if reading.back_emf:
        reading.add("damping", reading.back_emf)
    if reading.soft_friction and reading.get("friction") != reading.soft_friction:
        reading.remarks.append(
            "only nearly expressed: two dry frictions; both turn as the one that is a constraint does"
        )
    curved = reading.get("quadratic_stiffness") or reading.get("cubic_stiffness")
    if curved and reading.springs > 1:
        reading.remarks.append(
            "only nearly expressed: springs of several rest lengths; the nonlinear one is taken from their mean"
        )
    stiffness = reading.get("stiffness")
    if stiffness > 0.0 and not curved and (force := reading.numbers.pop("constant_force", 0.0)):
        reading.add("spring_reference", force / stiffness)


def _unknown(reading: _Reading, term: Term, values: Values) -> None:
    reading.left_out(term)


def _gravity(reading: _Reading, term: Term, values: Values) -> None:
    if reading.rotational:
        reading.add("constant_force", -reading.mass * values["acceleration"])
    else:
        reading.add("gravity", values["acceleration"])


def _pendulum_gravity(reading: _Reading, term: Term, values: Values) -> None:
    if not reading.rotational or reading.get("weight_moment"):
        return reading.left_out(term)
    reading.numbers |= {"weight_moment": values["moment"], "hanging_position": values["reference"]}


def _linear_spring(reading: _Reading, term: Term, values: Values) -> None:
    before, added = reading.get("stiffness"), values["stiffness"]
    reference = before * reading.get("spring_reference") + added * values["rest_length"]
    reading.numbers |= {"stiffness": before + added, "spring_reference": reference / (before + added)}
    reading.springs += 1


def _switched_damper(reading: _Reading, term: Term, values: Values) -> None:
    stance, flight = values["stance"], values["flight"]
    reading.add("damping", 0.5 * (stance + flight))
    if stance != flight:
        reading.nearly(term, "damping takes the mean of both directions")


def _flight_damping(reading: _Reading, term: Term, values: Values) -> None:
    reading.add("damping", 0.5 * values["damping"])
    reading.nearly(term, "damping takes the mean of both directions")


def _asymmetric_friction(reading: _Reading, term: Term, values: Values) -> None:
    reading.add("friction", values["force"])
    if values["asymmetry"]:
        reading.nearly(term, "friction takes the mean of both directions")


def _falling_friction(reading: _Reading, term: Term, values: Values) -> None:
    reading.add("friction", values["force"])
    if values["static_ratio"] > 1.0:
        reading.numbers["static_friction"] = reading.get("friction") + values["force"] * (
            values["static_ratio"] - 1.0
        )
    reading.nearly(term, "friction takes the force while sliding, and that at rest where the target has one")


def _soft_friction(reading: _Reading, term: Term, values: Values) -> None:
    reading.add("friction", values["force"])
    reading.soft_friction = values["force"]
    softness = values["softness"] / reading.mass
    reading.numbers |= {"friction_regularisation": softness, "friction_lead": values["lead"]}


def _sum_into(name: str, parameter: str) -> Callable[[_Reading, Term, Values], None]:
    def read(reading: _Reading, term: Term, values: Values) -> None:
        reading.add(name, values[parameter])

    return read


def _controller(control: Control, position: str, velocity: str) -> Callable[[_Reading, Term, Values], None]:
    def read(reading: _Reading, term: Term, values: Values) -> None:
        if reading.control != "force":
            raise InputError(f"{term.label}: the model has two controllers; no simulator's joint has both")
        reading.control = control
        reading.numbers |= {"position_gain": values.get(position, 0.0), "velocity_gain": values[velocity]}

    return read


def _scale(reading: _Reading, factor: float) -> None:
    reading.numbers["gain"] = reading.get("gain", 1.0) * factor
    reading.back_emf *= factor
    if "effort_limit" in reading.numbers:
        reading.numbers["effort_limit"] *= factor


def _actuator_gain(reading: _Reading, term: Term, values: Values) -> None:
    _scale(reading, values["gain"])


def _dc_motor(reading: _Reading, term: Term, values: Values) -> None:
    """A force k_t V_s / R times the command, and a damping k_t^2 / R."""
    torque_constant, resistance, supply = (values[n] for n in ("torque_constant", "resistance", "supply"))
    if resistance <= 0.0:
        raise InputError(f"{term.label}: the resistance is 0; the motor's gain is not finite")
    _scale(reading, torque_constant * supply / resistance)
    reading.back_emf += torque_constant**2 / resistance
    command = "in V" if supply == 1.0 else f"as a share of {supply:.6g} V"
    reading.remarks.append(
        f"{term.label}: the motor takes its command {command}; gain and damping stand for it"
    )


def _actuator_lag(reading: _Reading, term: Term, values: Values) -> None:
    reading.add("actuator_lag", values["time_constant"])
    if reading.back_emf:
        reading.nearly(term, "the motor's back-EMF is not lagged")
    if "effort_limit" in reading.numbers:
        reading.nearly(term, "the force is limited behind the lag, not before it")


def _actuator_delay(reading: _Reading, term: Term, values: Values) -> None:
    reading.add("actuator_delay", values["delay"])
    if reading.back_emf:
        reading.nearly(term, "the motor's back-EMF is not delayed")


def _saturation(reading: _Reading, term: Term, values: Values) -> None:
    limits = [values["limit"], *(value for name, value in reading.numbers.items() if name == "effort_limit")]
    reading.numbers["effort_limit"] = min(limits)
    if reading.back_emf:
        reading.nearly(term, "the motor's back-EMF is not limited")


READERS: Mapping[str, Callable[[_Reading, Term, Values], None]] = {
    "gravity": _gravity,
    "pendulum_gravity": _pendulum_gravity,
    "constant_force": _sum_into("constant_force", "force"),
    "linear_spring": _linear_spring,
    "quadratic_stiffness": _sum_into("quadratic_stiffness", "coefficient"),
    "cubic_stiffness": _sum_into("cubic_stiffness", "coefficient"),
    "viscous_damper": _sum_into("damping", "damping"),
    "switched_damper": _switched_damper,
    "flight_damping": _flight_damping,
    "quadratic_drag": _sum_into("quadratic_damping", "coefficient"),
    "quadratic_damping": _sum_into("quadratic_damping", "coefficient"),
    "coulomb_friction": _sum_into("friction", "force"),
    "asymmetric_coulomb_friction": _asymmetric_friction,
    "soft_constraint_friction": _soft_friction,
    "stribeck_friction": _falling_friction,
    "lugre_friction": _falling_friction,
    "input_delay": _sum_into("command_delay", "delay"),
    "command_lag": _sum_into("command_lag", "time_constant"),
    "position_control": _controller("position", "proportional", "derivative"),
    "velocity_control": _controller("velocity", "", "gain"),
    "actuator_gain": _actuator_gain,
    "dc_motor": _dc_motor,
    "actuator_lag": _actuator_lag,
    "actuator_delay": _actuator_delay,
    "actuator_saturation": _saturation,
    "measurement_delay": _sum_into("measurement_delay", "delay"),
}
