"""A case drawn at random: a machine, experiments, delays, noise, a wrong nominal model, and what is concealed."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import yaml
from numpy.typing import NDArray

from rhythmid.elements.catalogue import Catalogue, load_catalogue
from rhythmid.model import Model
from rhythmid.proof.machine import Effect, Forcing, Machine, Observation, observe
from rhythmid.proof.protocol import PUMPING, Run, draw_runs
from rhythmid.proof.sizes import EQUIVALENT, SIZES, Motion, motion_of
from rhythmid.proof.sizing import mismatch, strength_for

Array = NDArray[np.float64]
Kind = Literal["single", "pairs", "null", "left-out"]
NoiseKind = Literal["white", "coloured", "quantised"]
NOISES: tuple[NoiseKind, ...] = ("white", "coloured", "quantised")
KINDS: tuple[Kind, ...] = ("single", "null", "pairs", "left-out")
FAINTEST, STRONGEST = 0.3, 10.0  # mismatch in units of the noise
LONGEST_DELAY = {"input": 0.080, "measurement": 0.100}  # [s]
ATTEMPTS = 20


@dataclass(frozen=True)
class Noise:
    """Measurement noise of rms `std` [m]: white, coloured (first-order autoregressive), or with rounding to `step` [m]."""

    kind: NoiseKind
    std: float
    correlation: float = 0.0
    step: float = 0.0

    def corrupt(self, clean: Array, rng: np.random.Generator) -> Array:
        """The samples with noise."""
        white = rng.standard_normal(len(clean))
        if self.kind == "quantised":
            spread = math.sqrt(self.std**2 - self.step**2 / 12.0)
            return self.step * np.round((clean + spread * white) / self.step)
        if self.kind == "coloured":
            coloured = np.empty(len(clean))
            level = white[0]
            innovation = math.sqrt(1.0 - self.correlation**2)
            for k, draw in enumerate(white):
                level = self.correlation * level + innovation * draw if k else draw
                coloured[k] = level
            return clean + self.std * coloured
        return clean + self.std * white


@dataclass(frozen=True)
class Concealed:
    """An effect with the mismatch that it alone leaves, in units of the noise."""

    effect: Effect
    ratio: float


@dataclass(frozen=True)
class Case:
    """All that is to know of a case. `absent` names what the catalogue is robbed of before diagnosis."""

    name: str
    kind: Kind
    machine: Machine
    forcing: Forcing
    runs: tuple[Run, ...]
    unseen: tuple[Run, ...]
    input_delay: float
    measurement_delay: float
    noise: Noise
    concealed: tuple[Concealed, ...]
    absent: tuple[str, ...]
    ratio: float  # joint mismatch of all effects, in units of the noise
    nominal_error: float  # how wrong the nominal parameters are, largest relative error
    nominal: str  # the model that diagnosis is given, YAML
    start_ns: int

    @property
    def effects(self) -> tuple[Effect, ...]:
        return tuple(one.effect for one in self.concealed)

    def observe(self, run: Run) -> Observation | None:
        """The noise-free record of one run."""
        return observe_run(
            self.machine, self.effects, self.forcing, run, self.input_delay, self.measurement_delay
        )


def observe_run(
    machine: Machine,
    effects: Sequence[Effect],
    forcing: Forcing,
    run: Run,
    input_delay: float,
    measurement_delay: float,
) -> Observation | None:
    """The noise-free record of one run; None where the machine diverges."""
    scaled = replace(forcing, amplitude=forcing.amplitude * run.forcing)
    return observe(machine, effects, scaled, run.time, run.command, input_delay, measurement_delay)


def nominal_model(
    machine: Machine, delays: tuple[float, float] = (0.0, 0.0), known: Sequence[str] = ()
) -> str:
    """YAML of the nominal model: mass and gravity are known, all else is to be estimated but for what is `known`."""

    def parameter(name: str, value: float, unit: str) -> dict:
        return {"value": float(value), "unit": unit} | ({"fixed": True} if name in known else {})

    force: list[dict] = []
    if machine.gravity:
        force.append(
            {"gravity": {"acceleration": {"value": machine.gravity, "unit": "m/s^2", "fixed": True}}}
        )
    force.append(
        {
            "linear_spring": {
                "stiffness": parameter("stiffness", machine.stiffness, "N/m"),
                "rest_length": parameter("rest_length", machine.rest_length, "m"),
            }
        }
    )
    force.append(
        {
            "switched_damper": {
                "stance": parameter("damping", machine.damping, "N*s/m"),
                "flight": {"value": 0.0, "unit": "N*s/m", "fixed": True},
            }
        }
    )
    model = {
        "inertia": {"mass": {"value": machine.mass, "unit": "kg", "fixed": True}},
        "command": [{"input_delay": {"delay": {"value": delays[0], "unit": "s"}}}],
        "force": force,
        "sensor": [{"measurement_delay": {"delay": {"value": delays[1], "unit": "s"}}}],
    }
    return yaml.safe_dump(model, sort_keys=False)


def _draw_machine(rng: np.random.Generator) -> tuple[Machine, Forcing, float]:
    """A machine, its forcing, and the amplitude [m] of the limit cycle that was aimed at."""
    stiffness = math.exp(rng.uniform(math.log(50.0), math.log(800.0)))
    natural = rng.uniform(1.2, 3.5)
    mass = float(np.clip(stiffness / (2.0 * math.pi * natural) ** 2, 0.5, 3.0))
    natural = math.sqrt(stiffness / mass) / (2.0 * math.pi)
    damping = 2.0 * math.exp(rng.uniform(math.log(0.03), math.log(0.15))) * math.sqrt(stiffness * mass)
    gravity = 9.81 if rng.random() < 0.8 else 0.0
    machine = Machine(mass, stiffness, damping, rng.uniform(0.1, 0.4), gravity)
    away = [f for f in PUMPING if abs(f / natural - 1.0) > 0.25]
    pumping = float(rng.choice(away))
    cycle = math.exp(rng.uniform(math.log(0.003), math.log(0.010)))
    amplitude = cycle * stiffness * abs(1.0 - (pumping / natural) ** 2)
    return machine, Forcing(amplitude, pumping, rng.uniform(-math.pi, math.pi)), cycle


def draw_noise(rng: np.random.Generator, size: float, kind: NoiseKind | None = None) -> Noise:
    """Noise of 0.8 to 3 % of `size` [m]."""
    std = size * math.exp(rng.uniform(math.log(0.008), math.log(0.03)))
    kind = kind or NOISES[int(rng.choice(len(NOISES), p=[0.5, 0.3, 0.2]))]
    if kind == "coloured":
        return Noise("coloured", std, correlation=rng.uniform(0.5, 0.9))
    if kind == "quantised":
        return Noise("quantised", std, step=std * rng.uniform(1.0, 3.0))
    return Noise("white", std)


def wrong(machine: Machine, rng: np.random.Generator, known: Sequence[str]) -> tuple[Machine, float]:
    """The machine as somebody believes it to be: parameters that are not known are 5 to 50 % off."""
    level = math.exp(rng.uniform(math.log(0.05), math.log(0.5)))
    values, worst = {}, 0.0
    for name in ("stiffness", "damping", "rest_length"):
        if name in known:
            continue
        error = float(rng.choice([-1.0, 1.0])) * level * rng.uniform(0.5, 1.0)
        values[name] = getattr(machine, name) * (1.0 + error)
        worst = max(worst, abs(error))
    return replace(machine, **values), worst


def candidates(catalogue: Catalogue) -> list[tuple[str, ...]]:
    """Classes of effects that can be concealed: the catalogue's candidates for which there is an equation here; effects
    that make one and the same model form one class."""
    names = [name for name in SIZES if name in catalogue and catalogue[name].candidate]
    classes: list[tuple[str, ...]] = []
    for name in names:
        twins = next((group for group in EQUIVALENT if name in group), frozenset({name}))
        group = tuple(sorted(twins & set(names)))
        if group not in classes:
            classes.append(group)
    return classes


def related(catalogue: Catalogue, first: str, second: str) -> bool:
    """Whether two effects are of one family, or one is a special case of the other."""
    a, b = catalogue[first], catalogue[second]
    twins = any({first, second} <= group for group in EQUIVALENT)
    return (
        first == second or twins or (a.family != "" and a.family == b.family)
        or first in b.special_case_of or second in a.special_case_of
    )  # fmt: skip


def absent_with(catalogue: Catalogue, name: str) -> tuple[str, ...]:
    """What must leave the catalogue so that `name` is unknown to it: itself, what is the same model, what contains it."""
    gone = {name} | {twin for group in EQUIVALENT if name in group for twin in group}
    gone |= {richer for one in tuple(gone) for richer in catalogue[one].special_case_of}
    return tuple(sorted(gone & set(catalogue)))


def draw_case(seed: int, kind: Kind, index: int, catalogue: Catalogue | None = None) -> Case:
    """The case number `index` of a kind: always the same for the same seed.

    Effects take turns in an order shuffled by the seed. Machines and experiments in which the effect would not show are
    drawn anew.
    """
    known = catalogue or load_catalogue()
    names: list[str] = []
    for attempt in range(ATTEMPTS):
        rng = np.random.default_rng([seed, KINDS.index(kind), index, attempt])
        names = _names(seed, kind, index, known, rng)
        case = _draw(f"{kind}-{index:04d}", kind, names, index, known, rng)
        if case is not None:
            return case
    raise RuntimeError(f"no machine shows {' and '.join(names)} in {ATTEMPTS} attempts")


def _names(seed: int, kind: Kind, index: int, catalogue: Catalogue, rng: np.random.Generator) -> list[str]:
    if kind == "null":
        return []
    classes = candidates(catalogue)
    turn, place = divmod(index, len(classes))
    order = np.random.default_rng([seed, KINDS.index(kind), 1_000_000 + turn]).permutation(len(classes))
    first = str(rng.choice(classes[order[place]]))
    if kind != "pairs":
        return [first]
    others = [str(rng.choice(group)) for group in classes]
    return [first, str(rng.choice([name for name in others if not related(catalogue, first, name)]))]


def _draw(
    label: str, kind: Kind, names: Sequence[str], index: int, catalogue: Catalogue, rng: np.random.Generator
) -> Case | None:
    machine, forcing, cycle = _draw_machine(rng)
    natural = math.sqrt(machine.stiffness / machine.mass) / (2.0 * math.pi)
    runs, unseen = draw_runs(rng, forcing.amplitude, natural, forcing.frequency)
    delays = rng.uniform(0.0, LONGEST_DELAY["input"]), rng.uniform(0.0, LONGEST_DELAY["measurement"])
    noise = draw_noise(rng, cycle, NOISES[index % len(NOISES)] if kind == "null" else None)
    # friction that differs by direction shows its level only where the rest length has been measured
    fixed = ("rest_length",) if "asymmetric_coulomb_friction" in names else ()
    believed, error = wrong(machine, rng, fixed)
    exact = Model.from_text(nominal_model(machine, delays, fixed), catalogue=catalogue)
    times, commands = [run.time for run in runs], [run.command for run in runs]
    forcings = [run.forcing * forcing(run.time) for run in runs]

    def seen(effects: Sequence[Effect]) -> list[Observation] | None:
        found = [observe_run(machine, effects, forcing, run, *delays) for run in runs]
        return [one for one in found if one is not None] if None not in found else None

    def ratio(effects: Sequence[Effect], nominal: Model = exact) -> float:
        return mismatch(nominal, times, commands, forcings, seen(effects), noise.std) / noise.std

    plain = seen([])
    if plain is None:
        return None
    motion: Motion = motion_of(machine, forcing, runs, plain)
    concealed: list[Concealed] = []
    for name in names:
        sized = SIZES[name](rng, motion)
        target = math.exp(rng.uniform(math.log(FAINTEST), math.log(STRONGEST)))
        strength, reached = strength_for(target, lambda s: ratio([Effect(name, sized(s))]))  # noqa: B023
        if not FAINTEST <= reached <= 1.2 * STRONGEST:
            return None
        concealed.append(Concealed(Effect(name, sized(strength)), reached))
    effects = [one.effect for one in concealed]
    for effect in effects if len(effects) > 1 else ():  # one may hide the other: each must show beside it
        beside = next(other for other in effects if other is not effect)
        if ratio(effects, exact.with_element(catalogue[beside.name], beside.parameters)) < FAINTEST:
            return None
    joint = concealed[0].ratio if len(concealed) == 1 else ratio(effects)
    if not math.isfinite(joint):
        return None
    start_ns = 0 if rng.random() < 0.5 else int(rng.integers(1_500_000_000, 1_900_000_000)) * 1_000_000_000
    case = Case(
        label, kind, machine, forcing, runs, unseen, *delays, noise, tuple(concealed),
        absent_with(catalogue, names[0]) if kind == "left-out" else (), joint, error,
        nominal_model(believed, known=fixed), start_ns,
    )  # fmt: skip
    return case if all(case.observe(run) is not None for run in unseen) else None
