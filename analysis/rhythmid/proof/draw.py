"""A randomly drawn case: a machine, experiments, delays, noise, a wrong nominal model, and the concealed effects."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from rhythmid.elements.catalogue import Catalogue, load_catalogue
from rhythmid.model import Model
from rhythmid.proof.concealment import (
    MOST_EFFORT,
    STRONGEST,
    Concealed,
    Yardstick,
    faintest,
    put_clutter,
    sized_effect,
    stands_out,
)
from rhythmid.proof.machine import Effect, Observation
from rhythmid.proof.machines.designs import DESIGNS
from rhythmid.proof.machines.rig import Design, Rig, log_uniform
from rhythmid.proof.noise import NOISES, Log, Noise, draw_log, draw_noise
from rhythmid.proof.nominal import free_attributes, nominal_model, wrong
from rhythmid.proof.protocol import Run
from rhythmid.proof.sizes import EQUIVALENT, SIZES, Motion, motion_of
from rhythmid.proof.sizing import with_shift

Kind = Literal["single", "pairs", "null", "left-out"]
KINDS: tuple[Kind, ...] = ("single", "null", "pairs", "left-out")
ATTEMPTS = 20
BEYOND = 1.2  # factor by which an effect may exceed the largest requested size
LACKED = "pendulum_gravity"  # part of a machine that a nominal model may lack, not an effect added to it


@dataclass(frozen=True)
class Case:
    """All data of a case.

    `absent` are the elements removed from the catalogue before the diagnosis. `concealed` are the effects to be named, `clutter`
    small effects beside them. `ratio` is the joint mismatch of all in units of the noise. `nominal_error` is the largest relative
    error of the nominal parameters. `nominal` is the model that the diagnosis is given (YAML).
    """

    name: str
    kind: Kind
    design: str
    cluttered: bool
    rig: Rig
    noise: Noise
    log: Log
    concealed: tuple[Concealed, ...]
    clutter: tuple[Concealed, ...]
    absent: tuple[str, ...]
    ratio: float
    nominal_error: float
    nominal: str
    start_ns: int

    @property
    def effects(self) -> tuple[Effect, ...]:
        """All effects that act, including clutter."""
        return tuple(one.effect for one in (*self.concealed, *self.clutter))

    @property
    def true_parameters(self) -> dict[str, float]:
        """True values of the parameters that the nominal model estimates, by name; including delays."""
        design = DESIGNS[self.design]
        values = {
            name: float(getattr(self.rig.machine, attribute))
            for name, attribute in design.unknown.items()
            if getattr(self.rig.believed, attribute) or attribute == "rest_length"
        }
        delays = {"input": self.rig.input_delay, "measurement": self.rig.measurement_delay}
        return values | {f"{which}_delay.delay": delays[which] for which in design.delays}

    def observe(self, run: Run) -> Observation | None:
        """The noise-free record of one run; None where the machine diverges."""
        return self.rig.observe(self.effects, run)


def candidates(catalogue: Catalogue, design: Design) -> list[tuple[str, ...]]:
    """Classes of effects that a machine can conceal.

    They are the catalogue's candidates that have an equation here. Effects that give the same model form one class.
    """
    names = [
        name
        for name in (*SIZES, LACKED)
        if name in design.effects and name in catalogue and catalogue[name].candidate
    ]
    classes: list[tuple[str, ...]] = []
    for name in names:
        twins = next((group for group in EQUIVALENT if name in group), frozenset({name}))
        group = tuple(sorted(twins & set(names)))
        if group not in classes:
            classes.append(group)
    return classes


# effects that are the sum of two others: a friction that differs by direction equals one that does not plus a constant force
SUMS = {"asymmetric_coulomb_friction": ("constant_force",)}


def related(catalogue: Catalogue, first: str, second: str) -> bool:
    """Whether two effects are of one family, one is a special case of the other, or their sum is a third effect."""
    a, b = catalogue[first], catalogue[second]
    twins = any({first, second} <= group for group in EQUIVALENT)
    third = any(
        (one.name in parts and whole in (other.name, *other.special_case_of))
        for whole, parts in SUMS.items()
        for one, other in ((a, b), (b, a))
    )
    return (
        first == second or twins or third or (a.family != "" and a.family == b.family)
        or first in b.special_case_of or second in a.special_case_of
    )  # fmt: skip


def absent_with(catalogue: Catalogue, name: str, alike: frozenset[str] = frozenset()) -> tuple[str, ...]:
    """Elements to remove from the catalogue so that `name` is unknown to it.

    They are the element itself; equivalent ones (on a machine for which the effects in `alike` are indistinguishable); those whose
    sum with others is equivalent to it; and those that contain any of these.
    """
    same = [group for group in (*EQUIVALENT, alike) if name in group]
    gone = {name, *SUMS.get(name, ())}.union(*same)
    gone |= {richer for one in tuple(gone) for richer in catalogue[one].special_case_of}
    return tuple(sorted(gone & set(catalogue)))


def draw_case(
    seed: int,
    kind: Kind,
    index: int,
    catalogue: Catalogue | None = None,
    design: str = "hopper",
    cluttered: bool = False,
) -> Case:
    """The case number `index` of a kind on one type of machine, deterministic for a given seed.

    Effects take turns in an order shuffled by the seed. Machines and experiments in which the effect would not be detectable are
    drawn again.
    """
    known = catalogue or load_catalogue()
    made = DESIGNS[design]
    label = f"{kind}{'-cluttered' if cluttered else ''}-{design}-{index:04d}"
    stream = [seed, KINDS.index(kind), index]
    # seeds that distinguish campaigns come last, so that clean hopper cases are the same as in earlier versions
    apart = [list(DESIGNS).index(design), int(cluttered)] if design != "hopper" or cluttered else []
    names: list[str] = []
    for attempt in range(ATTEMPTS):
        rng = np.random.default_rng([*stream, attempt, *apart])
        names = _names([seed, KINDS.index(kind)], kind, index, known, made, apart, rng)
        case = _draw(label, kind, names, index, known, made, cluttered, rng)
        if case is not None:
            return case
    raise RuntimeError(f"no {design} shows {' and '.join(names) or 'nothing'} in {ATTEMPTS} attempts")


def _names(
    stream: list[int], kind: Kind, index: int, catalogue: Catalogue, design: Design, apart: list[int],
    rng: np.random.Generator,
) -> list[str]:  # fmt: skip
    if kind == "null":
        return []
    classes = candidates(catalogue, design)
    turn, place = divmod(index, len(classes))
    order = np.random.default_rng([*stream, 1_000_000 + turn, *apart]).permutation(len(classes))
    first = str(rng.choice(classes[order[place]]))
    if kind != "pairs":
        return [first]
    others = [str(rng.choice(group)) for group in classes]
    return [first, str(rng.choice([name for name in others if not related(catalogue, first, name)]))]


def _draw(
    label: str, kind: Kind, names: Sequence[str], index: int, catalogue: Catalogue, design: Design, cluttered: bool,
    rng: np.random.Generator,
) -> Case | None:  # fmt: skip
    rig = design.draw(rng, names)
    fixed = design.known(names)
    free = free_attributes(design, fixed)
    if cluttered:
        noise = draw_noise(rng, rig.scale, "coloured", design.noise)
        rig = replace(rig, lag=rng.normal(0.0, 0.5) / rig.runs[0].rate) if rig.recorded == "effort" else rig
    else:
        noise = draw_noise(
            rng, rig.scale, NOISES[index % len(NOISES)] if kind == "null" else None, design.noise
        )
    believed, error = wrong(rig.believed, rng, [name for name in free if getattr(rig.believed, name)])
    delays = (rig.input_delay, rig.measurement_delay)
    complete = replace(rig, believed=rig.machine, lacks=None)
    exact = Model.from_text(nominal_model(complete, design, rig.machine, fixed, delays), catalogue=catalogue)
    exact = with_shift(exact, rig, catalogue)
    plain = complete.observe_all([])
    if plain is None:
        return None
    motion = motion_of(rig.machine, rig.forcing, rig.runs, plain)
    stick = Yardstick.of(complete, exact, free, noise, design.by_effort, plain)
    concealed = _conceal(names, rig, stick, motion, catalogue, rng)
    if concealed is None:
        return None
    clutter: tuple[Concealed, ...] | None = ()
    if cluttered:
        pool = [name for name in design.effects if name != LACKED and name in catalogue]
        pool = [name for name in pool if not any(related(catalogue, name, other) for other in names)]
        clutter = put_clutter(rng, stick, motion, pool, min((one.share for one in concealed), default=None))
    if clutter is None:
        return None
    added = [one.effect for one in concealed if one.effect != rig.lacks]
    every = [*added, *(one.effect for one in clutter)]
    if not all(stands_out(stick, effect, every, catalogue) for effect in added):
        return None
    joint = concealed[0].ratio if len(concealed) == 1 and not clutter else stick.joint(rig, every)
    if not math.isfinite(joint):
        return None
    start_ns = 0 if rng.random() < 0.5 else int(rng.integers(1_500_000_000, 1_900_000_000)) * 1_000_000_000
    nominal = nominal_model(rig, design, believed, fixed)
    gone = absent_with(catalogue, names[0], design.alike) if kind == "left-out" else ()
    used = {term.element.name for term in Model.from_text(nominal, catalogue=catalogue).terms}
    case = Case(
        label, kind, design.name, cluttered, rig, noise, draw_log(rng, noise) if cluttered else Log(), concealed,
        clutter, tuple(name for name in gone if name not in used), joint, error, nominal, start_ns,
    )  # fmt: skip
    return case if all(case.observe(run) is not None for run in (*rig.runs, *rig.unseen)) else None


def _conceal(
    names: Sequence[str],
    rig: Rig,
    stick: Yardstick,
    motion: Motion,
    catalogue: Catalogue,
    rng: np.random.Generator,
) -> tuple[Concealed, ...] | None:
    """The effects to be named, each of a detectable size; None where this is impossible on this rig."""
    least, most = faintest(stick), MOST_EFFORT / stick.noise if stick.by_effort else STRONGEST
    if least > most:
        return None
    concealed: list[Concealed] = []
    for name in names:
        if rig.lacks is not None and name == rig.lacks.name:
            share = stick.lacking(rig)
            found = Concealed(rig.lacks, share / stick.noise, share) if share >= stick.least else None
        else:
            target = log_uniform(rng, least, most)
            found = sized_effect(stick, name, SIZES[name](rng, motion), target, least, BEYOND * most)
        if found is None:
            return None
        concealed.append(found)
    return tuple(concealed)
