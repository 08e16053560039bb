"""Size of a concealed effect: detectable and of practical size, or, as clutter, hardly detectable."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rhythmid.elements.catalogue import Catalogue
from rhythmid.model import Model
from rhythmid.proof.equations import FOREIGN
from rhythmid.proof.machine import Effect, Observation
from rhythmid.proof.machines.rig import Rig, log_uniform
from rhythmid.proof.noise import Noise
from rhythmid.proof.sizes import SIZES, Motion, Sized
from rhythmid.proof.sizing import force_share, mismatch, strength_for

FAINTEST, STRONGEST = 0.3, 10.0  # limits of the mismatch in units of the noise
# A diagnosis ignores effects below 0.3 % of the motion as of no practical size; a concealed effect must be clearly above that.
LEAST_MOTION = 0.005  # smallest mismatch, rms as a share of the motion
LEAST_EFFORT, MOST_EFFORT = (
    0.01,
    0.5,
)  # limits of the mismatch, rms as a share of the effort, where it is a force
CLUTTER = 3  # small effects beside the main one
CLUTTER_SHARE = (0.005, 0.1)  # as a share of the main one's mismatch
# as a share of the motion, for each of the small effects where there is no main one
NULL_CLUTTER = (3e-4, 1.5e-3)
NULL_CLUTTER_MOST = 3e-3  # the same for all together
CLUTTER_CLOSE, CLUTTER_TRIES = 1.6, 4  # tolerance factor and number of tries for a small effect's size


@dataclass(frozen=True)
class Concealed:
    """An effect and the mismatch that it alone causes: `ratio` in units of the noise, `share` of the motion or effort."""

    effect: Effect
    ratio: float
    share: float = 0.0


@dataclass(frozen=True)
class Yardstick:
    """Measures mismatches on a rig whose nominal model `exact` is complete; its attributes `free` are fitted.

    `motion` is the rms of the measured motion [m]. `noise` is the rms of the noise relative to the motion, or to the effort where
    mismatches are measured there (`by_effort`). `least` is the share below which an effect has no practical size.
    """

    rig: Rig
    exact: Model
    free: tuple[str, ...]
    motion: float
    noise: float
    by_effort: bool
    least: float

    @classmethod
    def of(
        cls,
        rig: Rig,
        exact: Model,
        free: Sequence[str],
        noise: Noise,
        by_effort: bool,
        plain: Sequence[Observation],
    ) -> "Yardstick":
        """The yardstick of a rig whose records without concealed effects are `plain`."""
        measured = [one.measured for one in plain]
        if rig.recorded == "base":
            measured = [y - run.command for y, run in zip(measured, rig.runs)]
        motion = float(np.std(np.concatenate(measured)))
        share = rig.effort_noise if by_effort and rig.effort_noise else noise.std / motion
        least = LEAST_EFFORT if by_effort else LEAST_MOTION
        return cls(rig, exact, tuple(free), motion, share, by_effort, least)

    def share(self, effects: Sequence[Effect], nominal: Model | None = None, small: float = 1.0) -> float:
        """Mismatch caused by these effects, as a share of the motion or the effort; `small`: accuracy in units of the noise."""
        seen = self.rig.observe_all(effects)
        if self.by_effort:
            return force_share(self.rig, seen, self.free)
        scale = self.noise * self.motion * min(1.0, small)
        return mismatch(nominal or self.exact, self.rig, seen, scale) / self.motion

    def ratio(self, effects: Sequence[Effect], nominal: Model | None = None) -> float:
        """The same in units of the noise."""
        return self.share(effects, nominal) / self.noise

    def lacking(self, rig: Rig, effects: Sequence[Effect] = ()) -> float:
        """Share of the driving force that the believed machine of `rig` lacks, compared with the real one with these effects."""
        return force_share(rig, rig.observe_all(effects), self.free)

    def joint(self, rig: Rig, effects: Sequence[Effect]) -> float:
        """Mismatch of all effects together in units of the noise, including what the believed machine of `rig` lacks."""
        if rig.lacks is not None:
            return self.lacking(rig, effects) / self.noise
        return self.ratio(effects) if effects else 0.0


def faintest(stick: Yardstick) -> float:
    """Smallest mismatch, in units of the noise, that counts as concealed: detectable and of practical size."""
    return max(FAINTEST, stick.least / stick.noise)


def sized_effect(
    stick: Yardstick, name: str, sized: Sized, target: float, least: float, most: float
) -> Concealed | None:
    """The effect with the strength that causes the mismatch `target` [units of the noise]; None where it is out of bounds."""
    strength, reached = strength_for(target, lambda s: stick.ratio([Effect(name, sized(s))]))
    if not least <= reached <= most:
        return None
    return Concealed(Effect(name, sized(strength)), reached, reached * stick.noise)


def stands_out(stick: Yardstick, effect: Effect, every: Sequence[Effect], catalogue: Catalogue) -> bool:
    """Whether `effect` is detectable and of practical size where all of `every` act, as it is where it acts alone.

    Other effects may mask it: a small one that damps the motion, too, ends it before a stiffness is seen. Asked is what a model that
    has all others of the catalogue leaves after a refit. Not tested where mismatches are measured in the effort.
    """
    if stick.by_effort or len(every) == 1:
        return True
    known = stick.exact
    for other in every:
        if other is not effect and other.name in catalogue:
            known = known.with_element(catalogue[other.name], other.parameters)
    return stick.ratio(every, known) >= faintest(stick)


def put_clutter(
    rng: np.random.Generator, stick: Yardstick, motion: Motion, pool: Sequence[str], main: float | None
) -> tuple[Concealed, ...] | None:
    """Three small effects, one or two of them not in the catalogue; None where they cannot be made small.

    `main` is the share of the main effect's mismatch, None where there is no main effect.
    """
    foreign = list(rng.permutation(list(FOREIGN)))
    ordinary = list(rng.permutation(list(pool)))
    count = int(rng.integers(1, 3))
    found: list[Concealed] = []
    for group, wanted in ((foreign, count), (ordinary, CLUTTER - count)):
        taken = 0
        for name in group:
            if taken == wanted:
                break
            low, high = CLUTTER_SHARE if main is not None else NULL_CLUTTER
            target = log_uniform(rng, low, high) * (main if main is not None else 1.0)
            made = _small(stick, str(name), SIZES[name](rng, motion), target)
            if made is not None:
                found.append(made)
                taken += 1
    if len(found) < CLUTTER:
        return None
    if main is None and not stick.share([one.effect for one in found]) <= NULL_CLUTTER_MOST:
        return None
    return tuple(found)


def _small(stick: Yardstick, name: str, sized: Sized, target: float) -> Concealed | None:
    small = target / stick.noise

    def share(strength: float) -> float:
        return stick.share([Effect(name, sized(strength))], small=small)

    strength, reached = strength_for(target, share, CLUTTER_CLOSE, CLUTTER_TRIES)
    if not strength or not math.isfinite(reached) or abs(math.log(reached / target)) > math.log(2.0):
        return None
    return Concealed(Effect(name, sized(strength)), reached / stick.noise, reached)
