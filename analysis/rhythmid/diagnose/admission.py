"""Whether records can carry a diagnosis at all: what is clipped is left out, what drives the machine has to be known, and records
that are too short, too quiet or of one amplitude decide nothing."""

import math
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rhythmid.diagnose.answer.result import Diagnosis, MissingEffect
from rhythmid.diagnose.contradiction import contradiction
from rhythmid.diagnose.scoring import LOSES
from rhythmid.diagnose.search.forward import Search
from rhythmid.errors import InputError
from rhythmid.identify.series import Series, dominant_frequency, scales
from rhythmid.ltp.pumping import fundamental_frequency
from rhythmid.model import Model
from rhythmid.record.quality import clipped_samples
from rhythmid.record.record import Record

Array = NDArray[np.float64]
PERIODS = 4.0  # of the slowest motion that at least one record has to hold
ONE_AMPLITUDE = 1.2  # ratio of the largest motions to the smallest, below which all have one amplitude
QUIET = 0.03  # error that noise should make at most
NOISY = 0.3  # error of a model that leaves nothing but noise, relative to the motion, from which the records are too quiet
MOSTLY = 0.5  # share of clipped samples beyond which a record is useless
DECAYS = 0.7  # of the motion's size that a free decay keeps at most from its first quarter to its last


def without_clipped(record: Record) -> tuple[Record, tuple[str, ...]]:
    """The record without samples of the output at a limit of its sensor, and what there is to say of them.

    Raises InputError when most of the record is clipped.
    """
    channel = record.output
    bad = clipped_samples(channel.value)
    if not bad.any():
        return record, ()
    share = float(bad.mean())
    limits = " and ".join(f"{v:.6g}" for v in np.unique(channel.value[bad]))
    if share > MOSTLY:
        raise InputError(
            f"{record.name}: {100 * share:.0f} % of the output is clipped at {limits} {channel.unit}; choose a wider range of the sensor"
        )
    # the samples beside a limit are often half clipped by the sensor's own averaging
    near = bad | np.concatenate([[False], bad[:-1]]) | np.concatenate([bad[1:], [False]])
    kept = replace(channel, time=channel.time[~near], value=channel.value[~near])
    note = f"{record.name}: {int(bad.sum())} samples of the output ({100 * share:.2g} %) are clipped at {limits} {channel.unit} and left out"
    return replace(record, output=kept), (note,)


def check_driven(records: Sequence[Record], model: Model) -> str | None:
    """Raise InputError for motion that goes on with nothing recorded that drives it; a remark where only the forcing is known."""
    if model.term("periodic_forcing") is not None:
        return None
    for record in records:
        if record.input is not None or record.forcing is not None or record.reference is not None:
            continue
        quarters = np.array_split(record.output.value - record.output.value.mean(), 4)
        if float(np.std(quarters[-1])) > DECAYS * float(np.std(quarters[0])):
            raise InputError(
                f"{record.name}: has no input channel, and the motion does not decay, so something drives it that is not recorded; "
                f"name its channel under 'input:' (or 'forcing:') in signals.yaml"
            )
    forced = [record for record in records if record.forcing is not None]
    if forced and all(record.input is None for record in records):
        return "no record has an input channel: if anything but the forcing drove the machine, it counts as missing physics here"
    return None


@dataclass(frozen=True)
class Shortfall:
    """Why records decide nothing, and what to record instead; `fatal` where not even something unknown can be claimed."""

    reason: str
    experiment: str
    fatal: bool


def slowest(series: Series) -> float:
    """Frequency [Hz] of the slower of motion and forcing; at least half a period of it is in the series."""
    own = dominant_frequency(series)
    if series.forcing is None:
        return own
    inside = np.clip(series.centres, series.forcing.x[0], min(series.forcing.x[-1], 1e200))
    value = np.asarray(series.forcing(inside))
    if np.ptp(value) == 0.0:
        return own
    return max(
        min(own, fundamental_frequency(series.centres, value)), 0.5 / float(series.time[-1] - series.time[0])
    )


def amplitudes(series: Series, frequency: float) -> Array:
    """Size of the motion in windows of one period each: its standard deviation around the window's mean."""
    width = max(4, round(1.0 / (frequency * series.period * series.block)))
    count = series.blocks // width
    parts = series.averaged[: count * width].reshape(count, width)
    return parts.std(axis=1)


def shortfall_of(series: Sequence[Series], size: float) -> Shortfall | None:
    """What the records lack; `size` is that of the efforts in them, for the experiment that would help."""
    frequency = [slowest(one) for one in series]
    periods = [float(one.time[-1] - one.time[0]) * f for one, f in zip(series, frequency)]
    need = 20.0 / max(min(frequency), 1e-9)
    chirps = ", ".join(f"{factor * size:.3g}" for factor in (0.3, 1.0, 3.0))
    if max(periods) < PERIODS:
        return Shortfall(
            f"the records are too short: the longest holds {max(periods):.2g} periods of the slowest motion, and {PERIODS:g} are the least",
            f"record at least {need:.2g} s each of chirps or multisines of {chirps} (force)", True,
        )  # fmt: skip
    sizes = np.concatenate([amplitudes(one, f) for one, f in zip(series, frequency)])
    if len(sizes) and np.quantile(sizes, 0.95) < ONE_AMPLITUDE * np.quantile(sizes, 0.05):
        return Shortfall(
            "the motion has one amplitude throughout, at which friction looks like damping, a hardening spring like a stiffer one and a lag like a delay",
            f"record the same again with chirps or multisines of {chirps} (force) on top, {need:.2g} s each", False,
        )  # fmt: skip
    return None


def tempered(
    diagnosis: Diagnosis, series: Sequence[Series], found: Search, pool: ThreadPoolExecutor | None = None
) -> Diagnosis:
    """The diagnosis of these series, made `undecided` where they carry no verdict."""
    size = scales(series, found.nominal.model).effort
    shortfall = shortfall_of(series, size)
    left = diagnosis.detection.refitted_nominal_nrmse
    if (shortfall is None or not shortfall.fatal) and diagnosis.verdict == "consistent" and left > NOISY:
        shortfall = Shortfall(
            f"the records are too quiet: noise makes {100.0 * min(left, 1.0):.0f} % of what was measured",
            f"excite at least {max(2, math.ceil(left / QUIET))} times as strongly (the efforts were {size:.3g} rms)", False,
        )  # fmt: skip
    if shortfall is None and diagnosis.verdict == "consistent" and LOSES in diagnosis.scoring:
        shortfall = Shortfall(
            "in free run the nominal model loses the machine, and windows short enough to follow it show nothing missing: either something "
            "drives it that is not recorded, or an effect is too slow for such windows",
            "record everything that drives the machine, and once the cycle alone or a free decay", False,
        )  # fmt: skip
    unknown = diagnosis.verdict == "unknown_physics"
    if unknown and (shortfall is None or not shortfall.fatal):
        reason = contradiction(found, pool)
        if reason is None:
            return diagnosis
        shortfall = Shortfall(
            reason, "diagnose each record on its own, then record again whichever differs", True
        )
    if shortfall is None:
        return diagnosis
    return replace(
        diagnosis,
        verdict="undecided",
        summary=undecided(shortfall.reason, diagnosis.missing),
        next_experiment=shortfall.experiment,
    )


def undecided(reason: str, missing: Sequence[MissingEffect]) -> str:
    """The summary of a diagnosis that decides nothing."""
    names = " and ".join(effect.element.replace("_", " ") for effect in missing)
    return f"Undecided: {reason}." + (f" Best so far: {names}." if names else "")
