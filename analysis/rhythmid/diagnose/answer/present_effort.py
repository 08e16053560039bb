"""Convert an answer from effort scoring into the plain data that its report draws."""

from collections.abc import Sequence
from dataclasses import asdict

import numpy as np
from numpy.typing import NDArray

from rhythmid.diagnose.answer.compose_effort import effort_delays, effort_parameters
from rhythmid.diagnose.answer.described import described, labels_of
from rhythmid.diagnose.answer.result import Diagnosis
from rhythmid.diagnose.effort.fitted import Fitted
from rhythmid.diagnose.effort.found_delay import with_found_delay
from rhythmid.diagnose.effort.remainder import remainder_of
from rhythmid.diagnose.effort.run import EffortResult
from rhythmid.identify.inverse_dynamics.balance import Balance
from rhythmid.identify.inverse_dynamics.estimate import size_of
from rhythmid.identify.inverse_dynamics.motion import effort_channel
from rhythmid.model import Model
from rhythmid.record.record import Record
from rhythmid.report.findings import Findings, FreeFunction
from rhythmid.report.run import FEWEST_SAMPLES, Compared, Run

Array = NDArray[np.float64]


def effort_findings(
    diagnosis: Diagnosis,
    result: EffortResult,
    nominal: Model,
    records: Sequence[Record],
    holdout: Sequence[Record] = (),
    command: str = "",
    name: str = "the nominal model",
) -> Findings:
    """The content of the report as plain data: recorded effort beside the models' predictions; arguments as for `present`."""
    before, after = result.nominal, result.chosen
    changed = bool(after.elements)
    chosen = result.selection.chosen
    labels = labels_of(chosen.kind)
    size = size_of(result.search.balance)
    final = after if changed else None
    runs = effort_runs(result.search.balance, before, final, size, labels)
    if result.heldout is not None:
        runs += effort_runs(result.heldout, before, final, size, labels, heldout=True)
    models = {"Nominal model": nominal.to_yaml(), "Nominal model, refitted": before.model.to_yaml()}
    if changed:
        models["Augmented model"] = with_found_delay(result.search.balance, after, nominal).to_yaml()
    elements = [term.element for term in nominal.terms]
    elements += [term.element for one in result.search.hypotheses for term in one.fit.model.terms]
    unit = _unit(records, nominal)
    return Findings(
        **described(diagnosis, chosen, nominal, records, holdout, elements, command, name),
        forced=any(record.forcing is not None for record in records),
        compared=Compared("effort", unit, "predicted", result.applicability.bandwidth),
        runs=tuple(runs),
        force_unit=unit,
        refitted={key: asdict(value) for key, value in effort_parameters(before).items()},
        models=models,
        refitted_delays=effort_delays(result.search.balance, before),
        functions=_functions(result, nominal, unit) if changed else (),
        at_bound=tuple(n for n, at in zip(after.fit.names, after.fit.at_limit[1:], strict=True) if at),
    )


def _unit(records: Sequence[Record], nominal: Model) -> str:
    channel = effort_channel(records[0], nominal)
    return nominal.units.force if channel is None else channel.unit


def effort_runs(
    balance: Balance,
    before: Fitted,
    after: Fitted | None,
    size: float,
    labels: tuple[str, str],
    heldout: bool = False,
) -> list[Run]:
    """Recorded and predicted effort of every stretch of the records, below the bandwidth.

    Two fits are shown. Errors are shares of `size`. Samples at which the machine sticks are drawn but not scored.
    """
    predicted = [_along(balance, before), None if after is None else _along(balance, after)]
    found: list[Run] = []
    for index, (motion, places) in enumerate(zip(balance.motions, balance.places, strict=True)):
        if len(places) < FEWEST_SAMPLES:
            continue
        grid = np.arange(places[0], places[-1] + 1, int(np.diff(places).min()))
        first, second = (None if one is None else one[index][grid] for one in predicted)
        assert first is not None
        used = np.isin(grid, places)
        found.append(
            Run(
                name=_named(balance, index),
                time=motion.time[grid],
                measured=balance.filtered(motion.effort, motion.period)[grid],
                before=first,
                after=second,
                position=motion.leg_position[grid],
                velocity=motion.leg_velocity[grid],
                phase=None,
                used=used,
                hidden=np.zeros_like(used),
                heldout=heldout,
                size=size,
                labels=labels,
            )
        )
    return found


def _along(balance: Balance, fitted: Fitted) -> list[Array]:
    """The effort (n,) that a fit predicts at every sample, for each stretch."""
    model, alignment = fitted.fit.model, fitted.fit.alignment
    late, made = balance.later(model, alignment), []
    changes = balance.moved(model, alignment) or len(balance.motions) * [0.0]
    for motion, required, change in zip(balance.motions, balance.required(model), changes, strict=True):
        required = required + change
        signal = balance.filtered(required, motion.period)
        made.append(np.interp(motion.time + late, motion.time, signal))
    return made


def _named(balance: Balance, index: int) -> str:
    """Name of a stretch: its record's name, and the number of the part where a record has several."""
    motion = balance.motions[index]
    same = [i for i, one in enumerate(balance.motions) if one.record == motion.record]
    return motion.name if len(same) == 1 else f"{motion.name}, part {same.index(index) + 1}"


def _functions(result: EffortResult, nominal: Model, unit: str) -> tuple[FreeFunction, ...]:
    """Mean residual effort of the nominal and of the final model over each quantity."""
    first = remainder_of(result.search.balance, result.nominal)
    later = {curve.quantity: curve for curve in result.remainder}
    length = nominal.units.position
    units = {"velocity": f"{length}/s", "acceleration": f"{length}/s^2", "time": "s", "load": unit}
    return tuple(
        FreeFunction(
            one.quantity,
            one.share,
            one.value,
            one.mean,
            units.get(one.quantity, length),
            unit,
            later[one.quantity].share,
            later[one.quantity].value,
            later[one.quantity].mean,
        )
        for one in first
    )
