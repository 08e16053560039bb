"""The output's zero of each record: y = x + z, with z a constant of the record.

An incremental encoder counts from where the machine stood when it was switched on, so that with several records of one machine the
zero differs from record to record. It is a state that never changes, whose start each series has of its own: a nuisance, as
position and velocity at the start are. The first record's zero stays where it is, for the model's rest length is told from there.
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
STATE = f"{RECORD_ZERO.name}.zero"  # in the state vector


def zero_place(states: Sequence[str]) -> int | None:
    """Where the zero stands in a state vector; None in that of a model without one."""
    return states.index(STATE) if STATE in states else None


def with_record_zero(model: Model) -> Model:
    """The model whose output has a zero of its own in each record that is so marked."""
    return model if model.term(RECORD_ZERO.name) is not None else model.with_element(RECORD_ZERO)


def without_record_zero(model: Model) -> Model:
    """The model as a file can name it."""
    return model if model.term(RECORD_ZERO.name) is None else model.without(RECORD_ZERO.name)


def others_marked(series: Sequence[Series]) -> list[Series]:
    """The series, of which all but those of the first record have a zero of their own."""
    first = record_of(series[0])
    return [one if record_of(one) == first else moved(one, 0.0) for one in series]


def moved(series: Series, zero: float) -> Series:
    """The series with its own zero moved to where it is known to be about."""
    return replace(series, value=series.value - zero, zero=(series.zero or 0.0) + zero)
