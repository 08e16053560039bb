"""A rig whose damper rides on the base that shakes it, by equations of its own: it is not taken for the drag of the air."""

import numpy as np
import pytest
from synthetic import integrate, noisy

from rhythmid.diagnose.diagnosis import diagnose
from rhythmid.model import Model
from rhythmid.record.record import Channel, Record

MASS, DAMPING, STIFFNESS, QUADRATIC = 0.5, 2.5, 1400.0, 12.0
NOMINAL = """
inertia: {mass: {value: 0.5, unit: kg, fixed: true}}
force:
  - linear_spring: {stiffness: {value: 1500.0, unit: N/m}, rest_length: {value: 0.0, unit: m}}
  - viscous_damper: {damping: {value: 2.0, unit: N*s/m}}
"""


def records() -> list[Record]:
    rng = np.random.default_rng(11)
    time = np.arange(0.0, 4.0, 2e-3)

    def one(size: float) -> Record:
        frequency, phase = rng.uniform(3.0, 14.0, 12), rng.uniform(0.0, 2.0 * np.pi, 12)
        w = 2.0 * np.pi * frequency

        def base(t: float, order: int) -> float:
            return float((size * w**order * np.sin(w * t + phase + 0.5 * np.pi * order)).sum())

        def rates(t: float, s: np.ndarray) -> list[float]:
            e, de = s[0] - base(t, 0), s[1] - base(t, 1)
            return [s[1], (-STIFFNESS * e - DAMPING * de - QUADRATIC * de * abs(de)) / MASS]

        states = integrate(rates, [base(0.0, 0), base(0.0, 1)], time, 1e-3)
        table = np.array([base(t, 0) for t in time])
        return Record(
            f"rig {size}", Channel(time, noisy(rng, states[:, 0], 1e-5), "m"), Channel(time, table, "m"),
            hold="band_limited", input_kind="base_displacement",
        )  # fmt: skip

    return [one(4e-4), one(8e-4)]


@pytest.mark.long
def test_quadratic_damping_that_rides_on_the_base_is_named_and_measured():
    result = diagnose(records(), Model.from_text(NOMINAL)).diagnosis
    assert result.verdict == "missing_physics"
    assert [found.element for found in result.missing] == ["quadratic_damping"]
    found = result.missing[0].parameters["coefficient"]
    assert found.std is not None and abs(found.value - QUADRATIC) < 4.0 * found.std < 0.1 * QUADRATIC
