"""The largest command: limited by the peak effort, the envelope of the position, and the distortion."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from rhythmid.design.distortion import distortion
from rhythmid.design.rehearsal import Rehearsal
from rhythmid.design.requirements import Requirements
from rhythmid.errors import InputError

Limit = Literal["max_effort", "envelope", "max_distortion"]
NOISE_MARGIN = 5.0  # standard deviations of the measurement that must fit between position and envelope
STEPS = 14  # bisection steps
SMALLEST = 1e-3  # share of the largest effort below which a design is refused


@dataclass(frozen=True)
class Amplitude:
    """Peak effort [N], the limit that set it, and the range of the measured position [m] without noise."""

    peak: float
    limited_by: Limit
    low: float
    high: float


def largest_amplitude(
    rehearsal: Rehearsal,
    requirements: Requirements,
    settled: int,
    progress: Callable[[str], None] | None = None,
) -> Amplitude:
    """The largest peak effort within all limits, to 0.1 %; `settled` as for `distortion`.

    Raises InputError when the limit cycle alone leaves the envelope, or when almost no effort fits within it.
    """
    low, high = requirements.envelope
    margin = NOISE_MARGIN * requirements.noise_std

    def reach(amplitude: float) -> tuple[float, float]:
        output = rehearsal.output(amplitude)
        return float(output.min()), float(output.max())

    def limit(amplitude: float) -> Limit | None:
        if progress is not None:
            progress(f"choosing the amplitude: peak effort {amplitude:.4g}")
        least, most = reach(amplitude)
        if least - margin < low or most + margin > high:
            return "envelope"
        most_distorted = requirements.max_distortion
        if most_distorted is not None and distortion(rehearsal, amplitude, settled).total > most_distorted:
            return "max_distortion"
        return None

    least, most = reach(0.0)
    if least - margin < low or most + margin > high:
        forced = requirements.forced
        raise InputError(
            f"{'the limit cycle itself' if forced else 'the position at rest'}, measured with its noise, spans {least - margin:.6g} to "
            f"{most + margin:.6g} and leaves the envelope {low:g} to {high:g}; widen --envelope{' or lessen the forcing' if forced else ''}"
        )
    largest = requirements.max_effort
    found = limit(largest)
    if found is None:
        return Amplitude(largest, "max_effort", *reach(largest))
    inside, outside, limited = 0.0, largest, found
    for _ in range(STEPS):
        middle = 0.5 * (inside + outside)
        found = limit(middle)
        if found is None:
            inside = middle
        else:
            outside, limited = middle, found
        if outside - inside < 1e-3 * inside:
            break
    if inside < SMALLEST * largest:
        raise InputError(
            f"next to no command keeps the position within its limits: --{limited.replace('_', '-')} allows less than "
            f"{SMALLEST * largest:.2g} of the peak effort; widen it"
        )
    return Amplitude(inside, limited, *reach(inside))
