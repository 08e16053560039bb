"""What cannot be known is said: sums instead of splits, intervals, aliases, directions in words, closure."""

import re
from dataclasses import replace

import numpy as np
import pytest

from machines import CATALOGUE, hopper, record
from rhythmid.errors import InputError
from rhythmid.identify.bound import expected_fit
from rhythmid.identify.identifiability import Offset, aliases, delays_of, offset_of
from rhythmid.identify.identification import Delays
from rhythmid.identify.identify import identify
from rhythmid.identify.joint import JointFit, joint_likelihood
from rhythmid.identify.natural_size import natural_size
from rhythmid.identify.output_error import Fit, estimate
from rhythmid.identify.series import prepare
from rhythmid.identify.undetermined import possible_step, undetermined
from rhythmid.model import Model
from rhythmid.offline_run import simulate
from rhythmid.record.record import Record
from rhythmid.value import Value

SPEC = {"type": "chirp", "amplitude": 0.05, "band": [0, 7], "sweep": 12.0}
DELAYS = (0.04, 0.055)


def later(channel, shift: float):
    return replace(channel, time=channel.time + shift)


def delayed_forcing(total: float, seed: int) -> Record:
    """A record whose forcing came through the delayed command channel: a machine without input delay, all of it later."""
    made = record(hopper(), SPEC, delays=(0.0, 0.0), std=5e-6, seed=seed)
    return replace(made, output=later(made.output, total))


@pytest.fixture(scope="module")
def joint() -> JointFit:
    return joint_likelihood(record(hopper(), SPEC, delays=DELAYS, std=5e-6), hopper())


def both(delays: Delays) -> tuple[float | None, float | None]:
    return delays.input.value, delays.measurement.value


def test_forcing_on_the_robot_gives_both_delays_and_prints_the_assumption(joint):
    found = delays_of(joint)
    assert found.separable and found.input.value == pytest.approx(0.04, abs=2e-4)
    assert "without delay" in found.assumption and "δ_f = 0" in found.assumption


def test_the_closure_of_a_right_model_is_near_zero(joint):
    found = delays_of(joint).observables
    assert found is not None and abs(found.z) < 4.0
    assert found.phase.value == pytest.approx(0.055, abs=1e-5)
    assert found.slope.value == pytest.approx(0.095, abs=1e-3)


def test_a_wrong_phase_of_the_forcing_breaks_the_closure_or_moves_the_split_only():
    made = record(hopper(), SPEC, delays=DELAYS, std=5e-6)
    assert made.forcing is not None
    found = delays_of(
        joint_likelihood(replace(made, forcing=later(made.forcing, -0.01)), hopper()), "on_robot"
    )
    assert found.sum.value == pytest.approx(0.095, abs=2e-4)  # the sum does not depend on it
    assert found.measurement.value == pytest.approx(0.065, abs=2e-4)


def test_forcing_through_the_delayed_channel_gives_the_sum_and_refuses_to_split():
    total = 0.23  # however it divides, the record is the same
    found = delays_of(joint_likelihood(delayed_forcing(total, seed=0), hopper()))
    assert not found.separable and both(found) == (None, None)
    assert abs(found.sum.value - total) < 5.0 * found.sum.std
    low, high = found.intervals["input"]
    assert low == 0.0 and high == pytest.approx(total, abs=2e-3)


def test_the_users_word_that_the_forcing_is_delayed_is_taken(joint):
    found = delays_of(joint, "delayed")
    assert not found.separable and both(found) == (None, None) and found.sum.value is not None


def test_an_unknown_clock_offset_leaves_intervals_and_a_bound_narrows_them(joint):
    free = delays_of(joint, "clock_unknown")
    bounded = delays_of(joint, "clock_unknown", Offset(-0.005, 0.01))
    assert not free.separable and not bounded.separable
    assert free.intervals["input"] == pytest.approx((0.0, 0.095), abs=1e-3)
    assert bounded.intervals["input"] == pytest.approx((0.035, 0.050), abs=1e-3)
    assert bounded.intervals["measurement"] == pytest.approx((0.045, 0.060), abs=1e-3)


def test_a_prior_on_the_clock_offset_gives_delays_with_its_uncertainty(joint):
    found = delays_of(joint, "clock_unknown", Offset(std=1e-3))
    assert found.separable and found.input.std == pytest.approx(1e-3, rel=0.05)


def test_clock_offsets_that_contradict_themselves_are_refused():
    with pytest.raises(InputError, match="lower comes first"):
        offset_of((0.01, -0.01), None)
    with pytest.raises(InputError, match="one of the two"):
        offset_of((-0.01, 0.01), 0.001)


def test_a_machine_without_forcing_gives_the_sum_only():
    made = replace(record(hopper(), SPEC, forcing=0.0, delays=DELAYS, std=5e-6), forcing=None)
    found = delays_of(joint_likelihood(made, hopper()))
    assert not found.separable and both(found) == (None, None)
    assert found.sum.value == pytest.approx(0.095, abs=1e-3)


def test_delays_beyond_a_period_have_aliases(joint):
    late = joint.fit.model.with_values({"input_delay.delay": 0.04, "measurement_delay.delay": 1.055})
    pairs = aliases(replace(joint, fit=replace(joint.fit, model=late)))
    assert pairs == (pytest.approx((1.04, 0.055)),)
    assert aliases(joint) == ()


@pytest.fixture(scope="module")
def with_free_gravity(joint) -> Model:
    """A model in which gravity and rest length act alike."""
    gravity = joint.fit.model.parameters["gravity.acceleration"]
    return hopper().with_parameters({"gravity.acceleration": replace(gravity, fixed=False)})


@pytest.fixture(scope="module")
def searched(joint, with_free_gravity) -> Fit:
    return joint_likelihood(joint.records, with_free_gravity).fit


@pytest.mark.parametrize("search", [True, False])
def test_parameters_that_act_alike_are_named(joint, searched, with_free_gravity, search):
    fit = searched if search else estimate(with_free_gravity, prepare(joint.records), iterations=6)
    words = [d.words for d in undetermined(fit)]
    assert len(words) == 1
    assert re.search(r"gravity.acceleration by [-+][\d.e-]+ m/s\^2", words[0])
    assert re.search(r"linear_spring.rest_length by [-+][\d.e-]+ m\b", words[0])
    assert fit.std["gravity.acceleration"] > 1e3 and fit.std["linear_spring.rest_length"] > 1e3


def test_what_is_undetermined_leaves_the_other_intervals_alone(joint, searched):
    for name in ("input_delay.delay", "measurement_delay.delay", "switched_damper.stance"):
        assert searched.std[name] == pytest.approx(joint.fit.std[name], rel=0.05)


AT_REST = """
inertia: {mass: {value: 1.0, unit: kg, fixed: true}}
force:
  - linear_spring: {stiffness: {value: 200.0, unit: N/m}, rest_length: {value: 0.0, unit: m}}
  - viscous_damper: {damping: {value: 2.0, unit: N*s/m}}
"""
SWEEP = {
    "excitation": SPEC | {"amplitude": 1.0},
    "forcing": {"amplitude": 0.0},
    "noise": {"measurement_std": 1e-5},
}


@pytest.fixture(scope="module")
def about_zero() -> Record:
    """A record of a spring whose true rest length is 0."""
    return simulate(Model.from_text(AT_REST), SWEEP).record


def test_an_undetermined_parameter_is_given_no_value(about_zero):
    pushed = Model.from_text(AT_REST).with_element(CATALOGUE["constant_force"], {"force": 0.1})
    found = identify(about_zero, pushed)  # the push moves what the rest length moves
    assert found.parameters["constant_force.force"].value is None
    assert found.parameters["linear_spring.stiffness"].value == pytest.approx(200.0, rel=1e-3)
    assert "constant_force.force" in " ".join(found.delays.undetermined)


@pytest.mark.parametrize("start", [0.0, 0.01])
def test_a_rest_length_that_is_zero_is_determined(about_zero, start):
    guess = Model.from_text(AT_REST).with_values({"linear_spring.rest_length": start})
    found = identify(about_zero, guess)
    rest = found.parameters["linear_spring.rest_length"]
    assert abs(rest.value) < 4.0 * rest.std < 1e-4
    assert found.delays.undetermined == ()


def test_a_parameter_that_the_motion_never_feels_is_told(about_zero):
    stop = CATALOGUE["end_stop_contact"]
    model = Model.from_text(AT_REST).with_element(stop, {"stiffness": 1e4, "position": 10.0, "side": 1.0})
    fixed = replace(model.parameters["end_stop_contact.position"], fixed=True)
    found = identify(about_zero, model.with_parameters({"end_stop_contact.position": fixed}))
    assert "nothing in the records determines end_stop_contact.stiffness" in found.delays.undetermined
    assert found.parameters["end_stop_contact.stiffness"].value is None
    assert not any("rest_length" in words for words in found.delays.undetermined)


def test_parameters_whose_effect_drowns_in_the_noise_are_told():
    still = simulate(Model.from_text(AT_REST), SWEEP | {"excitation": SPEC | {"amplitude": 1e-7}}).record
    told = " ".join(one.words for one in undetermined(expected_fit(Model.from_text(AT_REST), still, 1e-5)))
    assert "linear_spring.stiffness" in told and "viscous_damper.damping" in told
    assert "rest_length" not in told  # where it comes to rest is seen as well as ever


@pytest.mark.parametrize(
    ("unit", "size"),
    [
        ("m", 0.02), ("N", 1.5), ("N/m", 75.0), ("N*s/m", 7.5), ("N*s^2/m^2", 37.5), ("m/s", 0.2), ("1/m", 50.0), ("Hz", 10.0),
        ("kg", 2.0), ("1", 1.0), ("rad", 1.0), ("ohm", None),
    ],
)  # fmt: skip
def test_a_parameter_is_measured_by_what_it_would_have_to_be_to_matter(scales, unit, size):
    known = replace(scales, effort=1.5, position=0.02, mass=2.0, frequency=10.0 / (2.0 * np.pi))
    assert natural_size(unit, known) == (size if size is None else pytest.approx(size))


@pytest.mark.parametrize(
    ("delay", "bounds", "expected"),
    [
        (0.03, (0.0, 0.3), [5e-7, -0.01]),  # a tenth of the size of a time
        (0.002, (0.0, 0.3), [-5e-7, 0.01]),  # there is no room below
        (0.002, (0.0, 0.004), [1e-7, -0.002]),
        (0.0, (0.0, 0.0), [5e-7, -0.01]),
    ],
)
def test_parameters_that_change_together_change_by_what_is_possible(delay, bounds, expected):
    known = [Value(1.2, "kg", bounds=(0.0, np.inf)), Value(delay, "s", bounds=bounds)]
    found = possible_step(known, np.array([1.0, -2e4]), np.array([1.2, 0.1]))
    np.testing.assert_allclose(found, expected)


def test_what_a_design_leaves_in_doubt_is_no_rest_length_of_zero(about_zero):
    fit = expected_fit(Model.from_text(AT_REST), about_zero, 1e-5)
    assert undetermined(fit) == []
