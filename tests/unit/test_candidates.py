"""Which elements a search tries, with which first guesses, and what it says of the others."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rhythmid.elements.candidates import IDLE, LEVEL, STEADY, candidates
from rhythmid.elements.catalogue import load_catalogue, load_element
from rhythmid.elements.element import Element, Parameter, Scales
from rhythmid.elements.first_guess import NoGuess
from rhythmid.errors import InputError
from rhythmid.identify.record_scales import scales as scales_of
from rhythmid.identify.series import prepare
from rhythmid.model import Model
from rhythmid.record.record import Channel, Record

CATALOGUE = load_catalogue()
SPRING = (
    "inertia: {mass: 1.0}\nforce: [{linear_spring: {stiffness: 200.0, rest_length: {value: 0.0, fixed: %s}}}]"
)
PENDULUM = "inertia: {mass: {value: 0.02, unit: kg*m^2}}\nforce: [{linear_spring: {stiffness: 1.0}}]"


def law(*parameters: Parameter, size: str = "", absent: float = 0.0, candidate: bool = True) -> Element:
    """A force law of these parameters without first guesses of its own."""
    return Element(
        name="law",
        slot="force",
        title="Law",
        equation="F",
        parameters=parameters,
        reference="test",
        kernel=lambda *arguments: 0.0,
        size=size or parameters[0].name,
        absent=absent,
        candidate=candidate,
    )


def tried(model: Model, scales: Scales, catalogue=CATALOGUE) -> dict[str, list[str | None]]:
    """Against what each element acts that is tried, by its name."""
    found: dict[str, list[str | None]] = {}
    for element, _ in candidates(catalogue, model.setting, scales).tried:
        if element.against not in found.setdefault(element.name, []):
            found[element.name].append(element.against)
    return found


def test_a_constant_force_is_a_candidate_only_where_no_rest_length_is_free_to_absorb_it(scales):
    free, fixed = (Model.from_text(SPRING % word) for word in ("false", "true"))
    assert "constant_force" not in tried(free, scales)
    reason = candidates(CATALOGUE, free.setting, scales).not_tried["constant_force"]
    assert reason == "linear_spring.rest_length is free and does the same"
    assert "constant_force" in tried(fixed, scales)
    assert "constant_force" in tried(Model.from_text("inertia: {mass: 1.0}"), scales)


@pytest.mark.parametrize(("swing", "there"), [(0.19, False), (0.21, True)])
def test_a_pendulum_s_gravity_is_a_candidate_from_a_fifth_of_a_radian_on(scales, swing, there):
    wide = replace(scales, low=-swing, high=swing, centre=0.0)
    found = candidates(CATALOGUE, Model.from_text(PENDULUM).setting, wide)
    assert ("pendulum_gravity" in {element.name for element, _ in found.tried}) is there
    assert ("pendulum_gravity" in found.not_tried) is not there


def test_where_the_base_moves_friction_and_dampers_are_tried_against_the_base_and_against_the_room(scales):
    model = Model.from_text(SPRING % "true")
    moving, still = replace(scales, displaced_base=True), scales
    for name in ("coulomb_friction", "viscous_damper", "stribeck_friction", "bouc_wen_hysteresis"):
        assert tried(model, moving)[name] == ["base", "room"]
        assert tried(model, still)[name] == ["base"]
    assert tried(model, moving)["cubic_stiffness"] == [None]


def test_a_damper_against_the_room_is_tried_beside_one_against_the_base(scales):
    moving = replace(scales, displaced_base=True)
    model = Model.from_text(SPRING % "true" + "\n").with_element(
        CATALOGUE["viscous_damper"], {"damping": 1.0}
    )
    assert tried(model, moving)["viscous_damper"] == ["room"]
    assert "viscous_damper" not in tried(model, scales)
    assert candidates(CATALOGUE, model.setting, scales).not_tried["viscous_damper"] == "the model has it"


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("pendulum_gravity", "it needs an angle as position"),
        ("reference_rate_limit", "it needs a controller in the model"),
        ("travel_stop", "it needs an input that displaces the base"),
        ("stiffness_drift", "it needs linear_spring, which the model does not have"),
    ],
)
def test_what_is_not_tried_is_told_with_the_reason(scales, name, reason):
    assert (
        candidates(CATALOGUE, Model.from_text("inertia: {mass: 1.0}").setting, scales).not_tried[name]
        == reason
    )


def test_a_machine_that_nothing_drives_lacks_no_command_no_actuator_and_no_other_clock(scales):
    model = Model.from_text("inertia: {mass: 1.0}")
    idle = candidates(CATALOGUE, model.setting, replace(scales, idle=True))
    driven = candidates(CATALOGUE, model.setting, scales)
    gone = {element.name for element, _ in driven.tried} - {element.name for element, _ in idle.tried}
    assert {"actuator_lag", "backlash", "command_hold", "clock_skew", "load_dependent_friction"} <= gone
    assert {idle.not_tried[name] for name in gone} == {IDLE}
    assert gone == {
        element.name
        for element, _ in driven.tried
        if element.slot in ("command", "actuator", "timing") or element.name == "load_dependent_friction"
    }


DRIFTS = {"actuator_fade", "clock_skew", "delay_drift", "input_delay_drift"}
STATIC = {"actuator_nonlinearity", "actuator_saturation", "actuator_deadband", "torque_speed_limit"}
DYNAMIC = {"command_hold", "command_lag", "actuator_lag", "actuator_rate_limit", "backlash"}


def test_constant_levels_show_static_laws_of_the_actuator_a_step_delays_too_and_neither_a_clock_or_a_fade(
    scales,
):
    setting = Model.from_text("inertia: {mass: 1.0}").setting
    levels = candidates(CATALOGUE, setting, replace(scales, changes=0))
    step = candidates(CATALOGUE, setting, replace(scales, changes=1))
    often = {element.name for element, _ in candidates(CATALOGUE, setting, scales).tried}
    assert {name for name, reason in step.not_tried.items() if reason == STEADY} == DRIFTS & often
    assert often - {element.name for element, _ in step.tried} == DRIFTS & often
    assert DYNAMIC & often <= {name for name, reason in levels.not_tried.items() if reason == LEVEL}
    assert STATIC & often == STATIC & {element.name for element, _ in levels.tried} != set()


def test_under_a_controller_a_fade_shows_although_its_reference_never_changes(scales):
    model = Model.from_text(
        "inertia: {mass: 1.0}\ncommand: [position_control: {proportional: 10.0, derivative: 2.0}]"
    )
    steady = candidates(CATALOGUE, model.setting, replace(scales, changes=1))
    assert "actuator_fade" in {element.name for element, _ in steady.tried}
    assert steady.not_tried["clock_skew"] == STEADY


@pytest.mark.parametrize(("speed", "changes"), [(0.0, 1), (1.0, 0)], ids=["from rest", "running"])
def test_a_constant_input_counts_as_a_change_where_the_machine_starts_from_rest(speed, changes):
    time = np.arange(0.0, 3.0, 0.05)
    records = [
        Record(f"{u} V", Channel(time, u * (1.0 - (1.0 - speed) * np.exp(-time / 0.3)), "rad/s"),
               Channel(time, np.full(len(time), u), "V"), output_kind="velocity", hold="zero")
        for u in (3.0, 6.0)
    ]  # fmt: skip
    model = Model.from_text(
        "units: {force: V, position: rad}\ninertia: {mass: 0.3}\nforce: [viscous_damper: {damping: 1.0}]"
    )
    found = scales_of(prepare(records), model)
    assert (found.changes, found.idle) == (changes, False)


@pytest.mark.parametrize(
    ("unit", "expected"),
    [
        ("N", lambda s: 0.02 * s.force),
        ("N/m", lambda s: 0.05 * s.stiffness),
        ("N*s/m", lambda s: 0.05 * s.damping),
        ("m", lambda s: 0.2 * s.position),
        ("m/s", lambda s: 0.2 * s.velocity),
        ("s", lambda s: 0.02 / s.frequency),
        ("Hz", lambda s: s.frequency),
        ("1", lambda s: 0.1),
        ("kg", lambda s: 0.03 * s.mass),
        ("N/m^3", lambda s: 0.05 * s.force / s.position**3),
        ("N*s^2/m^2", lambda s: 0.05 * s.force / s.velocity**2),
    ],
)
def test_an_element_without_starts_gets_a_first_guess_from_its_unit_and_the_scales(scales, unit, expected):
    (guess,) = law(Parameter("amount", unit, "how much")).first_guesses(scales)
    assert guess["amount"] == pytest.approx(expected(scales))


def test_a_generic_guess_lies_within_the_bounds_and_keeps_defaults(scales):
    element = law(
        Parameter("amount", "N", "how much", bounds=(-1e9, 0.0)),
        Parameter("share", "1", "a share", bounds=(0.5, 0.9)),
        Parameter("exponent", "1", "an exponent", default=2.0),
    )
    assert element.first_guesses(scales) == [{"amount": -0.02 * scales.force, "share": 0.7}]


def test_lengths_and_times_are_guessed_twice_and_phases_at_quarter_turns(scales):
    element = law(
        Parameter("amount", "N", "how much"),
        Parameter("width", "m", "how wide"),
        Parameter("phase", "rad", "phase", turn=6.0),
    )
    guesses = element.first_guesses(scales)
    assert [guess["width"] / scales.position for guess in guesses] == pytest.approx([0.2, 0.2, 0.8, 0.8])
    assert [guess["phase"] for guess in guesses] == [0.0, 1.5, 0.0, 1.5]


@pytest.mark.parametrize(
    ("element", "reason"),
    [
        (law(Parameter("heat", "K", "temperature")), "the unit K of its heat says nothing of its size"),
        (law(Parameter("limit", "N", "limit"), absent=float("inf")), "its limit is absent at infinity"),
        (law(Parameter("amount", "N", "how much", bounds=(-1.0, 0.0)), absent=-0.5), None),
    ],
)
def test_an_element_that_no_unit_gives_a_guess_for_is_not_tried_and_the_reason_told(scales, element, reason):
    found = candidates({"law": element}, Model.from_text("inertia: {mass: 1.0}").setting, scales)
    if reason is None:
        assert found.tried and not found.not_tried
        return
    assert found.tried == () and found.not_tried["law"].startswith(reason)
    with pytest.raises(NoGuess, match=reason):
        element.first_guesses(scales)


def test_an_element_that_is_no_candidate_is_neither_tried_nor_told_of(scales):
    element = law(Parameter("amount", "N", "how much"), candidate=False)
    found = candidates({"law": element}, Model.from_text("inertia: {mass: 1.0}").setting, scales)
    assert found.tried == () and found.not_tried == {}


FILE = """\
from rhythmid.elements.element import Element, Parameter


def kernel({arguments}):
    return -amount * x


ELEMENT = Element(
    name="law", slot="force", title="Law", equation="F", parameters=(Parameter("amount", "N/m", "how much"),),
    kernel=kernel, size="amount", reference="test",
)
"""


def written(folder: Path, arguments: str) -> Path:
    path = folder / "law.py"
    path.write_text(FILE.format(arguments=arguments), encoding="utf-8")
    return path


@pytest.mark.parametrize("arguments", ["x, v, amount", "x, v, t, f, amount, more", "amount, x, v, t, f"])
def test_a_kernel_with_the_wrong_arguments_is_refused_in_one_line_that_names_the_file_and_the_right_ones(
    tmp_path, arguments
):
    path = written(tmp_path, arguments)
    with pytest.raises(InputError) as caught:
        load_element(path)
    told = str(caught.value)
    assert told.startswith(f"{path}: the kernel of 'law' takes ({arguments}); for slot='force', acts='leg'")
    assert told.endswith("(x, v, t, f, amount)") and "\n" not in told


def test_a_kernel_may_call_what_it_is_given_as_it_likes(tmp_path):
    assert load_element(written(tmp_path, "x, speed, time, drive, amount")).name == "law"


def test_a_generic_guess_keeps_to_the_ranges_of_the_scales(scales):
    element = replace(
        law(Parameter("amount", "N", "how much")), ranges=lambda s: {"amount": (3.0 * s.force, 5.0 * s.force)}
    )
    (guess,) = element.within(scales).first_guesses(scales)
    assert guess["amount"] == pytest.approx(4.0 * scales.force)


@pytest.mark.parametrize(
    ("bounds", "absent", "factor", "forbidden"),
    [
        ((0.0, math.inf), 0.0, -1.0, True),
        ((0.0, math.inf), 0.0, 3.0, False),
        ((-math.inf, 0.0), 0.0, 1.0, True),
        ((-math.inf, math.inf), 0.0, -1.0, False),
        ((0.0, math.inf), 1.0, -1.0, False),  # a gain may be more or less than one
        ((0.0, math.inf), math.inf, -1.0, True),  # a limit that is not there is infinitely far
        ((0.0, math.inf), math.inf, 1.0, False),
    ],
)
def test_an_effect_whose_sizes_all_lie_on_one_side_has_no_other_sign(bounds, absent, factor, forbidden):
    element = law(Parameter("size", "N", "how much", bounds=bounds), size="size", absent=absent)
    assert element.forbids({"size": 2.0}, factor) is forbidden


def test_an_effect_without_a_size_has_every_sign():
    sized = law(Parameter("size", "N", "how much", bounds=(0.0, math.inf)))
    assert not replace(sized, size="").forbids({"size": 2.0}, -1.0)
