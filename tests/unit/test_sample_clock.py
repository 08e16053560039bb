"""A clock of an element's own is found by what the element says, whatever its name."""

from dataclasses import replace

from machines import CATALOGUE, hopper
from rhythmid.identify.sample_clock.clock import clock_of, has_clock

RENAMED = replace(CATALOGUE["command_hold"], name="bus_cycle")


def test_the_clock_of_a_model_is_the_parameter_that_its_element_names():
    assert clock_of(hopper()) is None
    for element in (CATALOGUE["command_hold"], RENAMED):
        model = hopper().with_element(element, {"period": 0.02})
        assert clock_of(model) == f"{element.name}.period"
        assert has_clock(model, element.name) and not has_clock(model, "linear_spring")
        assert not has_clock(model, "absent")


def test_the_catalogue_names_clocks_that_its_elements_have():
    clocked = [element for element in CATALOGUE.values() if element.clock]
    assert clocked and all(element.parameter(element.clock).unit == "s" for element in clocked)
