"""A machine with its experiments and the knowledge of it: a case without effects and noise."""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from rhythmid.proof.machine import UNFORCED, Effect, Forcing, Machine, Observation, observe
from rhythmid.proof.protocol import Run

Array = NDArray[np.float64]
Rng = np.random.Generator
FINER = 8  # knots of a smooth command for each sample
# the recorded channel that drives the machine
Recorded = Literal["command", "effort", "base", "reference", "nothing"]


@dataclass(frozen=True)
class Rig:
    """All of a case without effects and noise.

    `believed` is the machine as its nominal model describes it, with correct values. `lacks` is the effect that is part of the
    machine but not of that description. `recorded` is the signal logged beside the motion. `scale` [m] or [m/s] is the size to
    which the measurement's noise is proportional. `effort_noise` is the relative rms noise of the effort. `lag` [s] is the time by
    which the logged motion is older than the signal beside it.
    """

    machine: Machine
    believed: Machine
    runs: tuple[Run, ...]
    unseen: tuple[Run, ...]
    scale: float
    recorded: Recorded
    forcing: Forcing = UNFORCED
    input_delay: float = 0.0
    measurement_delay: float = 0.0
    velocity: bool = False
    effort_noise: float = 0.0
    lacks: Effect | None = None
    units: tuple[str, str] = ("N", "m")
    lag: float = 0.0

    def observe(self, effects: Sequence[Effect], run: Run) -> Observation | None:
        """The noise-free record of one run; None where the machine diverges."""
        scaled = replace(self.forcing, amplitude=self.forcing.amplitude * run.forcing)
        inside = [effect for effect in effects if effect != self.lacks]
        moved = self.recorded == "base"
        # the motion of a base is smooth between samples, too
        sent = replace(run, rate=FINER * run.rate) if moved else run
        return observe(
            self.machine, inside, scaled, sent.time, sent.command, self.input_delay, self.measurement_delay,
            slopes=sent.slopes if moved else None, start=run.start, velocity=self.velocity, samples=run.time, lag=self.lag,
        )  # fmt: skip

    def observe_all(self, effects: Sequence[Effect]) -> list[Observation] | None:
        """The records to fit; None where the machine diverges in one of them."""
        found = [self.observe(effects, run) for run in self.runs]
        kept = [one for one in found if one is not None]
        return kept if len(kept) == len(found) else None


@dataclass(frozen=True)
class Design:
    """A type of machine.

    `effects` are those of the catalogue that it may conceal. `draw` makes such a machine on which they are detectable. `unknown` maps
    parameters of the nominal model that have to be estimated to attributes of the machine. `by_effort`: a mismatch is measured in
    the effort, because a free run of such a machine is not meaningful. `noise` is the range of the measurement's noise relative to
    the rig's scale. `delays`: nominal delays are part of the model. `alike` are effects that no record of such a machine separates.
    """

    name: str
    effects: tuple[str, ...]
    draw: Callable[[Rng, Sequence[str]], Rig]
    unknown: Mapping[str, str]
    noise: tuple[float, float]
    by_effort: bool = False
    delays: Collection[str] = ()
    bags: bool = False
    known_with: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    alike: frozenset[str] = frozenset()

    def known(self, effects: Sequence[str]) -> tuple[str, ...]:
        """Attributes that are known when these effects are concealed, because they have been measured."""
        return tuple(name for effect in effects for name in self.known_with.get(effect, ()))


# indistinguishable in a linear machine with one input
LAGS = frozenset({"command_lag", "actuator_lag", "sensor_lag"})


def log_uniform(rng: Rng, low: float, high: float) -> float:
    """A random value, uniform in its logarithm."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))
