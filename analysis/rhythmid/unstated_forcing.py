"""What forcing acts where neither the experiment nor the model states one.

The paper's hopper is kept on its limit cycle by 1 N at 1 Hz, and its model file does not contain that forcing. The same default
is used for every other machine in N and m, and is told wherever it acts. In other units (N*m and rad, V and m) nothing acts.
"""

from rhythmid.model import Model
from rhythmid.settings import Forcing
from rhythmid.units import TRANSLATIONAL as PLAIN
from rhythmid.units import Units

NO_FORCING = Forcing(amplitude=0.0)


def unstated_forcing(units: Units) -> Forcing:
    """The forcing of a machine in these units where none is stated."""
    return Forcing() if (units.force, units.position) == (PLAIN.force, PLAIN.position) else NO_FORCING


def forcing_of(model: Model) -> tuple[Forcing, bool]:
    """The forcing of a machine, and whether it is only assumed: the model's own, else `unstated_forcing`."""
    term = model.term("periodic_forcing")
    if term is not None:
        return Forcing(**term.numbers), False
    forcing = unstated_forcing(model.units)
    return forcing, forcing.amplitude != 0.0


def resolved_forcing(given: Forcing | None, model: Model) -> tuple[Forcing, bool, Model]:
    """The given forcing, else that of `forcing_of`; whether it is assumed; and the model without a forcing that is replaced."""
    if given is None:
        return *forcing_of(model), model
    stated = model.term("periodic_forcing") is not None
    return given, False, model.without("periodic_forcing") if stated else model


def assumed_note(forcing: Forcing) -> str:
    """One line for the user: an assumed forcing acts, and how to state another or none."""
    return (
        f"no forcing is stated, so one of {forcing.amplitude:g} N at {forcing.frequency:g} Hz acts; state it in the experiment, or write  "
        "forcing: {amplitude: 0}  if none acts"
    )
