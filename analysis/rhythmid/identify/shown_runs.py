"""Free runs of fitted models beside the records, for reports."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from rhythmid.identify.output_error import Fit
from rhythmid.identify.series import Series, record_of
from rhythmid.identify.switching import switches_of
from rhythmid.ltp.pumping import Pumping
from rhythmid.report.run import Run
from rhythmid.simulation.transport import physical_times


def free_runs(
    before: Fit,
    after: Fit,
    pumpings: Mapping[str, Pumping | None],
    repaired: bool,
    labels: tuple[str, str],
    heldout: bool = False,
) -> list[Run]:
    """Every series of the fits beside its simulations; both fits use the same series.

    `pumpings` are those of the records, by name, whole or cut into windows. Where nothing was `repaired`, only
    `before` is shown, with the motion of `after`, which may be the same.
    """
    found: list[Run] = []
    for index, one in enumerate(before.run.series):
        pumping = pumpings.get(one.name, pumpings.get(record_of(one)))
        rows = after.run.rows(after.model, index, after.starts[index])
        if rows is None:
            continue
        phase = None
        if pumping is not None:
            physical = physical_times(after.model, one.centres)
            phase = ((physical - pumping.origin) * pumping.frequency) % 1.0
        found.append(
            Run(
                name=one.name,
                time=one.centres,
                measured=one.averaged,
                before=one.averaged + before.residuals[index],
                after=one.averaged + after.residuals[index] if repaired else None,
                position=rows[:, 0],
                velocity=rows[:, 1],
                phase=phase,
                used=one.used,
                hidden=np.zeros_like(one.used) if heldout else _hidden(one),
                heldout=heldout,
                quiet=not one.commanded,
                labels=labels,
                switches=switches_of(after.model) if one.measured == "position" else None,
            )
        )
    return found


def _hidden(one: Series) -> NDArray[np.bool_]:
    """The held-out end of a series, without single blocks that contain a gap."""
    last = np.flatnonzero(one.used)
    hidden = np.zeros_like(one.used)
    if len(last):
        hidden[last[-1] + 1 :] = True
    return hidden if hidden.sum() > 3 else np.zeros_like(one.used)
