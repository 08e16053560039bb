"""Converts an identification to the plain data of its report."""

import numpy as np

from rhythmid.errors import InputError
from rhythmid.identify.held_out import HeldOutRun
from rhythmid.identify.identification import Identification
from rhythmid.identify.joint import without_forcing
from rhythmid.identify.shown_runs import free_runs
from rhythmid.ltp.htf import delay_phase, linearised
from rhythmid.ltp.pumping import active_pumping
from rhythmid.report.identification import identification_page
from rhythmid.report.page import Page
from rhythmid.report.record_quality import quality_of
from rhythmid.report.run import Run
from rhythmid.report.transfer_figures import TransferFunction


def present(found: Identification, command: str = "", name: str = "a model") -> Page:
    """Report page of an identification; `command` is the command line, `name` the model's."""
    units = found.model.units
    names = ", ".join(record.name for record in found.records)
    return identification_page(
        found.to_dict(),
        source=f"{name} from {names}",
        records=[
            *(quality_of(record, "identification") for record in found.records),
            *(quality_of(one.record, "held out") for one in _held_out(found)),
        ],
        command=command,
        models={"Identified model": found.model.to_yaml()},
        transfer=_transfer(found),
        unit=f"{units.position}/{units.force}",
        runs=_runs(found),
        position=units.position,
    )


def _runs(found: Identification) -> list[Run]:
    """Every record beside the identified model's free run, held-out records last. With the paper's method only
    held-out records are simulated."""
    labels, runs = ("identified model", ""), []
    if found.joint is not None:
        fit = found.joint.fit
        pumpings = {record.name: active_pumping(record) for record in found.records}
        runs += free_runs(fit, fit, pumpings, False, labels)
    for one in _held_out(found):
        if one.fit is not None:
            pumpings = {one.record.name: active_pumping(one.record)}
            runs += free_runs(one.fit, one.fit, pumpings, False, labels, heldout=True)
    return runs


def _held_out(found: Identification) -> tuple[HeldOutRun, ...]:
    return () if found.held_out is None else found.held_out.runs


def _transfer(found: Identification) -> list[TransferFunction]:
    """The estimated functions, with those of the identified model.

    The model's function includes the phase of the identified delays, equation (7) of the paper.
    """
    functions, delays = found.shown.functions, found.delays
    if functions is None:
        return []
    pumping = found.paper[0].pumping
    both = delays.separable and delays.input.value is not None and delays.measurement.value is not None
    input_delay, measurement_delay = (
        (delays.input.value or 0.0, delays.measurement.value or 0.0)
        if both
        else (delays.sum.value or 0.0, 0.0)
    )
    try:
        machine = linearised(without_forcing(found.model), pumping)
    except InputError:  # without forcing there is no limit cycle to linearise around
        machine = None
    made = []
    for one in functions.functions:
        model = None
        if machine is not None and (both or one.m == 0):
            m = np.array([one.m])
            turn = delay_phase(m, one.frequency, input_delay, measurement_delay, pumping.frequency)
            model = (machine.htf(m, one.frequency) * np.exp(-1j * turn))[0]
        made.append(TransferFunction(one.m, one.frequency, one.value, one.radius, model))
    return made
