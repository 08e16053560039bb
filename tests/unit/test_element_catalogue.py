"""Promises that every element of the catalogue keeps."""

from dataclasses import replace
from math import isfinite

import numpy as np
import pytest

from machines import hopper
from rhythmid.diagnose.joints.joint_case import joint_catalogue
from rhythmid.elements.catalogue import load_catalogue
from rhythmid.model import Model
from rhythmid.simulation.plant import Plant
from rhythmid.simulation.signal import spline, zero_order_hold
from rhythmid.simulation.simulate import simulate

CATALOGUE = load_catalogue()
AT_JOINTS = joint_catalogue(CATALOGUE)
NOMINAL = ("gravity", "linear_spring", "switched_damper", "input_delay", "measurement_delay")
# controllers and motors: they change what u is
CONTROLLERS = [
    name for name in CATALOGUE if CATALOGUE[name].acts in ("feedback", "observation", "transducer")
]
ADDABLE = [name for name in CATALOGUE if name not in (*NOMINAL, *CONTROLLERS)]
WITHOUT_STARTS = {
    "periodic_forcing": {"amplitude": 0.5, "frequency": 1.3},
    "measurement_noise": {"std": 1e-3, "correlation": 0.5},
}
# the contract: names that model files and other programs rely on
CONTRACT = [
    "input_delay", "periodic_forcing", "gravity", "linear_spring", "switched_damper", "viscous_damper",
    "constant_force", "measurement_delay", "measurement_noise", "coulomb_friction",
    "asymmetric_coulomb_friction", "stribeck_friction", "quadratic_drag", "flight_damping",
    "switching_threshold", "position_dependent_damping", "cubic_stiffness", "quadratic_stiffness",
    "bilinear_stiffness", "ground_contact_loss", "end_stop_contact", "position_ripple",
    "elastoplastic_hysteresis", "viscoelastic_relaxation", "second_mode", "stiffness_drift", "stiffness_jump",
    "periodic_disturbance", "actuator_lag", "command_lag", "actuator_saturation", "torque_speed_limit", "actuator_deadband",
    "actuator_nonlinearity", "backlash", "actuator_gain", "actuator_fade", "command_hold", "command_jitter",
    "sensor_lag", "sensor_nonlinearity", "sensor_gain", "sensor_offset", "sensor_drift", "sensor_quantisation",
    "measurement_jitter", "clock_skew", "delay_drift",
]  # fmt: skip

STAMPS = np.arange(3001, dtype=np.float64) * 1e-3
SMOOTH = spline(STAMPS, 1.5 * np.sin(2 * np.pi * (0.5 * STAMPS + 0.4 * STAMPS**2)))
CHIRP = zero_order_hold(STAMPS, SMOOTH(STAMPS))
FORCING = spline(STAMPS, np.cos(2 * np.pi * STAMPS))
RELEASE = (0.25, 0.0)  # above the rest length, so that the hopper lifts off


def starts_of(name, scales):
    element = CATALOGUE[name]
    if element.starts is None:
        return [WITHOUT_STARTS[name]]
    return element.starts(scales) or element.starts(
        replace(scales, low=-0.5, high=0.5)
    )  # some need a wide motion


def output(model: Model, max_step: float = 1e-3, command=CHIRP) -> np.ndarray:
    return simulate(model, STAMPS, command, FORCING, RELEASE, max_step, seed=1).output


@pytest.fixture(scope="module")
def without(rig):
    return output(rig.hopper)


def test_the_catalogue_holds_every_name_of_the_contract():
    assert set(CONTRACT) <= set(CATALOGUE)


@pytest.mark.parametrize("name", list(CATALOGUE))
def test_says_what_it_is_in_all_its_fields(name):
    element = CATALOGUE[name]
    assert element.name == name
    assert element.title and element.equation and element.reference
    assert element.size in [parameter.name for parameter in element.parameters] or name in (
        "gravity",
        "dc_motor",
    )
    assert set(element.confusable) <= set(CATALOGUE), "confusable with an element that does not exist"
    assert set(element.special_case_of) <= set(CATALOGUE)
    richer = AT_JOINTS[name].special_case_of  # the more richer laws a law has, the more basic it counts
    assert len(set(richer)) == len(richer)
    assert name not in element.confusable and all(element.confusable.values())
    if element.candidate:
        assert element.starts is not None, "a candidate needs first guesses"
        assert element.confusable
    for parameter in element.parameters:
        assert parameter.description and parameter.unit
        assert parameter.bounds[0] < parameter.bounds[1]
        if parameter.default is not None:
            assert parameter.bounds[0] <= parameter.default <= parameter.bounds[1]
    for source, _ in element.borrows.values():
        owner, _, parameter = source.partition(".")
        assert owner in ("inertia", "simulation") or CATALOGUE[owner].parameter(parameter)


@pytest.mark.parametrize(
    "element",
    [one for one in CATALOGUE.values() if one.starts] + [one for one in AT_JOINTS.values() if one.at_joint],
    ids=lambda one: one.name,
)
def test_first_guesses_are_complete_and_within_bounds(element, scales):
    assert element.starts is not None
    for known in (
        scales,
        replace(scales, residual_frequency=3.3),
        replace(scales, position=1e-5, stiffness=1e6),
    ):
        guesses = element.starts(known)
        assert guesses or element.rotational  # a pendulum's gravity in so small a motion
        for guess in guesses:
            assert {p.name for p in element.parameters if p.default is None} <= set(guess)
            for key, value in guess.items():
                low, high = element.parameter(key).bounds
                assert isfinite(value) and low <= value <= high
            assert guess[element.size] != element.absent
    element.starts(replace(scales, effort=0.0, forcing_frequency=0.0))  # a free decay


@pytest.mark.parametrize("name", ADDABLE)
def test_acts_and_vanishes_when_its_size_is_absent(name, rig, scales, without):
    element = CATALOGUE[name]
    for guess in starts_of(name, scales)[:2]:
        model = rig.hopper.with_element(element, guess)
        with_it = output(model)
        effect = np.abs(with_it - without).max()
        assert effect > 1e-6 or (name == "actuator_saturation" and guess["limit"] > 2.4)
        absent = model.with_values({f"{name}.{element.size}": element.absent})
        assert np.abs(output(absent) - without).max() < 1e-9


@pytest.mark.parametrize("name", [name for name in ADDABLE if CATALOGUE[name].kernel is not None])
def test_one_step_a_millisecond_is_enough(name, rig, scales, without):
    model = rig.hopper.with_element(CATALOGUE[name], starts_of(name, scales)[0])
    coarse, fine = output(model), output(model, max_step=1.25e-4)
    assert np.abs(coarse - fine).max() < 0.015 * np.abs(fine - without).max() + 1e-6


@pytest.mark.parametrize("name", [name for name in ADDABLE if CATALOGUE[name].candidate])
def test_can_be_differentiated_by_finite_differences(name, rig, scales):
    element = CATALOGUE[name]
    guess = starts_of(name, scales)[0]
    model = rig.hopper.with_element(element, guess)
    # a limit of rate meets a held value within its tick or never, which makes kinks, too many to see them all
    given = {"command": SMOOTH, "max_step": 1e-4} if element.memories else {}
    for parameter in element.parameters:
        if parameter.fixed or name == "command_hold":  # ticks move in whole steps of the stamps
            continue
        scale = abs(guess[parameter.name]) or 1.0

        def slope(step, key=f"{name}.{parameter.name}", value=guess[parameter.name], scale=scale):
            up, down = (output(model.with_values({key: value + s * step * scale}), **given) for s in (1, -1))
            return (up - down) / (2 * step * scale)

        fine, coarse = slope(0.002), slope(0.02)
        assert np.linalg.norm(fine - coarse) < 0.25 * np.linalg.norm(coarse), parameter.name


@pytest.mark.parametrize(
    ("name", "length"), [("periodic_disturbance", "frequency"), ("position_ripple", "wavelength")]
)
def test_amplitudes_without_sign_are_guessed_in_all_four_quadrants_of_phase(name, length, scales):
    starts = starts_of(name, replace(scales, residual_frequency=3.3))
    for value in {start[length] for start in starts}:
        phases = np.array([start["phase"] for start in starts if start[length] == value])
        nearest = [np.cos(phases - true).max() for true in np.linspace(0.0, 2.0 * np.pi, 50)]
        assert len(phases) == 4 and min(nearest) > np.cos(0.251 * np.pi)
    assert name != "periodic_disturbance" or starts[0][length] == 3.3  # the line that is there comes first


@pytest.mark.parametrize("name", ADDABLE)
def test_comes_back_from_its_model_file(name, rig, scales):
    model = rig.hopper.with_element(CATALOGUE[name], starts_of(name, scales)[0])
    again = Model.from_text(model.to_yaml(), catalogue=CATALOGUE)
    assert again.parameters == model.parameters
    assert [term.label for term in again.terms] != [] and again.term(name) is not None


def test_what_is_never_estimated_stays_so_through_a_model_file(rig):
    seed = "command_jitter.seed"
    model = rig.hopper.with_element(CATALOGUE["command_jitter"], {"std": 1e-3, "seed": 3.0})
    assert model.parameters[seed].fixed and not model.parameters["command_jitter.std"].fixed
    freed = model.with_parameters({seed: replace(model.parameters[seed], fixed=False)})
    for given in (model, freed):
        assert Model.from_text(given.to_yaml(), catalogue=CATALOGUE).parameters == given.parameters


@pytest.mark.parametrize("name", ADDABLE)
def test_runs_in_the_plant_alike_in_whatever_chunks(name, rig, scales):
    model = rig.hopper.with_element(CATALOGUE[name], starts_of(name, scales)[0])
    stamps = np.arange(400, dtype=np.int64) * 1_000_000
    runs = []
    for chunk in (400, 37):
        plant = Plant(model, 1_000_000, seed=1, initial=RELEASE)
        parts = []
        for first in range(0, 400, chunk):
            now = slice(first, min(first + chunk, 400))
            plant.push_many(stamps[now], 1.5 * np.sin(20.0 * stamps[now] * 1e-9))
            parts.append(plant.advance(int(stamps[now][-1])).position)
        runs.append(np.concatenate(parts))
    assert len(runs[0]) == 400 and np.isfinite(runs[0]).all()
    assert np.array_equal(runs[0], runs[1])


@pytest.mark.parametrize(
    ("name", "parameter"),
    [(e.name, p.name) for e in CATALOGUE.values() for p in e.parameters if isfinite(p.turn)],
)
def test_a_phase_is_told_within_half_a_turn_and_the_effect_is_the_same(name, parameter):
    element = CATALOGUE[name]
    turn = next(p.turn for p in element.parameters if p.name == parameter)
    values = {p.name: 0.7 for p in element.parameters} | {parameter: 2.0 + 3.0 * turn}
    model = hopper().with_element(element, values)
    told = model.unwound()
    assert told.value(f"{name}.{parameter}") == pytest.approx(2.0)
    assert element.kernel is not None
    ahead = (0.3, 0.1, 0.2, 0.4)[: 1 if element.acts == "drive" else 4]
    others = [model.value(f"{name}.{p.name}") for p in element.parameters]
    wound = [told.value(f"{name}.{p.name}") for p in element.parameters]
    assert element.kernel(*ahead, *wound) == pytest.approx(element.kernel(*ahead, *others))


def test_the_angle_at_which_a_pendulum_hangs_is_told_in_the_turn_in_which_it_was_given():
    values = {"moment": 2.0, "reference": 2.9}
    given = hopper().with_element(CATALOGUE["pendulum_gravity"], values)
    wound = given.with_values({"pendulum_gravity.reference": 3.3 + 6.0 * np.pi})
    assert wound.unwound(given).value("pendulum_gravity.reference") == pytest.approx(3.3)


def test_what_is_no_phase_or_is_known_is_not_unwound():
    values = {"amplitude": 9.0, "wavelength": 8.0, "phase": 7.0}
    known = hopper().with_element(CATALOGUE["position_ripple"], values, fixed=True)
    assert known.unwound() == known and hopper().unwound() == hopper()
