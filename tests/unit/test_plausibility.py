"""Channels declared in another unit, with the sign turned round, or exchanged: what the user reads, and when nothing is said."""

import math
from dataclasses import replace

import numpy as np
import pytest

from rhythmid.elements.catalogue import load_catalogue
from rhythmid.errors import InputError
from rhythmid.identify.channel_change import Change
from rhythmid.identify.identify import identify
from rhythmid.identify.plausibility import check_plausible, likely_mend
from rhythmid.model import Model
from rhythmid.record.record import Channel, Record
from rhythmid.simulation.signal import zero_order_hold
from rhythmid.simulation.simulate import simulate

PENDULUM = """
inertia: {{mass: {{value: {mass}, unit: kg*m^2{fixed}}}}}
force:
  - viscous_damper: {{damping: {{value: {damping}, unit: N*m*s/rad}}}}
  - pendulum_gravity: {{moment: {{value: {moment}, unit: N*m}}}}
"""
SLIDE = """
inertia: {{mass: {{value: {mass}, unit: kg{fixed}}}}}
force:
  - viscous_damper: {{damping: {{value: {damping}, unit: N*s/m}}}}
  - linear_spring: {{stiffness: {{value: {stiffness}, unit: N/m}}, rest_length: {{value: 0.0, unit: m, fixed: true}}}}
"""
FIXED = ", fixed: true"


def driven(truth: Model, unit: str, size: float) -> Record:
    """12 s of a machine that a sum of sines drives, at 100 Hz with a little noise."""
    rng = np.random.default_rng(3)
    time = np.arange(0.0, 12.0, 0.01)
    lines = np.linspace(0.2, 2.5, 12)
    waves = np.sin(2.0 * np.pi * lines[:, None] * time + rng.uniform(0.0, 2.0 * np.pi, 12)[:, None])
    effort = size * waves.sum(axis=0)
    motion = simulate(truth, time, zero_order_hold(time, effort), None, (0.0, 0.0)).output
    motion = motion + 1e-3 * np.std(motion) * rng.standard_normal(len(time))
    return Record("log", Channel(time, motion, unit), Channel(time, effort, "N*m" if unit == "rad" else "N"))


def slide(fixed: bool, mass: float = 1.0, damping: float = 2.0, stiffness: float = 60.0) -> Model:
    return Model.from_text(
        SLIDE.format(mass=mass, damping=damping, stiffness=stiffness, fixed=FIXED if fixed else "")
    )


def pendulum(fixed: bool = True, mass: float = 0.05, damping: float = 0.05, moment: float = 0.9) -> Model:
    return Model.from_text(
        PENDULUM.format(mass=mass, damping=damping, moment=moment, fixed=FIXED if fixed else "")
    )


@pytest.fixture(scope="module")
def swinging() -> Record:
    return driven(pendulum(), "rad", 0.1)


@pytest.fixture(scope="module")
def sliding() -> Record:
    return driven(slide(True), "m", 0.5)


def spoilt(record: Record, change: Change) -> Record:
    made = change.applied(record)
    assert made is not None
    return made


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (
            Change("output", 180.0 / math.pi),
            "the output looks like degrees, where rad is declared: give it scale: 0.0174533 under 'output:' in signals.yaml",
        ),
        (
            Change("output", 1e3),
            "the output looks like milliradians, where rad is declared: give it scale: 0.001 under 'output:'",
        ),
        (
            Change("input", -1.0),
            "the input seems to have its sign turned round: give it scale: -1 under 'input:' in signals.yaml (or give it scale: -1 under "
            "'output:' in signals.yaml: the record does not tell which)",
        ),
        (
            Change("exchange"),
            "input and output seem to be exchanged: exchange 'input:' and 'output:' in signals.yaml",
        ),
        (
            Change("input", 1.0 / 0.085),
            "such as a motor's current in A where N*m is declared: give it scale: 0.0",
        ),
    ],
)
def test_what_a_pendulums_record_is_spoilt_by_is_named_with_its_mend(swinging, change, words):
    with pytest.raises(InputError) as refused:
        check_plausible(pendulum(moment=0.8), [spoilt(swinging, change)])
    said = str(refused.value)
    assert said.startswith("log: ") and words in said
    assert "\n" not in said and "with it the nominal model misses" in said


def test_millimetres_are_named_for_a_machine_that_slides(sliding):
    with pytest.raises(
        InputError, match="the output looks like millimetres, where m is declared: give it scale: 0.001"
    ):
        check_plausible(slide(True, stiffness=70.0), [spoilt(sliding, Change("output", 1e3))])


def test_what_a_free_mass_makes_up_for_is_a_warning_with_the_shift(sliding):
    told = check_plausible(slide(False, mass=1.2), [spoilt(sliding, Change("output", 1e3))])
    assert told is not None
    assert "the output looks like millimetres" in told
    assert "without it the model's values come out" in told and "times larger or smaller than given" in told


def test_amperes_that_a_free_mass_makes_up_for_are_a_warning_too(sliding):
    told = check_plausible(slide(False), [spoilt(sliding, Change("input", 12.0))])
    assert told is not None and "about 12 times too small, such as a motor's current in A" in told


@pytest.mark.parametrize("fixed", [True, False])
def test_of_a_sound_record_nothing_is_said(sliding, swinging, fixed):
    assert likely_mend(slide(fixed, stiffness=90.0), [sliding]) is None
    assert likely_mend(pendulum(fixed, moment=0.7), [swinging]) is None


def test_identify_refuses_degrees_and_names_the_scale(swinging):
    wrong = spoilt(swinging, Change("output", 180.0 / math.pi))
    with pytest.raises(InputError, match="looks like degrees.*scale: 0.0174533"):
        identify(wrong, pendulum(moment=0.8))


def test_a_fit_that_leaves_more_than_a_fifth_of_the_motion_is_not_usable_and_says_so_first(sliding):
    walking = replace(
        sliding,
        output=replace(
            sliding.output,
            value=np.cumsum(np.random.default_rng(0).standard_normal(len(sliding.output))) * 0.01,
        ),
    )
    found = identify(walking, slide(True)).to_dict()
    assert found["usable"] is False
    assert found["warnings"][0]["name"] == "not_identified"
    assert found["warnings"][0]["text"].startswith("not identified: the fit leaves")


def test_a_mass_of_four_times_the_nominal_and_a_damping_at_zero_are_warnings_with_a_question(sliding):
    heavy = identify(sliding, slide(False, mass=0.2)).to_dict()
    assert heavy["usable"] is True
    (mass,) = [one for one in heavy["warnings"] if one["parameter"] == "inertia.mass"]
    assert mass["name"] == "large_shift" and "the fit may be absorbing missing physics" in mass["text"]
    assert "5 times the nominal 0.2" in mass["text"] and mass["question"].endswith("`rhythmid diagnose`.")
    free = driven(slide(True, damping=0.002), "m", 0.05)
    (damping,) = identify(free, slide(True)).to_dict()["warnings"]
    assert damping["parameter"] == "viscous_damper.damping"
    assert damping["name"] in ("value_at_zero", "large_shift")


def test_a_delay_of_more_than_ten_samples_is_a_warning(sliding):
    output = sliding.output
    late = replace(sliding, output=replace(output, time=output.time + 0.15))
    (warning,) = identify(late, slide(True)).to_dict()["warnings"]
    assert warning["name"] == "long_delay"
    assert "samples more than the nominal 0 ms" in warning["text"]
    assert warning["value"] == pytest.approx(0.15, abs=0.02)


def test_a_delay_below_zero_is_a_warning_that_says_what_it_may_mean(sliding):
    output = sliding.output
    early = replace(sliding, output=replace(output, time=output.time - 0.01))
    (warning,) = identify(early, slide(True)).to_dict()["warnings"]
    assert warning["name"] == "negative_delay" and warning["parameter"] == "delay: sum"
    assert warning["value"] == pytest.approx(-0.01, abs=0.002)
    assert (
        "no machine answers before it is asked: the fit may be absorbing missing physics" in warning["text"]
    )
    assert all(word in warning["question"] for word in ("clocks", "held", "limit or other physics"))


def test_a_sound_record_is_usable_without_a_warning_and_says_why_there_are_no_transfer_functions(sliding):
    found = identify(sliding, slide(True, stiffness=70.0)).to_dict()
    assert (found["usable"], found["warnings"], found["harmonics"]) == (True, [], [])
    assert found["transfer_functions"]["missing"].startswith("no periodic forcing is known")
    assert found["methods"]["paper"] == {}


TURNTABLE = Model.from_text("""
inertia: {mass: {value: 2.35, unit: kg*m^2}}
force:
  - viscous_damper: {damping: {value: 3.0, unit: N*m*s/rad}}
""")
RUBBING = {"force": 12.0, "transition": 0.01}


def turning(truth: Model, torque: float, ripple: float) -> Record:
    """6 s of a machine that a nearly constant torque turns from rest in one direction, at 100 Hz with a little noise."""
    time = np.arange(0.0, 6.0, 0.01)
    effort = torque + ripple * np.sin(2.0 * np.pi * 1.3 * time)
    motion = simulate(truth, time, zero_order_hold(time, effort), None, (0.0, 0.0)).output
    motion = motion + 1e-3 * np.random.default_rng(4).standard_normal(len(time))
    return Record("turning", Channel(time, motion, "rad"), Channel(time, effort, "N*m"))


def test_dry_friction_that_scales_inertia_and_damping_alike_is_no_unit():
    # one torque T in one direction leaves T − F for mass and damper: without the friction both come out T / (T − F) times larger
    rubbing = TURNTABLE.with_element(load_catalogue()["coulomb_friction"], RUBBING)
    assert likely_mend(TURNTABLE, [turning(rubbing, 15.0, 0.2)]) is None
    told = likely_mend(TURNTABLE, [spoilt(turning(TURNTABLE, 3.0, 0.2), Change("input", 5.0))])
    assert (
        told is not None and told.change.role == "input" and told.change.factor == pytest.approx(0.2, rel=0.1)
    )


def test_a_friction_that_is_missing_too_does_not_hide_the_unit():
    rubbing = slide(True).with_element(
        load_catalogue()["coulomb_friction"], {"force": 0.2, "transition": 0.01}
    )
    told = likely_mend(slide(False), [spoilt(driven(rubbing, "m", 0.5), Change("input", 12.0))])
    assert told is not None and told.change.factor == pytest.approx(1.0 / 12.0, rel=0.3)


def test_a_constant_input_is_not_taken_for_a_motion_that_was_exchanged_with_it():
    time = np.arange(0.0, 6.0, 0.005)
    speed = 5.0 * (1.0 - np.exp(-np.maximum(time - 0.05, 0.0) / 0.1))
    speed *= 1.0 + 0.2 * np.sin(9.0 * time)  # more than a fifth of the motion is nothing that the model does
    record = Record(
        "step", Channel(time, speed, "rad/s"), Channel(time, np.full(len(time), 0.3), "N*m"), output_kind="velocity"
    )  # fmt: skip
    assert Change("exchange").applied(record) is None
    model = Model.from_text(
        "inertia: {mass: {value: 0.005, unit: kg*m^2}}\nforce: [viscous_damper: {damping: {value: 0.06, unit: N*m*s/rad}}]"
    )
    assert check_plausible(model, [record]) is None
