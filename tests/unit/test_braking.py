"""A force that takes energy out of a motion that goes on has the opposite sign, or something else drives the machine."""

from pathlib import Path

import numpy as np
import pytest

from rhythmid.diagnose.admission import admitted
from rhythmid.model import Model
from rhythmid.record.bag_report import quality_report
from rhythmid.record.braking import WHY, braking_notes, takes_energy
from rhythmid.record.read import read_record
from rhythmid.record.record import Channel, Record
from rhythmid.record.signals import Signals
from rhythmid.start.start import start

STEP = 0.01
TIME = STEP * np.arange(3000)
NOISE = np.random.default_rng(3).standard_normal(len(TIME))
PLACE = np.sin(2.0 * TIME) + 0.6 * np.sin(3.3 * TIME + 1.0)
SPEED = np.gradient(PLACE, TIME)
ACCELERATION = np.gradient(SPEED, TIME)
DAMPER = (
    4.0 * SPEED + 2.0 * np.tanh(SPEED / 0.05) + 0.1 * NOISE
)  # force on a damper that a test machine moves


def test_the_force_that_a_damper_exerts_takes_energy_and_the_one_on_it_does_not() -> None:
    assert takes_energy(SPEED, 3.0 - DAMPER)
    assert not takes_energy(SPEED, 3.0 + DAMPER)


@pytest.mark.parametrize(
    "force",
    [ACCELERATION + 0.1 * SPEED, 20.0 * PLACE, NOISE, np.zeros(len(TIME))],
    ids=["inertia", "spring", "noise", "none"],
)
def test_forces_of_inertia_and_springs_and_noise_take_none(force: np.ndarray) -> None:
    assert not takes_energy(SPEED, force) and not takes_energy(SPEED, -force)


def test_a_machine_that_is_slowed_down_loses_energy_as_it_should() -> None:
    assert not takes_energy(np.exp(-0.3 * TIME), -np.exp(-0.3 * TIME))
    dying = np.exp(-0.2 * TIME)
    assert not takes_energy(dying * SPEED, -dying * DAMPER)


@pytest.mark.parametrize(("kind", "value"), [("position", PLACE), ("velocity", SPEED)])
def test_it_is_told_of_positions_and_speeds_and_of_measured_efforts(kind: str, value: np.ndarray) -> None:
    output, force = Channel(TIME, value, ""), Channel(TIME, -DAMPER, "N")
    assert braking_notes(Record("run", output, force, output_kind=kind)) == [f"input: {WHY}"]
    assert braking_notes(Record("run", output, None, output_kind=kind, effort=force)) == [f"effort: {WHY}"]
    assert braking_notes(Record("run", output, Channel(TIME, DAMPER, "N"), output_kind=kind)) == []


def test_init_check_and_diagnose_say_so(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    columns = np.column_stack([TIME, SPEED, -DAMPER])
    np.savetxt(path, columns, delimiter=",", header="t,speed [m/s],force [N]", comments="", fmt="%.6g")
    found = start([path])
    assert f"CHECK input: {WHY}" in found.lines()
    signals = tmp_path / "signals.yaml"
    signals.write_text(found.signals)
    assert f"input: {WHY}" in quality_report(path, signals).notes
    model = Model.from_text("inertia: {mass: 1.0}\nforce: [viscous_damper: {damping: 4.0}]")
    assert f"run: input: {WHY}" in admitted([read_record(path, Signals.load(signals))], [], model).notes
