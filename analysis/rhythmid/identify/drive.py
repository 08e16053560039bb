"""The channel that drives the simulation of a record: its input, a controller's reference or the motor's effort.

A model with a controller in its command path runs in closed loop from the reference. A model without one runs in
open loop from the commanded or measured force.
"""

from dataclasses import replace

from rhythmid.errors import InputError
from rhythmid.identify.declared import own_model
from rhythmid.model import Model
from rhythmid.record.record import Channel, Record


def controlled(model: Model) -> bool:
    """Whether a controller in the model's command path closes the loop."""
    return any(term.element.acts == "feedback" for term in model.terms)


def driven(record: Record, model: Model) -> Record:
    """The record with the channel that drives this model as its input.

    Raises InputError where the model has a controller and the record no reference, or the reverse, and where the
    record declares parameters that the model does not have.
    """
    own_model(model, record)
    if controlled(model):
        if record.input_kind == "reference" and record.input is not None:
            return record
        if record.reference is None:
            raise InputError(
                f"{record.name}: the model has a controller, but no reference is recorded; name it in signals.yaml, as "
                "reference: {…}  or  input: {…, kind: reference}"
            )
        return replace(record, input=record.reference, input_kind="reference")
    if record.input is not None:
        if record.input_kind == "reference":
            raise InputError(
                f"{record.name}: its input is the reference of a controller that the model does not have; add "
                "position_control or velocity_control under 'command:', or give the motor's effort as the input"
            )
        return record
    if record.effort is not None:
        return replace(record, input=record.effort, input_kind="force")
    if record.reference is not None:
        raise InputError(
            f"{record.name}: of what drives the machine only a reference is recorded; add position_control or "
            "velocity_control under the model's 'command:'"
        )
    return record


def drive_of(before: Record, after: Record) -> str | None:
    """One sentence that names the driving channel where `driven` chose another than the record's input; else None."""
    if after is before:
        return None
    channel: Channel | None = after.input
    source = f" ({channel.source})" if channel is not None and channel.source else ""
    if after.input_kind == "reference":
        return f"The simulation runs in closed loop from the recorded reference{source}."
    return f"The simulation is driven by the recorded effort{source}."
