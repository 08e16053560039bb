"""The output's zero of each record: y = x + z, with z a constant of the record.

An incremental encoder counts from the machine's position at power-up, so the zero differs from record to record. It
is a constant state whose initial value belongs to each series: a nuisance parameter, like the initial position and
velocity. The first record's zero is fixed, because the model's rest length is measured from it.
"""

from collections.abc import Sequence
from dataclasses import replace

from rhythmid.elements.element import Element
from rhythmid.identify.series import Series, record_of
from rhythmid.model import Model


def _kernel(y, t, zero):
    return y + zero, 0.0


RECORD_ZERO = Element(
    name="record_zero",
    slot="sensor",
    title="Zero of a record",
    equation="y → y + z",
    parameters=(),
    kernel=_kernel,
    states=("zero",),
    candidate=False,
    reference="J. Fraden, Handbook of Modern Sensors, 5th ed., 2016, chapter 3",
)
STATE = f"{RECORD_ZERO.name}.zero"  # name in the state vector


def zero_place(states: Sequence[str]) -> int | None:
    """Index of the zero in a state vector; None where the model has none."""
    return states.index(STATE) if STATE in states else None


def with_record_zero(model: Model) -> Model:
    """The model whose output has a zero of its own in each marked record."""
    return model if model.term(RECORD_ZERO.name) is not None else model.with_element(RECORD_ZERO)


def without_record_zero(model: Model) -> Model:
    """The model without the zero, which a model file cannot name."""
    return model if model.term(RECORD_ZERO.name) is None else model.without(RECORD_ZERO.name)


def others_marked(series: Sequence[Series]) -> list[Series]:
    """The series; all but those of the first record are marked to have a zero of their own."""
    first = record_of(series[0])
    return [one if record_of(one) == first else moved(one, 0.0) for one in series]


def moved(series: Series, zero: float) -> Series:
    """The series with its zero set to a first guess."""
    return replace(series, value=series.value - zero, zero=(series.zero or 0.0) + zero)
