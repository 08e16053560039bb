"""From an identification to the plain data that its report draws."""

import numpy as np

from rhythmid.identify.identification import Identification
from rhythmid.report.identification import identification_page
from rhythmid.report.page import Page
from rhythmid.report.record_quality import quality_of
from rhythmid.report.transfer_figures import TransferFunction


def present(found: Identification, command: str = "", name: str = "a model") -> Page:
    """The report of an identification; `command` is the command line, `name` the model's."""
    units = found.model.units
    names = ", ".join(record.name for record in found.records)
    return identification_page(
        found.to_dict(),
        source=f"{name} from {names}",
        records=[quality_of(record, "identification") for record in found.records],
        command=command,
        models={"Identified model": found.model.to_yaml()},
        transfer=_transfer(found),
        unit=f"{units.position}/{units.force}",
    )


def _transfer(found: Identification) -> list[TransferFunction]:
    """The estimated functions where they mean something, with what the fitted model would show there.

    The model's function, smoothed as the estimate is, turns by the identified delays, equation (7) of the paper.
    """
    made = []
    estimate, first = found.harmonics, found.paper[0]
    delays = found.delays
    both = delays.separable and delays.input.value is not None and delays.measurement.value is not None
    split = (
        (delays.input.value or 0.0, delays.measurement.value or 0.0)
        if both
        else (delays.sum.value or 0.0, 0.0)
    )
    for row, m in enumerate(estimate.harmonics):
        inside = found.reached[row]
        frequency = estimate.frequency[inside]
        turn = 2 * np.pi * ((frequency - m * first.pumping.frequency) * split[0] + frequency * split[1])
        model = first.fit.expected[first.estimate.htf.row(int(m))][inside] * np.exp(-1j * turn)
        made.append(
            TransferFunction(
                int(m), frequency, estimate.value[row, inside],
                None if estimate.std is None else estimate.std[row, inside],
                model if both or m == 0 else None,
            )
        )  # fmt: skip
    return made
