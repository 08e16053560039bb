"""Calibration of the nominal model: what the records do not determine is kept, and said."""

import numpy as np
import pytest

from rhythmid.diagnose.baseline import NO_ORIGIN, calibrate
from rhythmid.elements.catalogue import load_catalogue
from rhythmid.identify.series import prepare
from rhythmid.model import Model
from rhythmid.record.record import Channel, Record

CATALOGUE = load_catalogue()
NOMINAL = """
inertia: {{mass: {{value: 1.3, unit: kg{fixed}}}}}
force:
  - linear_spring: {{stiffness: {{value: 180.0, unit: N/m}}, rest_length: {{value: 0.0, unit: m}}}}
  - viscous_damper: {{damping: {{value: 0.4, unit: N*s/m}}}}
"""


def decay() -> Record:
    time = np.arange(0.0, 6.0, 4e-3)
    noise = 2e-4 * np.random.default_rng(7).standard_normal(len(time))
    return Record("decay", Channel(time, 0.05 * np.exp(-0.2 * time) * np.cos(12.0 * time) + noise, "m"))


@pytest.mark.parametrize(("fixed", "said"), [("", 1), (", fixed: true", 0)])
def test_a_mass_of_which_no_force_tells_is_kept_as_it_was_given_and_it_is_said(fixed, said):
    found = calibrate(Model.from_text(NOMINAL.format(fixed=fixed)), prepare([decay()]), CATALOGUE)
    assert found.fit.model.mass.value == 1.3 and "inertia.mass" not in found.fit.names
    assert found.fit.model.value("linear_spring.stiffness") == pytest.approx(
        1.3 * (12.0**2 + 0.2**2), rel=0.01
    )
    assert len(found.notes) == said and all("1.3 kg" in note for note in found.notes)


def test_where_no_position_is_measured_the_rest_length_is_kept_as_it_was_given_and_it_is_said():
    time = np.arange(0.0, 6.0, 4e-3)
    swing = -0.05 * 12.0**2 * np.exp(-0.2 * time) * np.cos(12.0 * time)
    noisy = swing + 0.02 * np.random.default_rng(8).standard_normal(len(time))
    record = Record("decay", Channel(time, noisy, "m/s^2"), output_kind="acceleration")
    found = calibrate(Model.from_text(NOMINAL.format(fixed=", fixed: true")), prepare([record]), CATALOGUE)
    assert "linear_spring.rest_length" not in found.fit.names and found.notes == (NO_ORIGIN,)
    assert found.fit.model.value("linear_spring.rest_length") == 0.0
