"""Effort balance of a model whose free run does not follow the machine.

A free run integrates every small disturbance. The balance compares effort and motion at each instant, so it can be
useful where no free run is.
"""

from collections.abc import Sequence

from rhythmid.identify.inverse_dynamics.applicability import applicable
from rhythmid.identify.inverse_dynamics.balance import Balance
from rhythmid.identify.inverse_dynamics.estimate import fit_effort, variation_of
from rhythmid.model import Model
from rhythmid.record.record import Record
from rhythmid.report.quantity import with_std, with_written_unit


def effort_note(records: Sequence[Record], model: Model, nrmse: float) -> str | None:
    """The values that fit the effort balance, and its residual, in one line.

    Parameters
    ----------
    records : prepared with the channel that drives the model.
    model : the nominal model.
    nrmse : share of the motion that the free run leaves unexplained.

    Returns None where the effort cannot be scored, or where the balance leaves as large a share as the free run does.
    """
    way = applicable(records, model)
    if not way.applies:
        return None
    balance = way.balance or Balance.of(records, model)
    fit = fit_effort(balance, model)
    left = fit.error / variation_of(balance)
    if not left < nrmse:
        return None
    known = model.parameters
    values = [
        f"{name} {with_written_unit(with_std(fit.model.value(name), std), known[name].unit)}"
        for name, std in zip(fit.names, fit.std[1:].tolist(), strict=True)
    ]
    return (
        f"the balance of the recorded effort, which needs no free run, leaves {100.0 * left:.0f} % of the effort, with "
        f"{', '.join(values)}; `rhythmid diagnose` scores by the effort where it serves better, and names what is missing"
    )
