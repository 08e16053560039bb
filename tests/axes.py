"""Records of an axis under control with its motor's force, and of a frame on a moving base, for tests of inverse dynamics.

Integrated here, by a symplectic Euler step of 1 ms or less, and not by the simulator that is under test.
"""

from functools import lru_cache

import numpy as np

from rhythmid.elements.catalogue import load_catalogue
from rhythmid.model import Model
from rhythmid.record.record import Channel, Record
from rhythmid.record.signals import InputKind, OutputKind

CATALOGUE = load_catalogue()
STEP, RATE, LONG = 1e-3, 250.0, 20.0  # [s], [Hz], [s]


def axis_model(more: str = "", mass: str = "{value: 1.3, unit: kg}") -> Model:
    """Mass and damping of an axis, both wrong."""
    return Model.from_text(
        f"inertia: {{mass: {mass}}}\n{more}\nforce:\n"
        "  - viscous_damper: {damping: {value: 3.0, unit: N*s/m}}\n",
        catalogue=CATALOGUE,
    )


def arm_model() -> Model:
    """An arm's joint of which inertia and damping are thought of."""
    return Model.from_text(
        "inertia: {mass: {value: 1.3, unit: kg*m^2}}\nforce:\n"
        "  - viscous_damper: {damping: {value: 3.0, unit: N*m*s/rad}}\n",
        catalogue=CATALOGUE,
    )


@lru_cache
def axis(
    seed: int = 0,
    friction: float = 0.8,
    noise: float = 0.05,
    jitter: float = 0.1,
    gravity: float = 0.0,
    amplitude: float = 1.0,
    free: bool = False,
    length: float = LONG,
    load: float = 0.0,
) -> Record:
    """An axis of 1 kg with 2 N s/m and Coulomb friction [N] that follows five sines under PD control; position and force with
    noise (a share of the force), stamps jittered by a share of the sample period. With `gravity` [N m] its position is an
    angle; `free`, it is a spring's mass in a light oscillation that hardly any force drives. `load` is the share of the motor's force that acts as friction, too."""
    rng = np.random.default_rng(seed)
    count = round(length / STEP)
    time = STEP * np.arange(count)
    lines = np.array([0.2, 0.5, 0.9, 1.4, 2.3])
    turns = 2.0 * np.pi * lines[:, None] * time + rng.uniform(0.0, 2.0 * np.pi, 5)[:, None]
    size = amplitude * np.array([0.2, 0.12, 0.08, 0.05, 0.02])
    reference = size @ np.sin(turns)
    rate = (size * 2.0 * np.pi * lines) @ np.cos(turns)
    x, v = float(reference[0]), float(rate[0])
    position, effort = np.empty(count), np.empty(count)
    for i in range(count):
        u = 400.0 * (reference[i] - x) + 40.0 * (rate[i] - v)
        force = -2.0 * v - (friction + load * abs(u)) * np.tanh(v / 4e-3) - gravity * np.sin(x)
        if free:
            u, force = 0.05 * reference[i], -100.0 * x - 0.02 * v
        position[i], effort[i] = x, u
        v += STEP * (u + force)
        x += STEP * v
    every = slice(None, None, round(1.0 / (RATE * STEP)))
    time, position, effort = time[every], position[every], effort[every]
    position = position + 1e-5 * rng.standard_normal(len(time))
    effort = effort + noise * effort.std() * rng.standard_normal(len(time))
    stamps = time + jitter / RATE * rng.uniform(-0.5, 0.5, len(time))
    if jitter:
        position, effort = np.interp(stamps, time, position), np.interp(stamps, time, effort)
    unit = ("rad", "N*m") if gravity else ("m", "N")
    return Record(
        f"axis {seed}", Channel(stamps, position, unit[0]), Channel(stamps, effort, unit[1]), hold="linear"
    )


def frame_model() -> Model:
    """A mass on a spring and a damper, both wrong."""
    return Model.from_text(
        "inertia: {mass: {value: 1.0, unit: kg, fixed: true}}\nforce:\n"
        "  - linear_spring: {stiffness: {value: 120.0, unit: N/m}, rest_length: {value: 0.0, unit: m}}\n"
        "  - viscous_damper: {damping: {value: 3.0, unit: N*s/m}}\n",
        catalogue=CATALOGUE,
    )


@lru_cache
def frame(
    kind: InputKind = "base_displacement", measured: OutputKind = "position", friction: float = 0.0
) -> Record:
    """A mass of 1 kg on 150 N/m and 1.5 N s/m, with dry friction [N] against its base, which moves by twelve sines."""
    rng = np.random.default_rng(0)
    step, rate = 2.5e-4, 200.0
    time = step * np.arange(round(20.0 / step))
    lines = np.linspace(0.5, 5.0, 12)
    turns = 2.0 * np.pi * lines[:, None] * time + rng.uniform(0.0, 2.0 * np.pi, 12)[:, None]
    base = 0.004 * np.sin(turns).sum(axis=0)
    base_rate = 0.004 * (2.0 * np.pi * lines) @ np.cos(turns)
    base_acceleration = -0.004 * (2.0 * np.pi * lines) ** 2 @ np.sin(turns)
    x = v = 0.0  # in the room
    position, acceleration = np.empty(len(time)), np.empty(len(time))
    for i in range(len(time)):
        q, w = x - base[i], v - base_rate[i]
        a = -150.0 * q - 1.5 * w - friction * np.tanh(w / 1e-3)
        position[i], acceleration[i] = x, a
        v += step * a
        x += step * v
    every = slice(None, None, round(1.0 / (rate * step)))
    if measured == "position":
        value = (position if kind == "base_displacement" else position - base)[every]
        value = value + 2e-5 * rng.standard_normal(len(value))
    else:
        value = acceleration[every]
        value = value + 0.01 * value.std() * rng.standard_normal(len(value))
    drive = (base if kind == "base_displacement" else base_acceleration)[every]
    time = time[every]
    return Record(
        "frame", Channel(time, value, "m"), Channel(time, drive, "m"), hold="linear", input_kind=kind,
        output_kind=measured,
    )  # fmt: skip
