"""Calibration: noise, random forces and statistics of a machine known to be healthy, from its first minute.

A constant force that the model lacks (a slightly wrong rest length, weight or offset) is estimated first. The filter corrects for it
only once a segment. The model's speed would therefore be a sawtooth relative to the machine's, and so would the sensitivities to
each change.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import comb

import numpy as np
from numpy.typing import NDArray

from rhythmid.elements.catalogue import Catalogue
from rhythmid.errors import InputError
from rhythmid.identify.motion_band import block_length
from rhythmid.identify.noise import NoiseModel, estimate_noise
from rhythmid.model import Model
from rhythmid.record.timing import nominal_period
from rhythmid.twin.changes import Change, watched
from rhythmid.twin.detector import Healthy, learn_healthy
from rhythmid.twin.lateness import Doubt, possible_lateness
from rhythmid.twin.observer import Filter, Innovations, Observer
from rhythmid.twin.samples import Samples
from rhythmid.twin.score import Whitener
from rhythmid.twin.segment import Simulation
from rhythmid.twin.settings import Settings

Array = NDArray[np.float64]
SEGMENT = 0.2  # [s]
BLOCKS = 4  # minimum number of blocks in a segment
# candidate random changes of speed in a segment, relative to the usual speed
KICKS = (1e-5, 1e-4, 1e-3, 1e-2, 1e-1)
TUNED = 60  # segments for tuning the random forces
PASSES = 3  # largest number of passes for each candidate
FORCE_PASSES = 3  # passes for the constant force, each with a filter tuned to the remainder
# relative change of the noise's variance from pass to pass that counts as converged
CONVERGED_VARIANCE_CHANGE = 0.1
SETTLED = 15  # segments until the initial state is forgotten: three seconds of the minute
ROUGH = 3  # order of differences that keep the measurement's noise and remove its motion
LEAST_NOISE_SHARE = 1e-9  # smallest noise as a share of the motion; no sensor is better
CONSTANT = "constant_force.force"
UNNOTICED = 0.01  # share of the innovations' squares below which a constant force does not disturb the filter
LOST = 0.5  # ratio of innovations to motion from which the model does not describe this machine


@dataclass(frozen=True)
class Calibration:
    """The twin's knowledge of the healthy machine.

    `nrmse` is the ratio of the innovations to the motion. `sizes` (p,) are the scales of the changes, `filter` the filter's
    parameters.
    """

    model: Model
    changes: tuple[Change, ...]
    period: float
    filter: Filter
    sizes: Array
    noise: NoiseModel
    healthy: Healthy
    nrmse: float

    @property
    def constant_force(self) -> float:
        """The constant force of the model, including the estimated part; in the model's unit of force."""
        return self.model.value(CONSTANT) if CONSTANT in self.model.parameters else 0.0

    @property
    def segment(self) -> float:
        """Length of a segment [s]."""
        return self.filter.samples * self.period


@dataclass(frozen=True)
class Stretch:
    """Samples of the healthy machine, in segments of `size` samples that are averaged over blocks of `block` samples.

    `late` is the lateness of each measurement [s].
    """

    output: Samples
    late: Array
    command: Samples
    forcing: Samples | None
    block: int
    size: int

    @property
    def pieces(self) -> list[slice]:
        """The samples of each segment."""
        return segments(self.output.time, self.size)

    def innovations(self, observer: Observer, pieces: Sequence[slice]) -> list[Innovations]:
        """Innovations of these segments, without those where the model diverges or the measurements are too late."""
        time, value = self.output.time, self.output.value
        doubts = self.doubts(pieces)
        found = [
            observer.take(time[at], value[at], doubt, self.command, self.forcing)
            for at, doubt in zip(pieces, doubts)
        ]
        return [one for one, doubt in zip(found, doubts) if one is not None and doubt.punctual]

    def doubts(self, pieces: Sequence[slice]) -> list[Doubt]:
        """Uncertainty of the times in these segments. Raises InputError where most of them are too late to be used."""
        doubts = [Doubt.of(self.output.time, self.late, at.start, at.stop) for at in pieces]
        if sum(doubt.punctual for doubt in doubts) < max(len(doubts) // 2, SETTLED + 1):
            raise InputError(
                "most measurements of the healthy stretch came too late to be used; use a quieter computer"
            )
        return doubts


def segments(time: Array, size: int) -> list[slice]:
    """All complete segments of `size` samples."""
    return [slice(i, i + size) for i in range(0, len(time) - size + 1, size)]


def calibrate(
    model: Model,
    catalogue: Catalogue,
    settings: Settings,
    output: Samples,
    command: Samples,
    forcing: Samples | None,
) -> Calibration:
    """Calibrate on a stretch of the healthy machine's samples.

    Raises InputError where the stretch shows no motion, or a motion that the model does not reproduce.
    """
    period = nominal_period(np.diff(output.time))
    speed = _speed(output, period, settings)
    if not speed > 0.0:
        raise InputError(
            "the healthy stretch shows no motion: a machine at rest shows nothing of its physics"
        )
    block = block_length(output.value, period)
    size = max(round(SEGMENT / period), BLOCKS)
    block = max(1, min(block, size // BLOCKS))
    size = size // block * block
    extended, changes = watched(model, catalogue, speed, settings.input_kind)
    simulation = Simulation(extended, changes, settings, period)
    scatter = _scatter(simulation, output, period, settings)
    stretch = Stretch(output, possible_lateness(output.time, period), command, forcing, block, size)
    force = model.mass.value * speed**2 / max(float(np.std(output.value)), 1e-300)
    sizes = np.array([_size(extended.value(c.name), c, force, speed, scatter[0]) for c in changes])
    filter, found = _followed(simulation, stretch, scatter, sizes)
    for _ in range(FORCE_PASSES):
        constant, share = _constant_force(found, changes)
        if share < UNNOTICED:
            break
        extended = extended.with_values({CONSTANT: extended.value(CONSTANT) + constant})
        simulation = Simulation(extended, changes, settings, period)
        filter, found = _followed(simulation, stretch, scatter, sizes)
    noise = estimate_noise([np.concatenate([one.white for one in found])])
    whitener = Whitener(noise, len(changes))
    scores = [whitener(one) for one in found]
    healthy = learn_healthy(scores[1:], size * period, settings.false_alarms)
    nrmse = float(np.sqrt(np.mean([one.rms**2 for one in found]))) / float(np.std(output.value))
    if not nrmse < LOST:
        raise InputError(
            f"the model leaves {100.0 * nrmse:.0f} % of the motion in the healthy stretch unexplained: it is not a model of this "
            "machine; identify the machine first"
        )
    return Calibration(extended, changes, period, filter, sizes, noise, healthy, nrmse)


def _speed(output: Samples, period: float, settings: Settings) -> float:
    """Usual speed of the motion, in the model's unit."""
    if settings.output_kind == "velocity":
        return float(np.std(output.value))
    block = block_length(output.value, period)
    kept = output.value[: len(output.value) // block * block].reshape(-1, block).mean(axis=1)
    return float(np.std(np.gradient(kept, block * period)))


def _scatter(simulation: Simulation, output: Samples, period: float, settings: Settings) -> Array:
    """First guess of the usual sizes of the states."""
    scatter = np.full(simulation.states, 1e-3)
    speed = _speed(output, period, settings)
    scatter[1] = speed
    scatter[0] = float(np.std(output.value)) if settings.output_kind == "position" else speed
    return scatter


def _size(value: float, change: Change, force: float, speed: float, position: float) -> float:
    """Usual size of a parameter: its value or, where that is zero, a typical value for its unit."""
    if value != 0.0:
        return abs(value)
    unit = change.unit
    if unit in ("N", "N*m"):
        return force
    if unit in ("N*s/m", "N*m*s/rad"):
        return force / speed
    return position if unit in ("m", "rad") else 1.0


def _followed(
    simulation: Simulation, stretch: Stretch, scatter: Array, sizes: Array
) -> tuple[Filter, list[Innovations]]:
    """The filter tuned to the machine, and its innovations with their sensitivities to changes, without the initial transient."""
    filter = _tuned(simulation, stretch, scatter)
    return filter, stretch.innovations(Observer(simulation, filter, sizes), stretch.pieces)[SETTLED:]


def _constant_force(found: Sequence[Innovations], changes: Sequence[Change]) -> tuple[float, float]:
    """The constant force estimated from the innovations, and the share of their squares that it explains."""
    names = [change.name for change in changes]
    if CONSTANT not in names:
        return 0.0, 0.0
    white = np.concatenate([one.white for one in found])
    shown = np.concatenate([one.by_change[:, names.index(CONSTANT)] for one in found])
    information = float(shown @ shown)
    if not information > 0.0:
        return 0.0, 0.0
    force = float(shown @ white) / information
    return force, force**2 * information / max(float(white @ white), 1e-300)


def _tuned(simulation: Simulation, stretch: Stretch, scatter: Array) -> Filter:
    """Noise and random forces that maximise the likelihood of the innovations.

    For each candidate of the random forces the noise is estimated from its own innovations.
    """
    some, block, value = stretch.pieces[: SETTLED + TUNED], stretch.block, stretch.output.value
    averaged = value[: len(value) // block * block].reshape(-1, block).mean(axis=1)
    rough = float(np.var(np.diff(averaged, ROUGH)))
    punctual = sum(doubt.punctual for doubt in stretch.doubts(some))
    noise = max(rough / comb(2 * ROUGH, ROUGH), (LEAST_NOISE_SHARE * scatter[0]) ** 2, 1e-300)
    best, best_density = None, -np.inf
    for kick in KICKS:
        for _ in range(PASSES):
            given = Filter(noise, (kick * scatter[1]) ** 2, scatter, block, stretch.size)
            found = stretch.innovations(Observer(simulation, given, None), some)[SETTLED:]
            if len(found) < punctual // 2:
                break
            squares = float(np.mean([np.mean(one.white**2) for one in found]))
            density = sum(one.log_density for one in found)
            if density > best_density:
                best, best_density = given, density
            noise = max(noise * min(max(squares, 0.1), 10.0), 1e-300)
            if abs(squares - 1.0) < CONVERGED_VARIANCE_CHANGE:
                break
    if best is None:
        raise InputError("the model diverges from the healthy machine's motion; identify the machine first")
    return best
