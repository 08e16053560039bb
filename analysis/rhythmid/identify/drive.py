"""What drives the simulation of a record: its input, or where a controller works, its reference or the motor's effort.

A model whose command path holds a controller runs closed, from the reference; one without runs open, from the force
that was commanded or measured.
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
    """The record with that channel as input which drives this model.

    Raises InputError where the model has a controller and the record no reference, or the other way round, and where the
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
    """One sentence on what drives the simulation where `driven` chose another channel than the record's input."""
    if after is before:
        return None
    channel: Channel | None = after.input
    source = f" ({channel.source})" if channel is not None and channel.source else ""
    if after.input_kind == "reference":
        return f"The simulation runs in closed loop from the recorded reference{source}."
    return f"The simulation is driven by the recorded effort{source}."
