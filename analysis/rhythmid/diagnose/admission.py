"""Which records a diagnosis can use: outliers and clipped samples are left out, what drives the machine has to be known, and
records of one diagnosis have to come from one machine in one set of units."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rhythmid.errors import InputError
from rhythmid.identify.drive import drive_of, driven
from rhythmid.identify.series import Series, prepare
from rhythmid.model import Model
from rhythmid.record.gaps import cut_at_gaps
from rhythmid.record.outlier import without_outliers
from rhythmid.record.punctuality import punctuality_notes
from rhythmid.record.quality import clipped_samples
from rhythmid.record.record import Record

Array = NDArray[np.float64]
MOST_CLIPPED = 0.5  # share of clipped samples beyond which a record is useless
DECAYS = 0.7  # of the motion's size from the first quarter to the last, above which it may be driven


@dataclass(frozen=True)
class Admitted:
    """Records and held-out records as they are judged, cut where commands are missing; and what there is to say of them."""

    records: tuple[Record, ...]
    holdout: tuple[Record, ...]
    notes: tuple[str, ...]


def admitted(records: Sequence[Record], holdout: Sequence[Record], model: Model) -> Admitted:
    """The records and the held-out ones made tidy, driven by what drives the model, and cut where that is missing.

    Raises InputError for records that cannot be judged.
    """
    whole = (*records, *holdout)
    remark = check_driven(whole, model)
    tidy = [without_outliers(record) for record in whole]
    cleaned = [without_clipped(record) for record, _ in tidy]
    given = tuple(driven(record, model) for record, _ in cleaned)
    check_comparable(prepare(given))
    cut = [cut_at_gaps(record) for record in given]
    notes = dict.fromkeys(
        (
            remark,
            *(f"{one.name}: {note}" for one in whole for note in punctuality_notes(one.run)),
            *(note for _, said in (*tidy, *cleaned) for note in said),
            *(drive_of(a, b) for (a, _), b in zip(cleaned, given)),
            *(note for one in cut for note in one.notes),
        )
    )
    learnt, unseen = (
        tuple(stretch for one in part for stretch in one.stretches)
        for part in (cut[: len(records)], cut[len(records) :])
    )
    return Admitted(learnt, unseen, tuple(note for note in notes if note is not None))


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
    if share > MOST_CLIPPED:
        raise InputError(
            f"{record.name}: {100 * share:.0f} % of the output is clipped at {limits} {channel.unit}; choose a wider range of the sensor"
        )
    # the samples beside a limit are often half clipped by the sensor's own averaging
    near = bad | np.concatenate([[False], bad[:-1]]) | np.concatenate([bad[1:], [False]])
    kept = replace(channel, time=channel.time[~near], value=channel.value[~near])
    note = f"{record.name}: {int(bad.sum())} samples of the output ({100 * share:.2g} %) are clipped at {limits} {channel.unit} and left out"
    return replace(record, output=kept), (note,)


def check_driven(records: Sequence[Record], model: Model) -> str | None:
    """A remark where what drives the machine is not recorded, as far as that shows: a free decay needs nothing that does."""
    if model.term("periodic_forcing") is not None:
        return None
    for record in records:
        if record.input is not None or record.forcing is not None or record.reference is not None:
            continue
        quarters = np.array_split(record.output.value - record.output.value.mean(), 4)
        if float(np.std(quarters[-1])) > DECAYS * float(np.std(quarters[0])):
            return (
                f"{record.name}: has no input channel, and the motion hardly decays: whatever drives it counts as missing physics "
                "here; name its channel under 'input:' (or 'forcing:') in signals.yaml"
            )
    forced = [record for record in records if record.forcing is not None]
    if forced and all(record.input is None for record in records):
        return "no record has an input channel: if anything but the forcing drove the machine, it counts as missing physics here"
    return None


def check_comparable(series: Sequence[Series]) -> None:
    """Raise InputError when records cannot come from one machine in one set of units."""
    spread = [float(np.std(one.averaged)) for one in series]
    level = [float(np.mean(one.averaged)) for one in series]
    for one in series:
        if np.ptp(one.averaged) == 0.0:
            raise InputError(f"{one.name}: the output never changes; nothing can be learnt from it")
    for i, one in enumerate(series):
        for j in range(i):
            jump = abs(level[i] - level[j])
            size = max(spread[i], spread[j])
            decades = [abs(math.log10(max(abs(a), 1e-300) / max(abs(b), 1e-300))) for a, b in
                       ((spread[i], spread[j]), (level[i], level[j]))]  # fmt: skip
            thousand = all(2.5 < one < 3.5 for one in decades)
            if (
                thousand
                or jump > 300.0 * size
                or max(spread[i], spread[j]) > 2000.0 * min(spread[i], spread[j])
            ):
                raise InputError(
                    f"{series[j].name} and {one.name} do not look like one machine in one unit (outputs "
                    f"{level[j]:.3g} ± {spread[j]:.3g} and {level[i]:.3g} ± {spread[i]:.3g}); check units and files"
                )
