"""Parameters with a value of their own in each record, declared by the record, such as a controller's gain.

A declared value is known. It replaces the model's value wherever that record is simulated. A parameter that all
records declare is not estimated.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Protocol

from rhythmid.errors import InputError
from rhythmid.model import Model


class Declaring(Protocol):
    """A record, or a series made from one."""

    @property
    def name(self) -> str: ...

    @property
    def parameters(self) -> Mapping[str, float]: ...


def own_model(model: Model, one: Declaring) -> Model:
    """The model with the values that one record declares, fixed.

    Raises InputError where the model has no such parameter or its bounds exclude the value.
    """
    if not one.parameters:
        return model
    known, changes = model.parameters, {}
    for name, value in one.parameters.items():
        if name not in known:
            raise InputError(
                f"{one.name}: declares {name!r}, which is no parameter of the model; it has {', '.join(known)}"
            )
        low, high = known[name].bounds
        if not low <= value <= high:
            raise InputError(f"{one.name}: declares {name} = {value:g}, outside [{low:g}, {high:g}]")
        changes[name] = replace(known[name], value=float(value), fixed=True)
    return model.with_parameters(changes)


def with_declared(model: Model, records: Sequence[Declaring]) -> Model:
    """The model for all records: a parameter that every record declares is fixed at the mean of the declared values.

    Raises InputError where a record declares a parameter that the model does not have.
    """
    for one in records:
        own_model(model, one)
    every = set.intersection(*(set(one.parameters) for one in records)) if records else set()
    known = model.parameters
    means = {name: sum(one.parameters[name] for one in records) / len(records) for name in every}
    return model.with_parameters(
        {name: replace(known[name], value=mean, fixed=True) for name, mean in means.items()}
    )
