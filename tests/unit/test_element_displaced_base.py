"""What acts between the mass and a base that moves, against closed forms in the moving frame."""

import math
from dataclasses import replace

import numpy as np
import pytest

from rhythmid.diagnose.search.score_tests import changes_of, score, trajectories
from rhythmid.elements.candidates import candidates
from rhythmid.elements.catalogue import load_catalogue
from rhythmid.errors import InputError
from rhythmid.identify.free_run import prepare_run, start_of
from rhythmid.identify.noise import NoiseModel
from rhythmid.identify.output_error import estimate, start_only
from rhythmid.identify.record_scales import scales
from rhythmid.identify.series import Series, prepare
from rhythmid.model import Model
from rhythmid.record.record import Channel, Record

CATALOGUE = load_catalogue()
TIME = np.arange(0.0, 1.0, 1e-3)
BASE_SPEED = 0.4
ONLY_THERE = {"quadratic_damping", "travel_stop"}


def mass(element: str, values: dict[str, float]) -> Model:
    text = "inertia: {mass: {value: 2.0, unit: kg}}\nforce: [{viscous_damper: {damping: {value: 0.0, unit: N*s/m}}}]"
    return Model.from_text(text).with_element(CATALOGUE[element], values)


def series(kind: str = "base_displacement") -> list[Series]:
    base = Channel(TIME, BASE_SPEED * TIME, "m")
    moving = Channel(TIME, np.sin(20.0 * TIME), "m")
    return prepare([Record("rig", moving, base, hold="linear", input_kind=kind)], block=1)


def position(model: Model, start: tuple[float, float]) -> np.ndarray:
    run = prepare_run(model, series(), 1e-4)
    outputs = run.outputs(model, [np.array(start)])
    assert outputs is not None
    return outputs[0]


def test_quadratic_damping_lets_a_mass_coast_as_one_over_time_in_the_frame_of_the_base():
    c, m, fast = 0.8, 2.0, 3.0
    found = position(mass("quadratic_damping", {"coefficient": c}), (0.0, BASE_SPEED + fast))
    expected = BASE_SPEED * TIME + m / c * np.log1p(c * fast / m * TIME)
    assert found == pytest.approx(expected, abs=1e-6)


def test_drag_of_the_air_does_not_know_of_the_base():
    c, m, fast = 0.8, 2.0, 3.0
    found = position(mass("quadratic_drag", {"coefficient": c}), (0.0, fast))
    assert found == pytest.approx(m / c * np.log1p(c * fast / m * TIME), abs=1e-6)


@pytest.mark.parametrize(("side", "frame"), [("base", BASE_SPEED), ("room", 0.0)])
@pytest.mark.parametrize("element", ["viscous_damper", "coulomb_friction"])
def test_friction_and_dampers_bring_the_mass_to_rest_in_the_frame_that_they_act_against(element, side, frame):
    values = {"damping": 20.0} if element == "viscous_damper" else {"force": 6.0, "transition": 1e-3}
    plain = mass(element, values)
    term = replace(plain.terms[-1], element=plain.terms[-1].element.acting_against(side))
    found = position(replace(plain, terms=(*plain.terms[:-1], term)), (0.0, 1.0))
    assert np.gradient(found, TIME)[-50:] == pytest.approx(frame, abs=2e-3)


def test_a_model_file_says_against_what_friction_acts_and_keeps_saying_it():
    friction, spring = "{coulomb_friction: {force: 1.0, against: %s}}", "{linear_spring: {stiffness: 1.0}}"
    text = f"inertia: {{mass: 2.0}}\nforce: [{friction}, {spring}]"
    for side in ("base", "room"):
        given = Model.from_text(text % side)
        assert given.terms[0].against == side
        again = Model.from_text(given.to_yaml())
        assert again.terms[0].against == side and again.terms[1].against is None
        assert ("against" in given.to_yaml()) is (side == "room")
    with pytest.raises(InputError, match="against: 'wall' is none of base, room"):
        Model.from_text(text % "wall")
    with pytest.raises(InputError, match="unknown key"):
        Model.from_text("inertia: {mass: 2.0}\nforce: [{linear_spring: {stiffness: 1.0, against: room}}]")


def test_what_acts_against_the_room_is_refused_where_only_the_base_s_acceleration_is_known():
    text = "inertia: {mass: 2.0}\nforce: [{viscous_damper: {damping: 1.0, against: room}}]"
    with pytest.raises(InputError, match="'viscous_damper' acts against the room"):
        prepare_run(Model.from_text(text), series("base_acceleration"))


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_travel_stop_throws_the_mass_back_in_the_frame_of_the_base(side):
    stiffness, gap, fast, m = 5000.0, 0.1, 0.5, 2.0
    stop = {"stiffness": stiffness, "damping_ratio": 0.0, "position": side * gap, "side": side}
    found = position(mass("travel_stop", stop), (0.0, BASE_SPEED + side * fast)) - BASE_SPEED * TIME
    contact = math.pi * math.sqrt(m / stiffness)
    deepest = gap + fast * math.sqrt(m / stiffness)
    assert (side * found).max() == pytest.approx(deepest, rel=1e-4)
    gone = TIME > gap / fast + contact
    back = side * (gap - fast * (TIME - gap / fast - contact))
    assert found[gone] == pytest.approx(back[gone], abs=1e-4)


@pytest.mark.parametrize(
    ("kind", "there"), [("base_displacement", True), ("base_acceleration", False), ("force", False)]
)
def test_they_are_candidates_only_where_the_input_displaces_the_base(kind, there):
    model, given = mass("linear_spring", {"stiffness": 800.0, "rest_length": 0.0}), series(kind)
    names = {element.name for element, _ in candidates(CATALOGUE, model.setting, scales(given, model)).tried}
    assert (names >= ONLY_THERE) is there and bool(names & ONLY_THERE) is there


@pytest.mark.parametrize("kind", ["base_displacement", "base_acceleration"])
def test_what_lags_commands_neither_moves_a_machine_that_its_base_drives_nor_is_sought_in_it(kind):
    given = series(kind)
    plain = mass("linear_spring", {"stiffness": 800.0, "rest_length": 0.0})
    lagging = plain.with_element(CATALOGUE["command_lag"], {"time_constant": 0.02})
    both = [prepare_run(model, given, 1e-4) for model in (plain, lagging)]
    starts = [start_of(model, run, 0, 0.1, 0.0) for model, run in zip((plain, lagging), both)]
    first, second = (run.outputs(m, [s]) for m, run, s in zip((plain, lagging), both, starts))
    assert first is not None and second is not None
    assert np.ptp(first[0]) > 0.1 and np.array_equal(first[0], second[0])
    known = trajectories(start_only(plain, given, NoiseModel(np.empty(0), 1.0), 1e-4))
    named = [(CATALOGUE[name], values) for name, values in (
        ("command_lag", {"time_constant": 0.02}), ("cubic_stiffness", {"coefficient": 1.0})
    )]  # fmt: skip
    assert [change.element.name for change in changes_of(known, named)] == ["cubic_stiffness"]


@pytest.mark.parametrize("side", ["base", "room"])
def test_the_score_test_tells_friction_against_the_room_from_friction_against_the_base(side):
    nominal = Model.from_text(
        "inertia: {mass: {value: 2.0, unit: kg, fixed: true}}\nforce:\n"
        "  - linear_spring: {stiffness: {value: 800.0, unit: N/m}}\n  - viscous_damper: {damping: {value: 8.0, unit: N*s/m}}"
    )
    time = np.arange(0.0, 12.0, 5e-3)
    rng = np.random.default_rng(8)
    base = sum(
        1e-3 * np.sin(2 * np.pi * f * time + rng.uniform(0, 6))
        for f in (0.7, 1.3, 1.9, 2.6, 3.2, 3.9, 4.7, 6.1)
    )
    shaken = Record(
        "rig",
        Channel(time, base, "m"),
        Channel(time, base, "m"),
        hold="linear",
        input_kind="base_displacement",
    )
    friction = CATALOGUE["coulomb_friction"].acting_against(side)
    machine = nominal.with_element(friction, {"force": 0.15, "transition": 1e-3})
    run = prepare_run(machine, prepare([shaken], block=1), 1e-3)
    outputs = run.outputs(machine, [start_of(machine, run, 0, 0.0, 0.0)])
    assert outputs is not None
    measured = outputs[0] + 1e-6 * rng.standard_normal(len(time))
    fit = estimate(nominal, prepare([replace(shaken, output=Channel(time, measured, "m"))], block=1))
    sizes = scales(fit.run.series, fit.model)
    tried = [
        one
        for one in candidates(CATALOGUE, fit.model.setting, sizes).tried
        if one[0].name == "coulomb_friction"
    ]
    best = score(fit, changes_of(trajectories(fit), tried))
    assert {one.element.against for one in best} == {"base", "room"}
    assert best[0].element.against == side
