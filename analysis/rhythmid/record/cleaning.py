"""Cleaning: removes samples of the output that do not show the machine's position. It is the first step of every
analysis."""

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from rhythmid.errors import InputError
from rhythmid.record.angle_wrap import unwrapped, wrap_notes
from rhythmid.record.joint_notes import notes_of_joints
from rhythmid.record.joint_record import JointRecord
from rhythmid.record.outlier import outlying_samples, repeated_samples
from rhythmid.record.quality import clipped_samples
from rhythmid.record.record import Record
from rhythmid.record.rest_at_ends import rest_notes

Mask = NDArray[np.bool_]
Reason = Literal["outlier", "repeated", "clipped"]
MOSTLY = 0.5  # share of clipped samples above which a record is unusable
# ratio of a single acceleration peak to the range of all other samples, above which it cannot be an impact with its
# ringing
BEYOND = 10.0
WORDS: dict[Reason, str] = {
    "outlier": "stand far off their neighbours",
    "repeated": "repeat the one before while the motion goes on",
    "clipped": "are clipped{at}, or neighbours of such,",
}
# outliers come first: an outlier beyond a sensor's limit would hide the clipping
FINDERS: tuple[tuple[Reason, Callable[[NDArray[np.float64]], Mask]], ...] = (
    ("outlier", outlying_samples),
    ("repeated", repeated_samples),
    ("clipped", clipped_samples),
)


@dataclass(frozen=True)
class LeftOut:
    """Samples of an output that are left out for one reason: `count` of `total`, the first at `first` [s]; for
    clipped samples the `limits`, in words."""

    reason: Reason
    count: int
    total: int
    first: float
    limits: str = ""

    @property
    def words(self) -> str:
        """What is left out, in one sentence."""
        at = f" at {self.limits}" if self.limits else ""
        return (
            f"samples of the output that {WORDS[self.reason].format(at=at)} are left out, {self.count} of {self.total}, "
            f"the first at t = {self.first:.6g} s"
        )

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        return {
            "channel": "output",
            "reason": self.reason,
            "count": self.count,
            "total": self.total,
            "first": self.first,
        }


@dataclass(frozen=True, eq=False)
class Cleaned:
    """A cleaned record, the samples that were left out, and further messages about its output."""

    record: Record
    left_out: tuple[LeftOut, ...]
    told: tuple[str, ...] = ()

    @property
    def notes(self) -> tuple[str, ...]:
        """Messages about left-out samples and the output, one line each."""
        return tuple(f"{self.record.name}: {words}" for words in self.words)

    @property
    def words(self) -> tuple[str, ...]:
        """The notes without the record's name."""
        return (*(one.words for one in self.left_out), *self.told)


def cleaned(record: Record) -> Cleaned:
    """The record without outliers, repeated and clipped samples of the output, and with angles unwrapped.

    An acceleration keeps its outliers, because impacts do cause such peaks. The neighbours of clipped samples are
    left out, too: the sensor's own averaging often clips half of them. Raises InputError when most of the record is
    clipped.
    """
    total, found, wraps = len(record.output), [], wrap_notes(record)
    record = unwrapped(record)
    for reason, find in FINDERS:
        channel = record.output
        bad = find(channel.value)
        if not bad.any() or (reason == "outlier" and record.output_kind == "acceleration"):
            continue
        limits = ""
        if reason == "clipped":
            values = " and ".join(f"{v:.6g}" for v in np.unique(channel.value[bad]))
            limits = f"{values} {channel.unit}".rstrip()
            if bad.mean() > MOSTLY:
                raise InputError(
                    f"{record.name}: {100 * bad.mean():.0f} % of the output is clipped at {limits} or rests there ({channel.source}); choose a "
                    "wider range of the sensor, or another channel"
                )
            bad = bad | np.append(bad[1:], False) | np.insert(bad[:-1], 0, False)
        found.append(LeftOut(reason, int(bad.sum()), total, float(channel.time[bad][0]), limits))
        record = replace(record, output=replace(channel, time=channel.time[~bad], value=channel.value[~bad]))
    return Cleaned(record, tuple(found), (*placeholder_notes(record), *wraps, *rest_notes(record)))


def placeholder_notes(record: Record) -> tuple[str, ...]:
    """Messages about numbers that stand for no measurement, one for the channels that have the same ones."""
    roles: dict[tuple[str, int], list[str]] = {}
    for role, quality in record.quality.channels.items():
        if quality.placeholders:
            roles.setdefault((quality.placeholder, quality.placeholders), []).append(role)
    return tuple(
        f"{' and '.join(alike)}: {count} samples hold exactly {number}, far beyond all others and without a sample in between: that "
        "stands for nothing measured, and they are left out"
        for (number, count), alike in roles.items()
    )


def peak_note(record: Record) -> str | None:
    """Message about single acceleration peaks that are far above the other values and are kept; None where there
    are none."""
    value = record.output.value
    if record.output_kind != "acceleration" or not (peaks := outlying_samples(value)).any():
        return None
    span = float(np.ptp(value[~peaks]))
    far = peaks & (np.abs(value - np.median(value)) > BEYOND * span)
    if not far.any():
        return None
    first = float(record.output.time[far][0])
    return (
        f"output: {far.sum()} of {len(value)} samples stand far off, the first at t = {first:.6g} s with {value[far][0]:.6g}, where all "
        f"others span {span:.3g} {record.output.unit}; they are kept, because an impact may be one; take out what a wire or a bit made"
    )


def cleaned_joints(
    records: Sequence[JointRecord], turning: Collection[str] = ()
) -> tuple[list[JointRecord], tuple[str, ...]]:
    """The recordings of a machine with each joint's record cleaned, and messages about it, one line each; the positions of `turning` joints are angles."""
    made, notes = [], []
    for whole in (one.in_rad(turning) for one in records):
        joints = {joint: cleaned(record) for joint, record in whole.joints.items()}
        base = None if whole.base is None else cleaned(whole.base)
        parts = joints if base is None else {**joints, "base": base}
        told = notes_of_joints({joint: found.words for joint, found in parts.items()})
        notes += [f"{whole.name}, {words}" for words in told]
        made.append(
            replace(
                whole,
                joints={joint: found.record for joint, found in joints.items()},
                base=None if base is None else base.record,
            )
        )
    return made, tuple(notes)
