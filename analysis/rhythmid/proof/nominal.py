"""The nominal model of a machine as a user would write it: known values are fixed, the others have to be estimated."""

from collections.abc import Collection
from dataclasses import replace
from typing import Any

import numpy as np
import yaml

from rhythmid.proof.machine import Machine
from rhythmid.proof.machines.rig import Design, Rig, log_uniform

FARTHEST, NEAREST = 0.5, 0.05  # limits of the relative error of unknown values


def free_attributes(design: Design, known: Collection[str] = ()) -> list[str]:
    """Attributes of the machine that the nominal model has to estimate."""
    return [name for name in design.unknown.values() if name not in known]


def nominal_model(
    rig: Rig,
    design: Design,
    machine: Machine,
    known: Collection[str] = (),
    delays: tuple[float, float] = (0.0, 0.0),
) -> str:
    """YAML of the nominal model that describes `machine` with `delays` [s] of command and measurement."""
    free = free_attributes(design, known)
    force, position = rig.units
    turning = position == "rad"

    def parameter(name: str, unit: str, value: float | None = None) -> dict[str, Any]:
        given = float(getattr(machine, name) if value is None else value)
        return {"value": given, "unit": unit} | ({} if name in free else {"fixed": True})

    terms: list[dict[str, Any]] = []
    if machine.gravity:
        terms.append({"gravity": {"acceleration": parameter("gravity", "m/s^2")}})
    if machine.stiffness:
        rest = parameter("rest_length", position)
        terms.append(
            {
                "linear_spring": {
                    "stiffness": parameter("stiffness", f"{force}/{position}"),
                    "rest_length": rest,
                }
            }
        )
    damping = f"{force}*s/{position}"
    if machine.return_damping:
        terms.append({"viscous_damper": {"damping": parameter("damping", damping)}})
    elif machine.damping:
        flight = parameter("return_damping", damping)
        terms.append({"switched_damper": {"stance": parameter("damping", damping), "flight": flight}})
    if machine.moment:
        gravity = {"moment": parameter("moment", force), "reference": parameter("hanging", position)}
        terms.append({"pendulum_gravity": gravity})
    command: list[dict[str, Any]] = []
    if "input" in design.delays:
        command.append({"input_delay": {"delay": {"value": delays[0], "unit": "s"}}})
    if machine.mode == "continuous":
        gains = {
            "proportional": parameter("proportional", f"{force}/{position}"),
            "derivative": parameter("derivative", damping),
        }
        command.append({"position_control": gains})
    model: dict[str, Any] = {"inertia": {"mass": parameter("mass", "kg*m^2" if turning else "kg")}}
    if (force, position) not in (("N", "m"), ("N*m", "rad")):
        model = {"units": {"force": force, "position": position}} | model
        model["inertia"]["mass"].pop("unit")
    if command:
        model["command"] = command
    if terms:
        model["force"] = terms
    if "measurement" in design.delays:
        model["sensor"] = [{"measurement_delay": {"delay": {"value": delays[1], "unit": "s"}}}]
    return yaml.safe_dump(model, sort_keys=False)


def wrong(machine: Machine, rng: np.random.Generator, names: Collection[str]) -> tuple[Machine, float]:
    """The machine with wrong values, and the largest relative error: the attributes `names` are 5 to 50 % off."""
    level = log_uniform(rng, NEAREST, FARTHEST)
    values, worst = {}, 0.0
    for name in names:
        error = float(rng.choice([-1.0, 1.0])) * level * rng.uniform(0.5, 1.0)
        values[name] = getattr(machine, name) * (1.0 + error)
        worst = max(worst, abs(error))
    if "damping" in values and machine.return_damping:
        values["return_damping"] = values["damping"]
    return replace(machine, **values), worst
