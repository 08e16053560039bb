"""Inverse dynamics: parameters from recorded efforts, the rows that count, and when the effort can be scored at all."""

from dataclasses import replace

import numpy as np
import pytest
from axes import CATALOGUE, axis, axis_model, frame, frame_model

from rhythmid.errors import InputError
from rhythmid.identify.inverse_dynamics.applicability import applicable
from rhythmid.identify.inverse_dynamics.balance import Balance, stuck
from rhythmid.identify.inverse_dynamics.estimate import FARTHEST, fit_effort, size_of, variation_of
from rhythmid.identify.inverse_dynamics.inversion import FLAT, SECANT
from rhythmid.record.record import Channel, Record
from rhythmid.simulation.effect import effect_along

FRICTION = {"force": 0.3, "transition": 0.02}


def with_friction():
    return axis_model().with_element(CATALOGUE["coulomb_friction"], FRICTION)


def test_mass_damping_and_friction_of_an_axis_come_out_of_its_effort():
    balance = Balance.of([axis()], axis_model())
    fit = fit_effort(balance, with_friction())
    assert fit.model.value("inertia.mass") == pytest.approx(1.0, abs=0.01)
    assert fit.model.value("viscous_damper.damping") == pytest.approx(2.0, abs=0.1)
    assert fit.model.value("coulomb_friction.force") == pytest.approx(0.8, abs=0.03)
    assert fit.error < 0.03 * size_of(balance)


def test_standard_deviations_cover_the_truth():
    fits = [
        fit_effort(Balance.of([axis(seed, friction=0.0)], axis_model()), axis_model()) for seed in range(12)
    ]
    scores = np.array(
        [
            (f.model.value("viscous_damper.damping") - 2.0)
            / f.std[1 + f.names.index("viscous_damper.damping")]
            for f in fits
        ]
    )
    assert np.sqrt(np.mean(scores**2)) < 2.0


def test_jittered_stamps_are_put_on_a_uniform_grid():
    even, uneven = (
        fit_effort(Balance.of([axis(jitter=j)], axis_model()), with_friction()) for j in (0.0, 0.6)
    )
    for name in ("inertia.mass", "coulomb_friction.force"):
        assert uneven.model.value(name) == pytest.approx(even.model.value(name), rel=0.03)


def test_rows_are_the_same_for_all_models_and_leave_out_what_sticks():
    balance = Balance.of([axis()], axis_model())
    assert np.array_equal(Balance.of([axis()], with_friction()).measured, balance.measured)
    assert np.abs(balance.mechanical[:, 1]).min() > balance.stick_speed
    assert 0.0 < balance.stuck < 0.2


def test_a_long_rest_is_left_out_with_what_the_filter_carries_of_it():
    slow = np.zeros(100, bool)
    slow[40:60] = True
    slow[80:82] = True
    out = stuck(slow, 10.0)
    assert out[35:65].all() and not out[34] and not out[65]
    assert out[80:82].all() and not out[79] and not out[82]


def test_an_effort_that_is_late_is_aligned_by_two_samples_at_most():
    record = axis()
    assert record.input is not None
    for late, least, most in ((1.0, 0.6, 1.4), (-1.0, -1.4, -0.6), (12.0, FARTHEST, FARTHEST)):
        effort = Channel(record.input.time - late / 250.0, record.input.value, "N")
        balance = Balance.of([replace(record, input=effort)], axis_model())
        found = fit_effort(balance, with_friction()).alignment / balance.period
        assert least - 1e-9 <= found <= most + 1e-9


def test_a_fit_that_begins_beyond_the_bounds_of_its_alignment_ends_within_them():
    balance = Balance.of([axis()], axis_model())
    found = fit_effort(balance, with_friction(), alignment=10.0 * balance.period).alignment / balance.period
    assert abs(found) <= FARTHEST + 1e-9


def test_the_delay_that_a_model_states_is_taken_into_account():
    record = axis()
    assert record.input is not None
    late = replace(record, input=Channel(record.input.time - 0.04, record.input.value, "N"))
    model = axis_model("command: [{input_delay: {delay: {value: 0.04, unit: s, fixed: true}}}]")
    balance = Balance.of([late], model)
    assert abs(fit_effort(balance, model).alignment) < balance.period


def test_a_file_s_prior_holds_what_the_motion_does_not_tell():
    model = axis_model(mass="{value: 1.3, unit: kg, prior: {mean: 1.3, std: 1.0e-6}}")
    balance = Balance.of([axis()], model)
    assert fit_effort(balance, model).model.value("inertia.mass") == pytest.approx(1.3, abs=1e-4)


@pytest.mark.parametrize("kind", ["base_displacement", "base_acceleration"])
@pytest.mark.parametrize("measured", ["position", "acceleration"])
def test_stiffness_of_a_frame_on_a_moving_base_comes_out_of_its_acceleration(kind, measured):
    model = frame_model()
    balance = Balance.of([frame(kind, measured)], model)
    fit = fit_effort(balance, model)
    assert fit.model.value("linear_spring.stiffness") == pytest.approx(150.0, rel=0.02)
    assert "inertia.mass" not in fit.names  # it is what sets the scale


def test_the_effort_is_scored_where_it_makes_the_motion():
    found = applicable([axis()], axis_model())
    assert found.applies and not found.free_run_is_informative
    assert "Hz" in found.reason and found.bandwidth > 1.0
    assert found.balance is not None


@pytest.mark.parametrize(("damping", "held"), [(3.0, True), (0.0, False)])
def test_a_machine_of_which_only_the_speed_is_known_runs_free_where_damping_holds_that(damping, held):
    record = axis()
    speed = Channel(record.output.time, np.gradient(record.output.value, record.output.time), "m/s")
    model = axis_model().with_values({"viscous_damper.damping": damping})
    found = applicable([replace(record, output=speed, output_kind="velocity")], model)
    assert found.recorded and found.free_run_is_informative is held
    assert (found.balance is None) is held  # the rows are needed at once only where no free run comes first


def test_the_effort_is_not_scored_where_the_machine_swings_by_itself():
    found = applicable([axis(free=True)], axis_model())
    assert not found.applies
    assert "swings by itself" in found.reason


def one_speed(change: float) -> Record:
    """An axis with 3 N s/m at the constant speed that 6 N give, the force with steps of this size [N], the position with noise of 1 mm."""
    time = np.arange(0.0, 20.0, 0.01)
    effort = 6.0 + change * np.sign(np.sin(2.0 * np.pi * 0.3 * time))
    position = np.cumsum(effort) * 0.01 / 3.0 + 1e-3 * np.random.default_rng(2).standard_normal(len(time))
    return replace(axis(), output=Channel(time, position, "m"), input=Channel(time, effort, "N"))


def test_an_effort_at_one_operating_point_is_not_scored():
    light = axis_model().with_values({"inertia.mass": 0.01})
    found = applicable([one_speed(0.01)], light)
    assert not found.applies and "one operating point" in found.reason
    assert "one operating point" not in applicable([one_speed(0.3)], light).reason


def test_errors_are_relative_to_the_effort_about_its_mean_in_motions_of_both_directions():
    record = axis()
    assert record.input is not None
    held = replace(record, input=replace(record.input, value=record.input.value + 50.0))
    one, other = (variation_of(Balance.of([r], axis_model())) for r in (record, held))
    assert other == pytest.approx(one, rel=0.05)


def test_errors_are_relative_to_the_effort_itself_in_motions_of_one_direction():
    balance = Balance.of([one_speed(0.3)], axis_model())
    assert variation_of(balance) == pytest.approx(6.0, rel=0.02)


def test_the_effort_is_not_scored_where_it_has_nothing_to_do_with_the_motion():
    record = axis()
    assert record.input is not None
    noise = np.random.default_rng(1).standard_normal(len(record.input.value))
    found = applicable([replace(record, input=replace(record.input, value=noise))], axis_model())
    assert not found.applies


def test_a_record_without_effort_or_base_is_told():
    with pytest.raises(InputError, match="neither an effort"):
        Balance.of([replace(axis(), input=None)], axis_model())
    assert not applicable([replace(axis(), input=None)], axis_model()).applies


def test_a_gain_of_the_actuator_is_inverted_exactly():
    model = axis_model("actuator: [{actuator_gain: {gain: {value: 3.0, unit: '1', fixed: true}}}]")
    balance = Balance.of([axis()], axis_model())
    np.testing.assert_allclose(3.0 * balance.predicted(model), balance.predicted(axis_model()), rtol=1e-9)


@pytest.mark.parametrize(
    ("name", "relative", "tolerance"),
    [
        ("actuator_nonlinearity", {"coefficient": 0.01}, 1e-5),
        ("actuator_nonlinearity", {"coefficient": -0.5}, 1e-5),
        ("actuator_deadband", {"threshold": 0.2}, 0.05),  # nothing comes out of what is within
        ("backlash", {"width": 0.2}, 0.05),
        ("actuator_lag", {"time_constant": 0.005}, 1e-2),
    ],
)
def test_what_goes_into_an_actuator_is_what_it_makes_the_required_effort_of(name, relative, tolerance):
    balance = Balance.of([axis()], axis_model())
    after = balance.required(axis_model())[0]
    size = float(np.std(after))
    units = {"coefficient": size**-2, "threshold": size, "width": size, "time_constant": 1.0}
    values = {own: value * units[own] for own, value in relative.items()}
    into = balance.required(axis_model().with_element(CATALOGUE[name], values))[0]
    path = replace(balance.motions[0].path(after, 0.0 * after, into, False), signal=into)
    made = into + effect_along(CATALOGUE[name], values, axis_model(), path)
    assert np.linalg.norm(made - after) < tolerance * size * np.sqrt(len(after))


def test_beyond_a_saturation_the_effort_that_went_in_stays_finite():
    balance = Balance.of([axis()], axis_model())
    after = balance.required(axis_model())[0]
    limit = 0.8 * float(np.abs(after).max())
    model = axis_model().with_element(CATALOGUE["actuator_saturation"], {"limit": limit})
    into = balance.required(model)[0]
    np.testing.assert_allclose(
        into, np.where(np.abs(after) > limit, 2 * after - np.sign(after) * limit, after)
    )


@pytest.mark.parametrize("share", [1e-3, 0.01, 0.1, 0.5])
def test_a_saturation_below_most_of_the_effort_asks_for_its_excess_and_no_more(share):
    balance = Balance.of([axis()], axis_model())
    after = balance.required(axis_model())[0]
    limit = share * float(np.abs(after).max())
    model = axis_model().with_element(CATALOGUE["actuator_saturation"], {"limit": limit})
    into = balance.required(model)[0]
    excess = np.where(np.abs(after) > limit, after - np.sign(after) * limit, 0.0)
    wrong, width = np.abs(into - after - excess), SECANT * float(np.std(after))
    corner = (
        np.abs(np.abs(after) - limit) < 0.5 * width
    )  # where a secant over it is the slope, and half of it at most is beyond
    assert wrong[~corner].max() < 1e-9 and wrong[corner].max(initial=0.0) < 0.5 * width / FLAT


def test_a_parameter_that_moves_no_row_keeps_no_effort_from_being_scored():
    model = axis_model().with_element(CATALOGUE["linear_spring"], {"stiffness": 1.0, "rest_length": 0.0})
    jump = {"change": 0.1, "time": 7.002}  # between two samples
    found = applicable([axis(jitter=0.0)], model.with_element(CATALOGUE["stiffness_jump"], jump))
    assert found.applies and np.isfinite(found.condition)


def test_a_dead_band_takes_what_it_takes_from_the_effort():
    model = axis_model().with_element(CATALOGUE["actuator_deadband"], {"threshold": 0.1})
    balance = Balance.of([axis()], axis_model())
    plain, dead = balance.required(axis_model())[0], balance.required(model)[0]
    beyond = np.abs(plain) > 0.1
    np.testing.assert_allclose(np.abs(dead - plain)[beyond], 0.1, rtol=1e-9)


def test_a_motor_fed_with_a_voltage_is_balanced_in_volts():
    record = axis(friction=0.0)
    assert record.input is not None
    # u = k_t (V - k_t v) / R with k_t = 0.5 and R = 2, so V = 4 u + 0.5 v
    speed = np.gradient(record.output.value, record.output.time)
    volts = Channel(record.input.time, 4.0 * record.input.value + 0.5 * speed, "V")
    motor = "dc_motor: {torque_constant: {value: 0.7, unit: N/A}, resistance: {value: 2.0, unit: ohm, fixed: true}}"
    model = axis_model(f"actuator: [{{{motor}}}]", mass="{value: 1.0, unit: kg, fixed: true}")
    balance = Balance.of([replace(record, input=volts)], model)
    fit = fit_effort(balance, model)
    assert fit.model.value("dc_motor.torque_constant") == pytest.approx(0.5, rel=0.02)
    assert fit.model.value("viscous_damper.damping") == pytest.approx(2.0, rel=0.1)


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("coulomb_friction", {"force": 50.0, "transition": 0.02}),
        ("asymmetric_coulomb_friction", {"force": 50.0, "asymmetry": 0.3, "transition": 0.02}),
        (
            "stribeck_friction",
            {"force": 50.0, "static_ratio": 1.5, "stribeck_speed": 0.05, "transition": 0.02},
        ),
    ],
)
def test_the_speed_over_which_friction_turns_is_as_declared_however_light_the_mass(name, values):
    balance = Balance.of([axis()], axis_model())
    parts = []
    for mass in (0.01, 1000.0):
        without = axis_model(mass=str(mass))
        with_it = without.with_element(CATALOGUE[name], values)
        parts.append(balance.required(with_it)[0] - balance.required(without)[0])
    np.testing.assert_allclose(*parts, atol=1e-6)
