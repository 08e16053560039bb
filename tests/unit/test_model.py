"""Models: YAML in and out, values, terms, what they share and what they refuse."""

import math
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as some

import rhythmid
from rhythmid.elements.catalogue import Catalogue, load_catalogue
from rhythmid.elements.element import STEP, Element
from rhythmid.errors import InputError
from rhythmid.model import Model, Term
from rhythmid.units import ROTATIONAL, TRANSLATIONAL, Units
from rhythmid.value import Prior, Value

PAPER = Path(rhythmid.__file__).parent / "models" / "paper_hopper.yaml"
CATALOGUE = load_catalogue()


@pytest.fixture
def hopper() -> Model:
    return Model.load(PAPER, CATALOGUE)


def test_the_papers_hopper_is_a_file_that_comes_with_the_package(hopper):
    assert hopper.units == TRANSLATIONAL
    assert hopper.value("inertia.mass") == 1.0
    assert hopper.value("linear_spring.stiffness") == 200.0
    assert hopper.value("linear_spring.rest_length") == 0.2
    assert hopper.value("switched_damper.stance") == 2.0
    assert hopper.parameters["gravity.acceleration"] == Value(9.81, "m/s^2", fixed=True)


def test_what_is_not_fixed_is_estimated(hopper):
    assert hopper.free == [
        "input_delay.delay",
        "linear_spring.stiffness",
        "linear_spring.rest_length",
        "switched_damper.stance",
        "measurement_delay.delay",
    ]


def test_what_a_file_leaves_out_takes_its_default_and_is_not_estimated():
    model = Model.from_text(
        "inertia: {mass: 1}\nforce: [{linear_spring: {stiffness: 5}}, gravity:]", catalogue=CATALOGUE
    )
    assert model.parameters["linear_spring.rest_length"] == Value(0.0, "m", fixed=True)
    assert model.value("gravity.acceleration") == 9.81
    assert model.free == ["inertia.mass", "linear_spring.stiffness"]


def test_changed_values_keep_unit_bounds_and_prior(hopper):
    known = Value(200.0, "N/m", bounds=(100.0, 300.0), prior=Prior(190.0, 20.0))
    changed = hopper.with_parameters({"linear_spring.stiffness": known}).with_values(
        {"linear_spring.stiffness": 210}
    )
    assert changed.parameters["linear_spring.stiffness"] == replace(known, value=210.0)
    assert hopper.value("linear_spring.stiffness") == 200.0, "models do not change"


def test_an_unknown_parameter_is_refused_with_the_known_ones(hopper):
    with pytest.raises(
        InputError, match=r"no parameter 'spring.k'; it has inertia.mass, .*linear_spring.stiffness"
    ):
        hopper.with_values({"spring.k": 1.0})
    with pytest.raises(InputError, match="no parameter 'spring.k'"):
        hopper.value("spring.k")


def test_an_element_is_added_and_taken_away(hopper):
    augmented = hopper.with_element(CATALOGUE["viscous_damper"], {"damping": 0.3})
    assert augmented.value("viscous_damper.damping") == 0.3
    assert "viscous_damper.damping" in augmented.free
    assert augmented.without("viscous_damper") == hopper


def test_a_second_element_of_a_kind_is_numbered(hopper):
    two = hopper.with_element(CATALOGUE["linear_spring"], {"stiffness": 10.0})
    assert two.value("linear_spring.stiffness") == 200.0
    assert two.value("linear_spring_2.stiffness") == 10.0
    assert Model.from_text(two.to_yaml(), catalogue=CATALOGUE).value("linear_spring_2.stiffness") == 10.0


def test_an_element_needs_its_mandatory_values_and_no_others(hopper):
    with pytest.raises(InputError, match="'viscous_damper': parameter 'damping' needs a value"):
        hopper.with_element(CATALOGUE["viscous_damper"])
    with pytest.raises(InputError, match="'viscous_damper' has no parameter 'c'"):
        hopper.with_element(CATALOGUE["viscous_damper"], {"damping": 1.0, "c": 1.0})


def test_a_rotational_machine_is_known_by_its_inertia():
    model = Model.from_text(
        "inertia: {mass: {value: 0.1, unit: kg*m^2}}\n"
        "force: [{linear_spring: {stiffness: {value: 3, unit: N*m/rad}, rest_length: {value: 0.5, unit: rad}}}]",
        catalogue=CATALOGUE,
    )
    assert model.units == ROTATIONAL
    assert model.parameters["linear_spring.stiffness"].unit == "N*m/rad"
    assert Model.from_text(model.to_yaml(), catalogue=CATALOGUE) == model


def test_other_units_are_declared_once():
    model = Model.from_text(
        "units: {force: V, position: px}\ninertia: {mass: 1}\n"
        "force: [{linear_spring: {stiffness: {value: 3, unit: V/px}}}]",
        catalogue=CATALOGUE,
    )
    assert model.units == Units("V", "px", "V*s^2/px")
    assert Model.from_text(model.to_yaml(), catalogue=CATALOGUE) == model


def test_a_saved_model_reads_back_and_leaves_nothing_else(hopper, tmp_path):
    hopper.save(tmp_path / "model.yaml")
    assert Model.load(tmp_path / "model.yaml", CATALOGUE) == hopper
    assert [path.name for path in tmp_path.iterdir()] == ["model.yaml"]


def test_a_place_that_cannot_be_written_is_refused(hopper, tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match="cannot be written: "):
        hopper.save(tmp_path / "file" / "model.yaml")


def test_folders_above_a_saved_model_are_made(hopper, tmp_path):
    hopper.save(tmp_path / "out" / "models" / "model.yaml")
    assert Model.load(tmp_path / "out" / "models" / "model.yaml", CATALOGUE) == hopper


def _values(element: Element) -> some.SearchStrategy[dict[str, Value]]:
    def value(parameter) -> some.SearchStrategy[Value]:
        low, high = parameter.bounds
        inside = some.floats(
            None if math.isinf(low) else low,
            None if math.isinf(high) else high,
            allow_nan=False,
            allow_infinity=False,
        )
        ranges = some.just(parameter.bounds) | inside.map(
            lambda x: (max(low, x - abs(x) - 1.0), min(high, x + 1.0))
        )

        def complete(bounds: tuple[float, float]) -> some.SearchStrategy[Value]:
            bounds = bounds if bounds[0] < bounds[1] else parameter.bounds
            numbers = some.floats(
                None if math.isinf(bounds[0]) else bounds[0],
                None if math.isinf(bounds[1]) else bounds[1],
                allow_nan=False,
                allow_infinity=False,
            )
            prior = some.none() | some.builds(Prior, some.floats(-1e6, 1e6), some.floats(1e-9, 1e6))
            return some.builds(
                Value, numbers, some.just(parameter.unit), some.booleans(), some.just(bounds), prior
            )

        return ranges.flatmap(complete)

    return some.fixed_dictionaries({parameter.name: value(parameter) for parameter in element.parameters})


@given(some.data())
def test_every_model_survives_being_written_and_read(data):
    """Values, units, what is fixed, bounds and priors, for any choice of elements, to the last bit."""
    independent = [
        element
        for element in CATALOGUE.values()
        if all(default is not None or name == STEP for name, default in element.borrows.values())
        and element.acts != "observation"
        and not element.takes  # a motor changes the units of what commands it
    ]
    chosen = data.draw(some.lists(some.sampled_from(independent), max_size=4, unique_by=lambda e: e.name))
    chosen.sort(key=lambda element: ("command", "actuator", "force", "sensor", "timing").index(element.slot))
    terms = tuple(Term(element, element.name, data.draw(_values(element))) for element in chosen)
    model = Model(
        Value(data.draw(some.floats(1e-6, 1e6)), "kg", data.draw(some.booleans()), (0.0, math.inf)), terms
    )
    assert Model.from_text(model.to_yaml(), catalogue=CATALOGUE) == model


def test_a_model_is_read_with_the_catalogue_that_it_is_given():
    with pytest.raises(InputError, match="unknown element 'gravity'"):
        Model.from_text("inertia: {mass: 1}\nforce: [gravity:]", catalogue=Catalogue({}))
