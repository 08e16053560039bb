"""Delays of motions that repeat themselves: of those that are whole periods apart the shortest one is told, and a longer one where it is true."""

from pathlib import Path

import numpy as np
import pytest

from rhythmid.elements.catalogue import load_catalogue
from rhythmid.identify import joint
from rhythmid.identify.search_quality import explained
from rhythmid.model import Model
from rhythmid.record.load import load

STEP, FINER = 0.01, 20  # s between samples, steps of the simulation in one
MASS, DAMPING = 0.0085, 0.045
LATE = "input_delay.delay"
MODEL = f"""
units: {{force: V, position: rad, mass: "V*s^2/rad"}}
inertia: {{mass: {{value: {MASS}, unit: "V*s^2/rad"}}}}
force: [{{viscous_damper: {{damping: {{value: {DAMPING}, unit: "V*s/rad"}}}}}}]
"""
SIGNALS = """
time: {column: t}
input: {column: u, unit: V, hold: zero}
output: {column: y, unit: rad/s, kind: velocity}
"""


def late_fit(folder: Path, command: np.ndarray, delay: float, begun: float) -> joint.JointFit:
    """The fit of a motor whose commands act so much later [s], of those near the delay `begun`."""
    late = round(delay * FINER / STEP)
    acting = np.concatenate([np.zeros(late), np.repeat(command, FINER)])
    speed, out = 0.0, []
    for place, volts in enumerate(acting[: len(command) * FINER]):
        if place % FINER == 0:
            out.append(speed)
        speed += STEP / FINER * (volts - DAMPING * speed) / MASS
    noisy = np.array(out) + np.random.default_rng(1).normal(0.0, 1.0, len(command))
    table = np.column_stack([STEP * np.arange(len(command)), command, noisy])
    np.savetxt(folder / "run.csv", table, delimiter=",", header="t,u,y", comments="")
    (folder / "signals.yaml").write_text(SIGNALS)
    (folder / "model.yaml").write_text(MODEL)
    record = load(folder / "run.csv", folder / "signals.yaml")
    model = Model.load(folder / "model.yaml").with_element(load_catalogue()["input_delay"], {"delay": begun})
    fit = joint.fit_from(model, record)
    assert fit.model.value(LATE) == pytest.approx(begun, abs=0.02)
    return joint.JointFit(fit, None, explained(fit, None), (record,))


def test_of_delays_that_are_whole_periods_apart_the_shortest_is_told(tmp_path):
    time = STEP * np.arange(500)
    command = 6.5 * np.sign(np.sin(2.0 * np.pi * 3.0 * time + 1e-9))
    found = joint.of_shortest_delays(late_fit(tmp_path, command, 0.004, 0.67))
    assert found.fit.model.value(LATE) == pytest.approx(0.004, abs=0.002)


def test_a_delay_of_more_than_a_period_is_kept_where_the_command_does_not_repeat_itself(tmp_path):
    command = np.repeat(6.5 * np.sign(np.random.default_rng(3).standard_normal(100)), 5)
    fit = late_fit(tmp_path, command, 0.4, 0.4)
    assert joint.of_shortest_delays(fit) is fit
