"""A rig whose damper rides on the base that shakes it, by equations of its own: it is not taken for the drag of the air."""

from collections.abc import Callable

import numpy as np
import pytest
from twins import integrate, noisy

from rhythmid.diagnose.diagnosis import diagnose
from rhythmid.model import Model
from rhythmid.record.record import Channel, Record

MASS, DAMPING, STIFFNESS = 0.5, 2.5, 1400.0
NOMINAL = """
inertia: {mass: {value: 0.5, unit: kg, fixed: true}}
force:
  - linear_spring: {stiffness: {value: 1500.0, unit: N/m}, rest_length: {value: 0.0, unit: m}}
  - viscous_damper: {damping: {value: 2.0, unit: N*s/m}}
"""
LAWS: dict[str, tuple[Callable[[float, float], float], dict[str, float]]] = {
    "quadratic_damping": (lambda e, de: -12.0 * de * abs(de), {"coefficient": 12.0}),
}


def records(law: Callable[[float, float], float]) -> list[Record]:
    rng = np.random.default_rng(11)
    time = np.arange(0.0, 4.0, 2e-3)

    def one(index: int) -> Record:
        frequency, phase = rng.uniform(3.0, 14.0, 12), rng.uniform(0.0, 2.0 * np.pi, 12)
        w = 2.0 * np.pi * frequency
        size = (4e-4, 8e-4)[index]

        def base(t: float, order: int) -> float:
            return float((size * w**order * np.sin(w * t + phase + 0.5 * np.pi * order)).sum())

        def rates(t: float, s: np.ndarray) -> list[float]:
            e, de = s[0] - base(t, 0), s[1] - base(t, 1)
            return [s[1], (-STIFFNESS * e - DAMPING * de + law(e, de)) / MASS]

        states = integrate(rates, [base(0.0, 0), base(0.0, 1)], time, 1e-3)
        table = np.array([base(t, 0) for t in time])
        return Record(
            f"rig {index}", Channel(time, noisy(rng, states[:, 0], 1e-5), "m"), Channel(time, table, "m"),
            hold="band_limited", input_kind="base_displacement",
        )  # fmt: skip

    return [one(0), one(1)]


@pytest.mark.parametrize("effect", LAWS)
def test_what_rides_on_the_base_is_named_and_measured(effect):
    law, truth = LAWS[effect]
    result = diagnose(records(law), Model.from_text(NOMINAL)).diagnosis
    assert result.verdict == "missing_physics"
    assert [found.element for found in result.missing] == [effect]
    for name, true in truth.items():
        found = result.missing[0].parameters[name]
        assert found.std is not None and abs(found.value - true) < 4.0 * found.std < 0.1 * true
