"""A lift at work for the live twin: simulated stretches that go on where the last one ended, and changes of its physics."""

from collections.abc import Callable

import numpy as np
from machines_at_work import DESIGNS, RATE, Stretch
from numpy.typing import NDArray

from rhythmid.excitation.multisine import Multisine
from rhythmid.model import Model
from rhythmid.simulation.compiled import compile_model
from rhythmid.simulation.signal import spline, zero_order_hold
from rhythmid.simulation.simulate import simulate, start_states

Array = NDArray[np.float64]
LIFT = DESIGNS["lift"]
EXCITATION = Multisine(rms=5.0, period=20.0, periods=1, band=(0.3, 8.0), seed=3)


def _changed(name: str, factor: float, more: float = 0.0) -> Callable[[Model], Model]:
    return lambda model: model.with_values({name: model.value(name) * factor + more})


CHANGED = {
    "friction": _changed("coulomb_friction.force", 2.0),
    "payload": _changed("inertia.mass", 1.05),
    "command": _changed("input_delay.delay", 1.0, 0.005),
    "measurement": _changed("measurement_delay.delay", 1.0, 0.005),
}


def at_work(
    model: Model,
    start: float,
    end: float,
    state: Array | None = None,
    seed: int = 0,
    noise: float = 1e-4,
    forced: bool = True,
    late: Callable[[Array], Array] | None = None,
) -> Stretch:
    """The lift from `start` to `end` [s], from a state or from rest, its position measured with white noise [m].

    `late` says how much later [s] than their times commands are released.
    """
    delay = model.value("measurement_delay.delay")
    free = model.without("measurement_delay")
    if state is None:
        state = start_states(free, compile_model(free), -9.81 * 2.0 / 800.0, 0.0)
    time = np.arange(round(start * RATE), round(end * RATE) + 1) / RATE
    known = np.arange(round(start * RATE) - 50, round(end * RATE) + 1) / RATE
    command = EXCITATION(np.mod(known, EXCITATION.period))
    forcing = (6.0 if forced else 0.0) * np.cos(2.0 * np.pi * 1.4 * known)
    acting = known
    if late is not None:
        acting = np.maximum.accumulate(known + late(known)) + 1e-9 * np.arange(len(known))
    run = simulate(free, time, zero_order_hold(acting, command), spline(known, forcing), state)
    measured = run.output + noise * np.random.default_rng(seed).standard_normal(len(time))
    return Stretch(time, command[50:], forcing[50:], time + delay, measured, run.states[-1])
