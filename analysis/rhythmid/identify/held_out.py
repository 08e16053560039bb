"""Held-out records: free runs of the identified model over records that were not used in the fit.

Only two things are estimated from such a record: its initial state, and the output's zero where the fit found that
the zero differs from record to record.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from rhythmid.errors import InputError
from rhythmid.identify.comparable import check_comparable
from rhythmid.identify.descent import WHITE
from rhythmid.identify.drive import driven
from rhythmid.identify.held_out_zeros import held_out_zero_notes
from rhythmid.identify.joint import JointFit, begun_series, late_by, step_of, stretches_of
from rhythmid.identify.moving import moving
from rhythmid.identify.output_error import Fit, normalised_error, start_only
from rhythmid.identify.record_zero import moved, zero_place
from rhythmid.identify.series import Series, prepare
from rhythmid.identify.timing import smeared
from rhythmid.model import Model
from rhythmid.record.cleaning import cleaned
from rhythmid.record.gaps import cut_at_gaps
from rhythmid.record.record import Record


@dataclass(frozen=True, eq=False)
class HeldOutRun:
    """The identified model's free run over one held-out record.

    Attributes
    ----------
    record
        The record as it is compared.
    fit
        The free run beside the record; None where the model cannot be simulated over it.
    missing
        Reason for that.
    """

    record: Record
    fit: Fit | None
    missing: str | None = None

    @property
    def nrmse(self) -> float | None:
        """rms(simulated − measured) / std(measured); None where the model cannot be simulated over the record."""
        return None if self.fit is None else self.fit.nrmse()

    def to_dict(self) -> dict[str, Any]:
        """The error as plain JSON data."""
        return {"record": self.record.name, "nrmse": self.nrmse, "missing": self.missing}


@dataclass(frozen=True, eq=False)
class HeldOut:
    """How well the identified model predicts records that it was not fitted to.

    Attributes
    ----------
    runs
        One for each held-out record.
    notes
        Messages about these records for the user, one line each.
    """

    runs: tuple[HeldOutRun, ...]
    notes: tuple[str, ...] = ()

    @property
    def nrmse(self) -> float | None:
        """The error over all held-out records, weighted by the power of their motion; None where one of them has no
        error value."""
        fits = [one.fit for one in self.runs if one.fit is not None]
        if len(fits) < len(self.runs):
            return None
        return normalised_error(
            [residual for fit in fits for residual in fit.residuals],
            [series for fit in fits for series in fit.run.series],
        )

    def to_dict(self) -> dict[str, Any]:
        """`nrmse` over all records, and the error of each in `records`."""
        return {"nrmse": self.nrmse, "records": [one.to_dict() for one in self.runs]}


def admitted_unseen(
    holdout: Sequence[Record], fitted: Sequence[Record], model: Model
) -> tuple[tuple[Record, ...], tuple[str, ...]]:
    """The held-out records after cleaning, without those in which the machine is at rest, and notes about them.

    Raises InputError where the machine is at rest in all of them, for a record that declares a parameter that the
    model does not have, and for a record that cannot come from the machine of the `fitted` ones in the same units.
    """
    if not holdout:
        return (), ()
    clean, still = moving([cleaned(one) for one in holdout])
    unseen = tuple(driven(one.record, model) for one in clean)
    judged = prepare(unseen)
    for seen in prepare(fitted):
        for one in judged:
            check_comparable([seen, one])
    cut = (note for one in unseen for note in cut_at_gaps(one).notes)
    return unseen, (*still, *(note for one in clean for note in one.notes), *cut)


def held_out_runs(
    model: Model, joint: JointFit | None, fitted: Sequence[Record], unseen: Sequence[Record]
) -> HeldOut:
    """Run the identified model over held-out records.

    Parameters
    ----------
    model
        The identified model.
    joint
        The fit that produced it; None for the paper's method.
    fitted, unseen
        Records used in the fit, and held-out records.
    """
    if joint is None:
        series = prepare(fitted)
        block, noise, step = series[0].block, WHITE, step_of(series)
    else:
        model, noise, step = joint.model, joint.fit.noise, joint.fit.run.max_step
        block = joint.fit.run.series[0].block
    runs: list[HeldOutRun] = []
    for record in unseen:
        try:
            fit = start_only(model, _series(record, model, joint, block), noise, step)
        except InputError as error:
            runs.append(HeldOutRun(record, None, str(error)))
            continue
        told = math.isfinite(fit.nrmse())
        runs.append(
            HeldOutRun(record, fit) if told else HeldOutRun(record, None, "no stretch of it is whole")
        )
    known = [one for run in runs if run.fit is not None for one in run.fit.run.series]
    return HeldOut(tuple(runs), () if joint is None else held_out_zero_notes(joint.fit, known))


def _series(record: Record, model: Model, joint: JointFit | None, block: int) -> list[Series]:
    """A held-out record, prepared in the same way as the fitted ones, with a zero of its own where they have one."""
    series = begun_series(stretches_of((record,)), late_by(model), block)
    if joint is None:
        return series
    if joint.smear > 0.0:
        period = joint.fit.run.series[0].period
        series = [
            one if one.command is None else replace(one, command=smeared(one.command, joint.smear, period))
            for one in series
        ]
    if zero_place(joint.fit.run.compiled.layout.states) is not None:
        series = [moved(one, 0.0) for one in series]
    return series
