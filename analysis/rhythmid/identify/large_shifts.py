"""Values that have left the nominal ones by far: there a fit may be absorbing physics that the model lacks."""

import math
from collections.abc import Iterator, Mapping

from rhythmid.identify.caution import Caution
from rhythmid.identify.identification import Delays, Estimate
from rhythmid.identify.plausibility import gains
from rhythmid.model import Model
from rhythmid.report.quantity import number, rounded

TIMES = 4.0  # ratio of a value to the nominal one from which the shift is told
SAMPLES = (
    10.0  # sample periods by which a delay may exceed the nominal one: a longer one is seldom transport alone
)
PASSED_BY = 2.0  # standard deviations by which a limit has to be passed
AGREES = 5.0  # standard deviations of the closure within which limit cycle and response see the same delays
ABSORBING = "the fit may be absorbing missing physics"


def large_shifts(
    nominal: Model, parameters: Mapping[str, Estimate], delays: Delays, period: float
) -> tuple[Caution, ...]:
    """Values that have left the nominal ones by far; `period` [s] is the time between samples."""
    return (*_values(nominal, parameters), *_delays(nominal, delays, period))


def _values(nominal: Model, parameters: Mapping[str, Estimate]) -> Iterator[Caution]:
    for name in gains(nominal):
        found, given = parameters.get(name), nominal.value(name)
        if found is None or found.value is None or found.std is None:
            continue
        ratio, spread = found.value / given, PASSED_BY * found.std / abs(given)
        low, high = ratio - spread, ratio + spread
        facts = (name, found.value, given, found.unit)
        told = f"{rounded(found.value, found.std)} {found.unit}"
        if low <= 0.0 <= high < 1.0 / TIMES:
            yield Caution(
                "value_at_zero",
                f"{name} comes out at zero ({told}), nominal {given:g}: {ABSORBING}",
                f"Does the machine behave as if it had no {name}? If not, `rhythmid diagnose` names what acts in its place.",
                *facts,
            )
        elif low > TIMES or high < 1.0 / TIMES:
            times = (
                f"{number(ratio, 2)} times" if not 0.0 < ratio < 1.0 else f"a {number(1.0 / ratio, 2)}th of"
            )
            yield Caution(
                "large_shift",
                f"{name} comes out at {told}, {times} the nominal {given:g}: {ABSORBING}",
                f"Is the nominal {name} measured? Then hold it with 'fixed: true' and run `rhythmid diagnose`.",
                *facts,
            )


def _delays(nominal: Model, delays: Delays, period: float) -> Iterator[Caution]:
    """Delays that are long; not where the limit cycle, which sees them another way than the response does, agrees."""
    if delays.separable and delays.closure is not None and abs(delays.closure) <= AGREES:
        return
    given = {side: nominal.parameters.get(f"{side}_delay.delay") for side in ("input", "measurement")}
    known = {side: 0.0 if one is None else one.value for side, one in given.items()}
    pairs = [
        ("input", delays.input, known["input"]),
        ("measurement", delays.measurement, known["measurement"]),
    ]
    if not delays.separable:
        pairs = [("sum", delays.sum, sum(known.values()))]
    for side, found, expected in pairs:
        if found.value is None or found.std is None:
            continue
        if found.value - expected - PASSED_BY * found.std <= SAMPLES * period:
            continue
        what = "the delays of command and measurement together" if side == "sum" else f"the {side} delay"
        samples = math.floor((found.value - expected) / period)
        yield Caution(
            "long_delay",
            f"{what} comes out at {rounded(1e3 * found.value, 1e3 * found.std)} ms, {samples} samples more than the nominal "
            f"{1e3 * expected:g} ms: {ABSORBING}",
            "Is so long a delay known from the bus, the network or the drive? If not, `rhythmid diagnose` weighs it against lags, "
            "play and friction.",
            f"delay: {side}", found.value, expected, "s",
        )  # fmt: skip
