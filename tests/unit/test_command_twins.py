"""A lag of the command is one of the actuator where nothing but the recorded command drives."""

from dataclasses import replace

import numpy as np

from rhythmid.diagnose.answer.command_twins import command_twins, with_twins
from rhythmid.elements.catalogue import load_catalogue
from rhythmid.model import Model
from rhythmid.record.record import Channel, Record

CATALOGUE = load_catalogue()
TIME = np.arange(0.0, 1.0, 1e-2)
CHANNEL = Channel(TIME, np.sin(TIME), "N")
COMMANDED = Record("run", CHANNEL, CHANNEL, hold="zero")
PLAIN = Model.from_text("inertia: {mass: {value: 1.0, unit: kg}}\n", catalogue=CATALOGUE)


def test_a_recorded_command_shows_the_lag_of_its_own_path_as_one_of_the_actuator():
    assert command_twins([COMMANDED], PLAIN, CATALOGUE)["actuator_lag"] == "command_lag"


def test_a_measured_effort_or_a_forcing_or_a_controller_tells_them_apart():
    servo = PLAIN.with_element(CATALOGUE["position_control"], {"proportional": 1.0, "derivative": 0.1})
    others = [
        replace(COMMANDED, hold="linear"),
        replace(COMMANDED, effort=CHANNEL),
        replace(COMMANDED, forcing=CHANNEL),
    ]
    assert not any(command_twins([one], PLAIN, CATALOGUE) for one in others)
    assert not command_twins([COMMANDED], servo, CATALOGUE)


def test_the_twin_of_a_named_law_stands_beside_it():
    twins = {"actuator_lag": "command_lag"}
    assert with_twins((), ["actuator_lag", "coulomb_friction"], twins) == (("actuator_lag", "command_lag"),)
    assert with_twins((("actuator_lag", "x"),), ["actuator_lag"], twins) == (
        ("actuator_lag", "x", "command_lag"),
    )
    assert with_twins((), ["coulomb_friction"], twins) == ()
