"""Force scoring: a simulation tied to its record shows the force that the model lacks, and nothing where it lacks none."""

from dataclasses import replace

import numpy as np
import pytest

from rhythmid.identify.force_scoring import observed
from rhythmid.identify.output_error import estimate
from rhythmid.identify.series import prepare
from rhythmid.model import Model
from rhythmid.record.record import Channel, Record

MODEL = Model.from_text("""
inertia: {mass: {value: 2.0, unit: kg}}
force: [{viscous_damper: {damping: {value: 8.0, unit: N*s/m}}}]
""")
TIME = np.arange(0.0, 10.0, 2e-3)
RATE = 2.0 * np.pi * 0.7


def record(constant: float = 0.0) -> Record:
    """A mass of 2 kg on a damper that follows 0.1 sin(ω t), pushed by a constant force that no channel tells."""
    motion = 0.1 * np.sin(RATE * TIME)
    effort = -2.0 * RATE**2 * motion + 8.0 * 0.1 * RATE * np.cos(RATE * TIME) - constant
    return Record("mass", Channel(TIME, motion, "m"), Channel(TIME, effort, "N"), hold="band_limited")


def test_a_model_that_lacks_nothing_leaves_nothing():
    fit = estimate(MODEL.with_values({"inertia.mass": 1.5, "viscous_damper.damping": 12.0}),
                   observed(prepare([record()]), MODEL, 3.0))  # fmt: skip
    assert fit.model.value("inertia.mass") == pytest.approx(2.0, rel=1e-4)
    assert fit.model.value("viscous_damper.damping") == pytest.approx(8.0, rel=1e-4)
    assert fit.nrmse() < 1e-4


def test_a_missing_force_stretches_the_observer_by_itself_over_its_stiffness():
    series = observed(prepare([record(constant=0.5)]), MODEL, 3.0)
    fit = estimate(MODEL, series, names=())
    observer = series[0].observer
    assert observer is not None
    assert np.median(fit.residuals[0]) == pytest.approx(-0.5 / (2.0 * observer.stiffness), rel=1e-3)


def test_a_machine_without_inertia_or_forces_is_not_drawn_through_a_noisy_record():
    exact = record()
    noise = 1e-3 * np.random.default_rng(1).standard_normal(len(TIME))
    noisy = replace(exact, output=replace(exact.output, value=exact.output.value + noise))
    light = MODEL.with_values({"inertia.mass": 0.05, "viscous_damper.damping": 0.01})
    fit = estimate(light, observed(prepare([noisy]), MODEL, 8.0))
    for name, true in {"inertia.mass": 2.0, "viscous_damper.damping": 8.0}.items():
        assert abs(fit.model.value(name) - true) < 4.0 * fit.std[name] < 0.2 * true


def test_an_error_is_a_share_of_the_driving_force():
    series = observed(prepare([record(constant=0.5)]), MODEL, 3.0)
    fit = estimate(MODEL, series, names=())
    driving = np.std(record().input.value)
    assert fit.nrmse() == pytest.approx(0.5 / driving, rel=0.02)


def test_where_the_velocity_was_measured_a_damper_alone_draws_the_machine():
    moving = record(constant=0.5)
    rate = 0.1 * RATE * np.cos(RATE * TIME)
    spun = Record(
        "spun", Channel(TIME, rate, "m/s"), moving.input, hold="band_limited", output_kind="velocity"
    )
    series = observed(prepare([spun]), MODEL, 3.0)
    observer = series[0].observer
    assert observer is not None and observer.stiffness == 0.0
    fit = estimate(MODEL, series, names=())
    assert np.median(fit.residuals[0]) == pytest.approx(-0.5 / (2.0 * observer.damping + 8.0), rel=1e-2)
