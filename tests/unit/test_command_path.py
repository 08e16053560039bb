"""A lag of the command is one of the actuator where nothing but the recorded command drives."""

from dataclasses import replace

import numpy as np

from rhythmid.diagnose.answer.compose_effort import equivalents_in_command_path, with_equivalents
from rhythmid.elements.catalogue import load_catalogue
from rhythmid.model import Model
from rhythmid.record.record import Channel, Record

CATALOGUE = load_catalogue()
TIME = np.arange(0.0, 1.0, 1e-2)
CHANNEL = Channel(TIME, np.sin(TIME), "N")
COMMANDED = Record("run", CHANNEL, CHANNEL, hold="zero")
PLAIN = Model.from_text("inertia: {mass: {value: 1.0, unit: kg}}\n", catalogue=CATALOGUE)


def test_a_recorded_command_shows_the_lag_of_its_own_path_as_one_of_the_actuator():
    assert equivalents_in_command_path([COMMANDED], PLAIN, CATALOGUE)["actuator_lag"] == "command_lag"


def test_a_measured_effort_or_a_forcing_or_a_controller_tells_them_apart():
    servo = PLAIN.with_element(CATALOGUE["position_control"], {"proportional": 1.0, "derivative": 0.1})
    others = [
        replace(COMMANDED, hold="linear"),
        replace(COMMANDED, effort=CHANNEL),
        replace(COMMANDED, forcing=CHANNEL),
    ]
    assert not any(equivalents_in_command_path([one], PLAIN, CATALOGUE) for one in others)
    assert not equivalents_in_command_path([COMMANDED], servo, CATALOGUE)


def test_the_equivalent_of_a_named_law_stands_beside_it():
    alike = {"actuator_lag": "command_lag"}
    assert with_equivalents((), ["actuator_lag", "coulomb_friction"], alike) == (
        ("actuator_lag", "command_lag"),
    )
    assert with_equivalents((("actuator_lag", "x"),), ["actuator_lag"], alike) == (
        ("actuator_lag", "x", "command_lag"),
    )
    assert with_equivalents((), ["coulomb_friction"], alike) == ()
