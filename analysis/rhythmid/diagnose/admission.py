"""Select and clean the records that a diagnosis can use.

Samples that do not tell where the machine was are left out. The channel that drives the machine has to be known.
All records of one diagnosis have to come from one machine and use one set of units.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhythmid.identify.comparable import check_comparable
from rhythmid.identify.drive import drive_of, driven
from rhythmid.identify.early_output import early_outputs
from rhythmid.identify.moving import moving
from rhythmid.identify.series import prepare
from rhythmid.model import Model
from rhythmid.record.braking import braking_notes
from rhythmid.record.cleaning import cleaned
from rhythmid.record.gaps import cut_at_gaps
from rhythmid.record.output_copy import copy_notes
from rhythmid.record.punctuality import punctuality_notes
from rhythmid.record.record import Record
from rhythmid.record.unsigned import unsigned_notes

Array = NDArray[np.float64]
DECAYS = 0.7  # ratio of the motion's size in the last quarter to that in the first; above it the motion may be driven


@dataclass(frozen=True)
class Admitted:
    """Cleaned records and held-out records, with notes for the user.

    `records` and `holdout` are cut where commands are missing, because a simulation needs them. `whole_records` and
    `whole_holdout` are not cut, because effort is balanced at each instant; `whole_notes` do not mention cuts.
    """

    records: tuple[Record, ...]
    holdout: tuple[Record, ...]
    notes: tuple[str, ...]
    whole_records: tuple[Record, ...]
    whole_holdout: tuple[Record, ...]
    whole_notes: tuple[str, ...]


def admitted(records: Sequence[Record], holdout: Sequence[Record], model: Model) -> Admitted:
    """Clean the records and the held-out ones, attach the channel that drives the model, and cut where it is missing.

    Records in which the machine stands still are left out. Raises InputError for records that cannot be judged, and
    where the machine stands still in all records to be fitted or in all held-out ones.
    """
    whole = (*records, *holdout)
    remark = check_driven(whole, model)
    fitted, still = moving([cleaned(record) for record in records])
    judged, still_too = moving([cleaned(record) for record in holdout])
    clean = [*fitted, *judged]
    given = tuple(driven(one.record, model) for one in clean)
    check_comparable(prepare(given))
    cut = [cut_at_gaps(record) for record in given]
    said = (
        remark,
        *still,
        *still_too,
        *(
            f"{one.name}: {note}"
            for one in whole
            for note in (
                *punctuality_notes(one.run),
                *copy_notes(one),
                *unsigned_notes(one),
                *braking_notes(one),
            )
        ),
        *(note for one in clean for note in one.notes),
        *(drive_of(one.record, b) for one, b in zip(clean, given)),
        *early_outputs(given),
    )
    notes, whole_notes = (
        tuple(dict.fromkeys(note for note in (*said, *more) if note is not None))
        for more in ((n for one in cut for n in one.notes), (n for one in cut for n in one.filled))
    )
    learnt, unseen = cut[: len(fitted)], cut[len(fitted) :]
    return Admitted(
        tuple(stretch for one in learnt for stretch in one.stretches),
        tuple(stretch for one in unseen for stretch in one.stretches),
        notes,
        tuple(one.whole for one in learnt),
        tuple(one.whole for one in unseen),
        whole_notes,
    )


def check_driven(records: Sequence[Record], model: Model) -> str | None:
    """A note where the channel that drives the machine seems to be missing; a free decay needs none."""
    if model.term("periodic_forcing") is not None:
        return None
    for record in records:
        drives = (record.input, record.forcing, record.reference, record.effort)
        if any(one is not None for one in drives):
            continue
        # a speed is a motion also where it is constant
        size = _rms if record.output_kind == "velocity" else np.std
        sizes = [float(size(quarter)) for quarter in np.array_split(record.output.value, 4)]
        if sizes[-1] > DECAYS * sizes[0] and not np.all(np.diff(sizes) < 0.0):
            return (
                f"{record.name}: has no input channel and is taken for a free motion, which hardly decays; if anything drives it, "
                "name its channel under 'input:' (or 'forcing:') in signals.yaml"
            )
    forced = [record for record in records if record.forcing is not None]
    if forced and all(record.input is None and record.effort is None for record in records):
        return "no record has an input channel: if anything but the forcing drove the machine, it counts as missing physics here"
    return None


def _rms(value: Array) -> float:
    return float(np.sqrt(np.mean(value**2)))
