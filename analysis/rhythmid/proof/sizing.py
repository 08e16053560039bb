"""The mismatch that a concealed effect leaves once the nominal model is refitted, and the strength that leaves a given one.

The one place where the proof uses the estimator: to know the size of what it conceals, before anything is sealed.
"""

import math
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from rhythmid.errors import InputError
from rhythmid.identify.free_run import prepare_run
from rhythmid.identify.noise import NoiseModel
from rhythmid.identify.output_error import minimise
from rhythmid.identify.series import Series, prepare
from rhythmid.model import Model
from rhythmid.proof.machine import Observation
from rhythmid.record.record import Channel, Record

Array = NDArray[np.float64]
BLOCK = 5  # samples averaged
STEP = 6.25e-4  # [s] of the fit's integrator: its error must not pass for a mismatch
CLOSE = 1.25  # factor within which a mismatch is the one asked for
TRIES = 7


def _series(
    times: Sequence[Array], commands: Sequence[Array], forcings: Sequence[Array], seen: Sequence[Observation]
) -> list[Series]:
    records = [
        Record(
            f"record {index}", Channel(one.stamps, one.measured, "m"), Channel(time, command, "N"),
            forcing=Channel(time, forcing, "N"),
        )
        for index, (time, command, forcing, one) in enumerate(zip(times, commands, forcings, seen))
    ]  # fmt: skip
    return prepare(records, BLOCK)


def mismatch(
    nominal: Model,
    times: Sequence[Array],
    commands: Sequence[Array],
    forcings: Sequence[Array],
    seen: Sequence[Observation] | None,
    scale: float,
) -> float:
    """Rms [m] that the nominal model leaves of noise-free records after a refit from its own values; infinite where it
    cannot follow them. `scale` [m] is what counts as small."""
    if seen is None:
        return math.inf
    try:
        series = _series(times, commands, forcings, seen)
        run = prepare_run(nominal, series, STEP)
        samples = sum(one.blocks for one in series)
        fit = minimise(
            nominal,
            run,
            tuple(nominal.free),
            NoiseModel(np.empty(0), scale),
            None,
            10,
            tolerance=1e-3 * samples,
        )
    except InputError:
        return math.inf
    return math.sqrt(fit.chi2 / fit.samples) * scale


def strength_for(target: float, ratio_at: Callable[[float], float]) -> tuple[float, float]:
    """Strength in (0, 1] at which `ratio_at` comes close to `target`, and the ratio there.

    Effects grow with a power of their strength, so the search goes by secants in logarithms, within the bracket that it has
    seen. Where the target is out of reach, the strength that comes nearest is returned; (0, 0) where there is none.
    """
    low, high = math.log(1e-7), 0.0
    place, power = math.log(0.05), 1.0
    points: list[tuple[float, float]] = []  # logarithms of strength and ratio
    for _ in range(TRIES):
        ratio = ratio_at(math.exp(place))
        usable = 0.0 < ratio < math.inf
        if usable:
            points.append((place, math.log(ratio)))
            if abs(math.log(ratio / target)) < math.log(CLOSE):
                break
        if ratio > target:
            high = place
        else:
            low = place
        if low >= 0.0:
            break
        if len(points) > 1 and points[-1][0] != points[-2][0]:
            slope = (points[-1][1] - points[-2][1]) / (points[-1][0] - points[-2][0])
            power = min(max(slope, 0.3), 4.0)
        step = math.log(target / ratio) / power if usable else math.copysign(1.5, target - ratio)
        if low < place + step < high:
            place += step
        else:
            place = 0.0 if high == 0.0 and step > 0.0 else 0.5 * (low + high)
    if not points:
        return 0.0, 0.0
    nearest = min(points, key=lambda point: abs(point[1] - math.log(target)))
    return math.exp(nearest[0]), math.exp(nearest[1])
