"""Estimates far from the nominal values or from what is possible: there the fit may absorb effects that the model
lacks."""

import math
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from rhythmid.identify.caution import Caution
from rhythmid.identify.early_output import SURE
from rhythmid.identify.identification import Delays, Estimate
from rhythmid.identify.plausibility import gains
from rhythmid.model import Model
from rhythmid.record.record import Record
from rhythmid.report.quantity import number, rounded, with_written_unit

TIMES = 4.0  # ratio of an estimate to the nominal value above which the shift is reported
# sample periods by which a delay may exceed the nominal one: a longer one is seldom transport delay alone
SAMPLES = 10.0
PASSED_BY = 2.0  # standard deviations by which an estimate has to exceed a limit
EARLY_LEAST = 0.05  # share of a sample by which a delay has to be negative to be reported
# share of half an interval by which a delay may differ from it: the hold also attenuates, which other parameters take up
SAME_HALF = 0.01
# standard deviations of the closure within which limit cycle and response agree about the delays
AGREES = 5.0
ABSORBING = "the fit may be absorbing missing physics"


def large_shifts(
    nominal: Model, parameters: Mapping[str, Estimate], delays: Delays, records: Sequence[Record]
) -> tuple[Caution, ...]:
    """Estimates far from the nominal values, and delays that are impossible or longer than any of the `records`.

    A delay without a standard deviation is judged by its value alone, because it is printed as well.
    """
    period = records[0].output.period
    length = max(float(np.ptp(record.output.time)) for record in records)
    return (
        *_values(nominal, parameters),
        *_negative_delays(nominal, delays, period),
        *_long_delays(nominal, delays, period, length),
        *_half_intervals(nominal, delays, records),
    )


def tells_nothing(parameters: Mapping[str, Estimate], delays: Delays) -> bool:
    """Whether there are parameters to find, and the records tell none of them, nor a delay."""
    every = (*parameters.values(), delays.input, delays.measurement, delays.sum)
    return bool(parameters) and all(one.value is None for one in every)


def _values(nominal: Model, parameters: Mapping[str, Estimate]) -> Iterator[Caution]:
    for name in gains(nominal):
        found, given = parameters.get(name), nominal.value(name)
        if found is None or found.value is None or found.std is None:
            continue
        ratio, spread = found.value / given, PASSED_BY * found.std / abs(given)
        low, high = ratio - spread, ratio + spread
        facts = (name, found.value, given, found.unit)
        told = with_written_unit(rounded(found.value, found.std), found.unit)
        if low <= 0.0 <= high < 1.0 / TIMES:
            yield Caution(
                "value_at_zero",
                f"{name} comes out at zero ({told}), nominal {given:g}: {ABSORBING}",
                f"Does the machine behave as if it had no {name}? If not, `rhythmid diagnose` names what acts in its place.",
                *facts,
            )
        elif low > TIMES or high < 1.0 / TIMES:
            yield Caution(
                "large_shift",
                f"{name} comes out at {told}, {_times(ratio)} the nominal {given:g}: {ABSORBING}",
                f"Is the nominal {name} measured? Then hold it with 'fixed: true' and run `rhythmid diagnose`.",
                *facts,
            )


def _times(ratio: float) -> str:
    """The ratio to the nominal value in words; without a number where it is a million or more."""
    if abs(ratio) >= 1e6:
        return "more than a million times"
    if 0.0 < ratio <= 1e-6:
        return "less than a millionth of"
    return f"{number(ratio, 2)} times" if not 0.0 < ratio < 1.0 else f"a {number(1.0 / ratio, 2)}th of"


def _negative_delays(nominal: Model, delays: Delays, period: float) -> Iterator[Caution]:
    """Negative delays, with which the machine would respond before the command."""
    for side, found, expected in _estimated(nominal, delays):
        if found.value is None or found.value >= -max(SURE * (found.std or 0.0), EARLY_LEAST * period):
            continue
        yield Caution(
            "negative_delay",
            f"{_named(side)} at {_size(found)}, but no machine answers before it is asked: {ABSORBING}",
            "Do the clocks of command and measurement agree, and is the input held from its stamps on (hold: in signals.yaml)? If so, "
            "`rhythmid diagnose` names the limit or other physics that the model lacks.",
            f"delay: {side}", found.value, expected, "s",
        )  # fmt: skip


def _long_delays(nominal: Model, delays: Delays, period: float, length: float) -> Iterator[Caution]:
    """Long delays. A delay that agrees with the limit cycle, an independent measurement, is not reported unless it
    exceeds the record's length: then the record would contain no response to any command."""
    agree = delays.separable and delays.closure is not None and abs(delays.closure) <= AGREES
    for side, found, expected in _estimated(nominal, delays):
        if found.value is None:
            continue
        beyond = found.value >= length
        long = found.value - expected - PASSED_BY * (found.std or 0.0) > SAMPLES * period
        if not beyond and (agree or not long):
            continue
        if beyond:  # its value has no meaning
            told = (
                f"longer than the record of {number(length, 3)} s, which holds no answer to any command then"
            )
        else:
            samples = math.floor((found.value - expected) / period)
            told = f"at {_size(found)}, {samples} samples more than the nominal {1e3 * expected:g} ms"
        yield Caution(
            "long_delay",
            f"{_named(side)} {told}: {ABSORBING}",
            "Is so long a delay known from the bus, the network or the drive? If not, `rhythmid diagnose` weighs it against lags, "
            "play and friction.",
            f"delay: {side}", found.value, expected, "s",
        )  # fmt: skip


def _half_intervals(nominal: Model, delays: Delays, records: Sequence[Record]) -> Iterator[Caution]:
    """A delay of half an interval of an input that is not taken as held: a command that is held causes it on average."""
    if any(one.input is None or one.hold == "zero" for one in records):
        return
    half = 0.5 * max(one.input.period for one in records if one.input is not None)
    for side, found, expected in _estimated(nominal, delays):
        if side == "measurement" or found.value is None or found.std is None:
            continue
        off, spread = found.value - expected - half, max(found.std, SAME_HALF * half)
        if SURE * spread < half and abs(off) < PASSED_BY * spread:
            yield Caution(
                "half_interval",
                f"{_named(side)} at {_size(found)}, half of the time between two samples of the input: a command that each sample "
                "holds until the next one acts so late where it is read as measured",
                "Was the input commanded, not measured? Then give it hold: zero in signals.yaml, and the delay is as much shorter.",
                f"delay: {side}", found.value, expected, "s",
            )  # fmt: skip


def _size(found: Estimate) -> str:
    """A delay in ms with its standard deviation, or a remark that it has none."""
    value = 1e3 * (found.value or 0.0)
    if found.std is None:
        return f"{number(value, 3)} ms, which the records do not determine"
    return f"{rounded(value, 1e3 * found.std)} ± {number(1e3 * found.std, 2)} ms"


def _named(side: str) -> str:
    if side == "sum":
        return "the delays of command and measurement together come out"
    return f"the {side} delay comes out"


def _estimated(nominal: Model, delays: Delays) -> list[tuple[str, Estimate, float]]:
    """Each identifiable delay, or their sum, by name with its estimate and nominal value [s]."""
    given = {side: nominal.parameters.get(f"{side}_delay.delay") for side in ("input", "measurement")}
    known = {side: 0.0 if one is None else one.value for side, one in given.items()}
    if not delays.separable:
        return [("sum", delays.sum, sum(known.values()))]
    return [
        ("input", delays.input, known["input"]),
        ("measurement", delays.measurement, known["measurement"]),
    ]
