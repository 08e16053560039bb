"""Calibration of the nominal model: what the records do not determine is kept, and said."""

from types import SimpleNamespace
from typing import Any, Literal

import numpy as np
import pytest

from rhythmid.diagnose import baseline
from rhythmid.diagnose.baseline import NO_ORIGIN, calibrate, with_delays
from rhythmid.elements.catalogue import load_catalogue
from rhythmid.identify import other_starts
from rhythmid.identify.series import Series, prepare
from rhythmid.model import Model
from rhythmid.record.record import Channel, Record
from rhythmid.record.timing import nominal_period
from rhythmid.simulation.transport import INPUT_DELAY
from rhythmid.value import Prior

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


def driven(period: float) -> Series:
    """A series with a command, of this sample period."""
    time = np.arange(0.0, 4.0, period)
    return prepare(
        [Record("driven", Channel(time, np.sin(9.0 * time), "m"), Channel(time, np.cos(9.0 * time), "N"))]
    )[0]


def test_a_delay_that_the_model_lacks_may_be_two_samples_late_or_one_early_and_is_known_to_a_sample():
    model = with_delays(Model.from_text(NOMINAL.format(fixed="")), [driven(4e-3)], CATALOGUE)
    delay = model.parameters[INPUT_DELAY]
    assert delay.bounds == pytest.approx((-6e-3, 1e-2)) and delay.prior == Prior(0.0, pytest.approx(4e-3))


def test_a_delay_that_the_model_has_may_be_as_long_as_its_file_says():
    text = NOMINAL.format(fixed="") + "command: [{input_delay: {delay: {value: 0.02, unit: s}}}]\n"
    own = Model.from_text(text)
    delay = with_delays(own, [driven(4e-3)], CATALOGUE).parameters[INPUT_DELAY]
    assert (
        delay.bounds == pytest.approx((-6e-3, own.parameters[INPUT_DELAY].bounds[1])) and delay.prior is None
    )


@pytest.mark.parametrize(("ratio", "moved"), [(0.6, True), (0.8, False)])
def test_a_delay_far_from_its_start_is_taken_where_it_lowers_the_error_by_far(monkeypatch, ratio, moved):
    model = with_delays(Model.from_text(NOMINAL.format(fixed="")), [driven(0.05)], CATALOGUE)

    def fitted(model: Model, error: float) -> Any:
        return SimpleNamespace(
            model=model,
            names=[INPUT_DELAY],
            chi2=error,
            run=SimpleNamespace(series=[driven(0.05)]),
            noise=None,
            starts=(),
            nrmse=lambda: error,
        )

    monkeypatch.setattr(other_starts, "minimise", lambda model, *_: fitted(model, ratio))
    monkeypatch.setattr(other_starts, "estimate", lambda model, *_, **__: fitted(model, ratio))
    found = baseline._from_far_delays(fitted(model, 1.0), None)
    assert (found.model.value(INPUT_DELAY) > 0.0) is moved


def held(tick: float, period: float, kind: Literal["force", "reference"] = "force") -> Series:
    """A series with a held command of one sample period that comes in pairs where it is a reference, measured with another."""
    stamps, time = np.arange(0.0, 4.0, tick), np.arange(0.0, 4.0, period)
    if kind == "reference":
        stamps[1::2] -= 0.98 * tick
    command = Channel(stamps, np.cos(9.0 * stamps), "N" if kind == "force" else "m")
    output = Channel(time, np.sin(9.0 * time), "m")
    return prepare([Record("held", output, command, hold="zero", input_kind=kind)])[0]


def test_a_reference_in_pairs_is_held_before_the_record_at_its_own_period():
    stamps = held(0.01, 0.05, "reference").inputs.stamps
    assert nominal_period(np.diff(stamps)) == pytest.approx(0.01, rel=0.02)
    assert np.count_nonzero(stamps < 0.0) == pytest.approx(100, abs=2)


def noticed(monkeypatch, delay: float, tick: float, period: float) -> tuple[baseline.Calibration, list[str]]:
    """What is made of a delay that came out so, and what was told meanwhile."""
    model = with_delays(Model.from_text(NOMINAL.format(fixed="")), [held(tick, period)], CATALOGUE)

    def fitted(value: float) -> Any:
        return SimpleNamespace(
            model=model.with_values({INPUT_DELAY: value}), names=[INPUT_DELAY], std={INPUT_DELAY: 1e-5}, nrmse=lambda: 0.01,
            noise=SimpleNamespace(std=1.0),
        )  # fmt: skip

    monkeypatch.setattr(baseline, "estimate", lambda *_, **__: fitted(0.0))
    told: list[str] = []
    return baseline._hold(fitted(delay), [held(tick, period)], None, told.append), told


@pytest.mark.parametrize(("tick", "period"), [(0.01, 0.05), (0.01, 0.01), (0.01, 0.004)])
def test_how_late_a_held_input_acts_is_told_in_samples_of_its_own(monkeypatch, tick, period):
    found, told = noticed(monkeypatch, -0.5 * tick, tick, period)
    assert "about half a sample late" in found.notes[0] and found.reconstructed
    assert told == ["the held input is late by 0.50 sample; reconstructing it between its samples"]


def test_a_delay_of_many_samples_of_the_input_is_not_put_down_to_holding(monkeypatch):
    found, told = noticed(monkeypatch, -0.06, 0.01, 0.05)
    (note,) = found.notes
    assert not found.reconstructed and told == []
    assert "-60.000" in note and "(-6.0 of its samples)" in note and "clocks" in note
