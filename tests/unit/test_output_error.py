"""Output-error estimation: truth recovered, intervals that cover, trouble reported."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

import rhythmid as rh
from machines import CATALOGUE, SHORT, hopper, record, records
from rhythmid.errors import InputError
from rhythmid.identify.motion_band import block_length
from rhythmid.identify.multiple_shooting import split, windows
from rhythmid.identify.noise import NoiseModel
from rhythmid.identify.output_error import estimate, start_only
from rhythmid.identify.series import hold_out_tail, prepare
from rhythmid.model import Model
from rhythmid.record.record import Channel, Record
from rhythmid.value import Prior

TRUTH = {
    "input_delay.delay": 0.0203,
    "measurement_delay.delay": 0.0151,
    "linear_spring.stiffness": 200.0,
    "linear_spring.rest_length": 0.2,
    "switched_damper.stance": 2.0,
}


def test_noise_free_records_give_the_true_parameters_from_a_start_a_third_off():
    wrong = hopper().with_values({"linear_spring.stiffness": 260.0, "switched_damper.stance": 1.2})
    fit = estimate(wrong, prepare(records(hopper(), std=0.0)))
    assert fit.converged
    assert fit.model.value("linear_spring.stiffness") == pytest.approx(200.0, rel=2e-5)
    assert fit.model.value("switched_damper.stance") == pytest.approx(2.0, rel=5e-4)
    assert fit.model.value("input_delay.delay") == pytest.approx(0.0203, abs=5e-6)
    assert fit.model.value("measurement_delay.delay") == pytest.approx(0.0151, abs=5e-6)


@pytest.mark.parametrize("correlation", [0.0, 0.8])
def test_intervals_cover_the_truth_under_white_and_coloured_noise(correlation):
    inside = total = 0
    for seed in range(12):
        series = prepare(records(hopper(), SHORT[:2], seed=seed + 1, correlation=correlation))
        fit = estimate(hopper(), series)
        for name, truth in TRUTH.items():
            inside += abs(fit.model.value(name) - truth) < 1.96 * fit.std[name]
            total += 1
    assert inside / total >= 0.85  # 95 % nominal; 60 draws of which five at a time share a record


def test_a_prior_pulls_and_narrows_the_estimate():
    series = prepare(records(hopper(), SHORT[:1]))
    plain = estimate(hopper(), series)
    value = hopper().parameters["switched_damper.stance"]
    prior = replace(value, prior=Prior(2.0, 0.1 * plain.std["switched_damper.stance"]))
    with_prior = estimate(hopper().with_parameters({"switched_damper.stance": prior}), series)
    assert with_prior.std["switched_damper.stance"] < 0.2 * plain.std["switched_damper.stance"]
    assert abs(with_prior.model.value("switched_damper.stance") - 2.0) < abs(
        plain.model.value("switched_damper.stance") - 2.0
    )


def test_a_bound_holds_and_is_reported():
    value = hopper().parameters["linear_spring.stiffness"]
    bounded = hopper().with_parameters(
        {"linear_spring.stiffness": replace(value, bounds=(0.0, 190.0), value=180.0)}
    )
    fit = estimate(bounded, prepare(records(hopper(), SHORT[:1])), iterations=12)
    assert fit.model.value("linear_spring.stiffness") == 190.0
    assert "linear_spring.stiffness" in fit.at_bound


def test_a_model_that_diverges_is_refused_with_what_to_check():
    unstable = hopper().with_element(CATALOGUE["viscous_damper"], {"damping": 0.0})
    value = unstable.parameters["viscous_damper.damping"]
    unstable = unstable.with_parameters(
        {"viscous_damper.damping": replace(value, value=-1e4, bounds=(-1e5, 0.0))}
    )
    with pytest.raises(InputError, match="diverges"):
        estimate(unstable, prepare(records(hopper(), SHORT[:1])))


def test_unseen_records_are_judged_with_nothing_but_their_start_estimated():
    seen = prepare(records(hopper(), SHORT[:1]))
    fit = estimate(hopper(), seen)
    unseen = prepare([record(hopper(), SHORT[1][0], seed=77)], block=seen[0].block)
    judged = start_only(fit.model, unseen, fit.noise, fit.run.max_step)
    assert judged.names == ()
    assert judged.chi2 / judged.samples == pytest.approx(1.0, abs=0.15)


def test_the_hidden_end_is_hidden_from_the_fit_and_judged_apart():
    seen, unseen = hold_out_tail(prepare(records(hopper(), SHORT[:1])))
    assert seen[0].used.sum() + unseen[0].used.sum() == seen[0].blocks
    assert not (seen[0].used & unseen[0].used).any()


def test_windows_keep_all_samples_in_order():
    series = prepare(records(hopper(), SHORT[:1]))[0]
    parts = split(series, 1.0)
    joined = np.concatenate([part.value for part in parts])
    assert len(parts) == 10
    assert np.array_equal(joined, series.value[: len(joined)])
    assert len(series.value) - len(joined) < 4 * series.block


def test_very_many_windows_are_thinned_evenly_and_few_are_all_kept():
    series = prepare(records(hopper(), SHORT[:1]))[0]
    assert len(windows([series], 1.0)) == 10
    count = len(split(series, 0.02))
    kept = windows([series] * 4, 0.02)
    assert 4 * count > 400
    assert 100 <= len(kept) <= 200
    assert kept[-1].time[0] > 0.95 * series.time[-1]
    assert windows([], 1.0) == []


def test_block_averages_of_the_simulation_equal_averages_of_its_samples():
    series = prepare(records(hopper(), SHORT[1:2], std=0.0), block=5)[0]
    centre = series.value[2::5][: series.blocks]
    assert np.abs(series.of_block(centre) - series.averaged)[1:-1].max() < 2e-7


@pytest.mark.parametrize("missing", ["one sample here and there", "a gap", "a little more than a block"])
def test_block_averages_agree_where_samples_are_missing(missing):
    one = records(hopper(), SHORT[1:2], std=0.0)[0]
    whole = one.output
    place = np.arange(len(whole.time))
    lost = {
        "one sample here and there": np.random.default_rng(1).random(len(place)) < 0.03,
        "a gap": (place > 3000) & (place < 3037),
        "a little more than a block": place % 500 < 6,
    }[missing]
    kept = replace(whole, time=whole.time[~lost], value=whole.value[~lost])
    series = prepare([replace(one, output=kept)], block=5)[0]
    wrong = series.of_block(CubicSpline(whole.time, whole.value)(series.centres)) - series.averaged
    assert 0.9 < np.mean(series.used) <= 1.0
    assert np.abs(wrong[1:-1][series.used[1:-1]]).max() < 2e-7


def test_slow_motion_is_averaged_and_fast_motion_is_not():
    t = np.arange(20_000) * 1e-3
    assert block_length(np.sin(2 * np.pi * 1.0 * t), 1e-3) == 10
    assert block_length(np.sin(2 * np.pi * 200.0 * t), 1e-3) == 1


def test_a_motionless_record_is_not_averaged():
    assert block_length(np.full(2000, 0.3), 1e-3) == 1


@pytest.mark.parametrize("what", ["output", "input", "forcing"])
def test_values_that_are_not_finite_are_refused_with_their_place(what):
    one = records(hopper(), SHORT[:1])[0]
    channel = getattr(one, what)
    value = channel.value.copy()
    value[[700, 900]] = np.nan, np.inf
    broken = replace(one, **{what: replace(channel, value=value)})
    with pytest.raises(
        InputError, match=f"2 values of the {what} are not finite, the first of them at t = 0.7"
    ):
        prepare([broken])


@pytest.mark.parametrize(
    ("name", "values"), [("backlash", {"width": 0.4}), ("actuator_rate_limit", {"rate": 6.0})]
)
def test_what_an_actuator_remembers_at_a_records_start_is_found(name, values):
    machine, noise = hopper().with_element(CATALOGUE[name], values), NoiseModel(np.empty(0), 1e-5)
    whole = records(machine, SHORT[1:2], std=1e-5, delays=(0.0, 0.0))[0]
    for start in (1.3, 1.5, 1.7):
        fit = start_only(machine, prepare([whole.cut(start, 9.0)]), noise, 5e-4)
        assert np.sqrt(fit.chi2 / fit.samples) < 1.1


@pytest.mark.parametrize("start", [1.3, 1.5, 1.7, 2.0])
def test_how_far_a_hysteresis_is_stretched_at_a_records_start_is_found(start):
    values = {"stiffness": 190.0, "yield_displacement": 1e-3}
    machine = hopper().with_element(CATALOGUE["elastoplastic_hysteresis"], values)
    machine = machine.with_element(CATALOGUE["sensor_lag"], {"time_constant": 0.03})
    whole = records(machine, SHORT[1:2], std=1e-5, delays=(0.0, 0.0))[0]
    fit = start_only(machine, prepare([whole.cut(start, 9.0)]), NoiseModel(np.empty(0), 1e-5), 5e-4)
    assert np.sqrt(fit.chi2 / fit.samples) < 1.1


def test_the_start_of_a_record_without_command_is_found_beside_a_lag_that_stays_at_rest():
    """The lag has nothing to remember there, and is kept at rest as firmly as ever; position and velocity are still sought."""
    machine = hopper().with_element(CATALOGUE["command_lag"], {"time_constant": 0.03})
    noise = NoiseModel(np.empty(0), 1e-4)
    for silent in records(machine, SHORT[2:], delays=(0.0, 0.0)):
        fit = start_only(machine, prepare([silent.cut(2.13, 6.0)]), noise, 5e-4)
        assert np.sqrt(fit.chi2 / fit.samples) < 1.05
        assert abs(fit.starts[0][2]) < 1e-9


def test_a_mass_that_the_records_do_not_determine_is_not_put_to_its_bound_of_zero():
    time = np.arange(0.0, 6.0, 4e-3)
    rng = np.random.default_rng(7)
    decay = 0.05 * np.exp(-0.2 * time) * np.cos(12.0 * time) + 2e-4 * rng.standard_normal(len(time))
    model = Model.from_text("""
inertia: {mass: {value: 1.3, unit: kg}}
force:
  - linear_spring: {stiffness: {value: 180.0, unit: N/m}, rest_length: {value: 0.0, unit: m, fixed: true}}
  - viscous_damper: {damping: {value: 0.4, unit: N*s/m}}
""")
    fit = estimate(model, prepare([Record("decay", Channel(time, decay, "m"))]))
    mass, stiffness = fit.model.value("inertia.mass"), fit.model.value("linear_spring.stiffness")
    assert stiffness / mass == pytest.approx(12.0**2, rel=0.01)
    assert fit.std["inertia.mass"] > mass  # only ratios are determined


def test_an_angle_at_rest_that_the_start_of_a_speed_makes_up_for_stays_where_it_is():
    swinging = Model.from_text(
        "inertia: {mass: {value: 0.03, unit: kg*m^2}}\nforce: [{viscous_damper: {damping: {value: 0.05, unit: N*m*s/rad}}}]"
    ).with_element(CATALOGUE["pendulum_gravity"], {"moment": 0.1, "reference": 0.2})
    run = {
        "duration": 15.0,
        "excitation": {"type": "chirp", "amplitude": 0.05, "sweep": 15.0, "band": [0.2, 2.0]},
    }
    position = rh.simulate(swinging, run).record
    speed = np.gradient(position.output.value, position.output.time)
    record = replace(position, output=replace(position.output, value=speed), output_kind="velocity")
    fit = estimate(swinging.with_values({"pendulum_gravity.moment": 0.05}), prepare([record]))
    assert fit.model.value("pendulum_gravity.moment") == pytest.approx(0.1, rel=0.01)
    assert fit.model.value("pendulum_gravity.reference") == pytest.approx(0.2, abs=0.05)
    assert fit.std["pendulum_gravity.reference"] > 1e6


@pytest.mark.parametrize("turns", [0, 3])
def test_a_pendulum_is_told_to_hang_in_the_turn_in_which_it_was_given(turns):
    time, state, angle = 0.01 * np.arange(600), np.array([0.9, 0.0]), []
    for _ in time:
        angle.append(state[0])
        for _ in range(10):
            state = state + 1e-3 * np.array([state[1], -20.0 * np.sin(state[0]) - 0.1 * state[1]])
    text = """
units: {force: rad/s^2, position: rad, mass: "1"}
inertia: {mass: {value: 1.0, fixed: true}}
force:
  - pendulum_gravity: {moment: {value: 21.0}, reference: {value: 0.1}}
  - viscous_damper: {damping: {value: 0.1}}
"""
    given = 0.1 + 2.0 * np.pi * turns
    model = Model.from_text(text, catalogue=CATALOGUE).with_values({"pendulum_gravity.reference": given})
    fit = estimate(model, prepare([Record("swing", Channel(time, np.array(angle), "rad"))]))
    assert fit.model.value("pendulum_gravity.reference") == pytest.approx(2.0 * np.pi * turns, abs=0.02)
