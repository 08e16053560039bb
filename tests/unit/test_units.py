"""Units: read in many spellings, never converted silently, refused with what to do."""

import pytest
from hypothesis import given, strategies

from rhythmid.errors import InputError
from rhythmid.model import Model
from rhythmid.record.signals import Signals
from rhythmid.units import ROTATIONAL, TRANSLATIONAL, Units, mass_unit, multiple_of_si


@pytest.mark.parametrize("spelling", ["N*s/m", "N s/m", "N·s/m", " N * s / m ", "kg/s", "N*s*m^-1"])
def test_a_unit_may_be_spelled_in_several_ways(spelling):
    TRANSLATIONAL.check(spelling, "N*s/m", "here")


@pytest.mark.parametrize("spelling", ["s/rad", "1*s/rad", "1/(rad/s)"])
def test_a_unit_of_a_machine_whose_force_has_none_may_be_spelled_without_it(spelling):
    Units("1", "rad", "s^2/rad").check(spelling, "N*s/m", "here")


@pytest.mark.parametrize(
    ("wrong", "expected", "advice"),
    [
        ("mm", "m", "write the value in m (multiply it by 0.001)"),
        ("ms", "s", "write the value in s (multiply it by 0.001)"),
        ("lbf/inch", "N/m", "multiply it by 175.127"),
        ("N", "N/m", "they measure different things"),
        ("", "m", "they measure different things"),
        ("bananas", "m", "not a unit that is known"),
        ("degC", "m", "not a unit that is known"),
    ],
)
def test_another_unit_is_refused_with_place_and_advice(wrong, expected, advice):
    with pytest.raises(InputError) as refused:
        TRANSLATIONAL.check(wrong, expected, "model.yaml:3: force[0].linear_spring.stiffness")
    message = str(refused.value)
    assert message.startswith("model.yaml:3: force[0].linear_spring.stiffness: ")
    assert repr(wrong) in message and advice in message and "\n" not in message


def test_a_rotational_machine_has_its_own_units():
    assert ROTATIONAL.of("kg") == "kg*m^2"
    assert ROTATIONAL.of("N/m") == "N*m/rad"
    assert ROTATIONAL.of("N*s^2/m^2") == "N*m*s^2/rad^2"
    assert ROTATIONAL.of("1/N") == "1/(N*m)"
    assert ROTATIONAL.of("Hz") == "Hz"
    ROTATIONAL.check("N*m*s/rad", "N*s/m", "here")
    with pytest.raises(InputError, match="different things"):
        ROTATIONAL.check("N*s/m", "N*s/m", "here")


def test_units_declared_by_a_table_are_taken_at_their_word():
    electric = Units(force="V", position="px", mass="V*s^2/px")
    assert electric.of("N/m") == "V/px"
    electric.check("V/px", "N/m", "here")
    with pytest.raises(InputError, match=r"unit 'mV/px' where 'V/px' is expected"):
        electric.check("mV/px", "N/m", "here")


@given(strategies.one_of(strategies.text(max_size=10), strategies.text("mNkgs/*^012()-. ", max_size=10)))
def test_no_text_at_all_gets_more_than_one_line_of_refusal(text):
    try:
        TRANSLATIONAL.check(text, "N/m", "here")
    except InputError as refused:
        assert "\n" not in str(refused)


@pytest.mark.parametrize(
    ("force", "position", "unit"),
    [
        ("rad/s^2", "rad", "1"), ("m/s^2", "m", "1"), ("V", "px", "V*s^2/px"), ("N*m", "rad", "N*m*s^2/rad"),
        ("rad/s", "rad", "s"), ("N*m/(rad*s)", "rad", "N*m*s/rad^2"), ("N (raw)", "m", "N (raw)*s^2/m"),
    ],
)  # fmt: skip
def test_the_unit_of_an_inertia_has_each_unit_once(force, position, unit):
    assert mass_unit(force, position) == unit


def test_units_per_inertia_are_reduced_and_both_spellings_are_taken():
    units = Units("rad/s^2", "rad", "1")
    assert units.of("N/m") == "1/s^2" and units.of("N*s/m") == "1/s"
    units.check("(rad/s^2)/rad", "N/m", "here")
    units.check("1/s^2", "N/m", "here")


@pytest.mark.parametrize("own", ["%", "pct", "V", "px", "duty"])
def test_a_machines_own_unit_is_taken_by_both_files(own):
    model = Model.from_text(f'units: {{force: "{own}", position: rad}}\ninertia: {{mass: {{value: 1.0}}}}\n')
    signals = Signals.from_text(
        f'time: {{column: t}}\ninput: {{column: u, unit: "{own}"}}\noutput: {{column: y, unit: rad}}\n'
    )
    assert model.units.force == signals.channels["input"].unit == own
    assert Units(own, "rad").of("N*s^2/m*m/s^2") == own


@pytest.mark.parametrize("unit", ["mm", "deg", "kN", "rpm"])
def test_a_multiple_of_an_si_unit_is_named_with_its_scale(unit):
    assert multiple_of_si(unit) is not None


@pytest.mark.parametrize("unit", ["Nbase_yawm", "N*", "rad/", "m s)"])
def test_a_unit_that_cannot_be_read_is_refused(unit):
    with pytest.raises(InputError, match="cannot be read as a unit: write it like"):
        Signals.from_text(f"time: {{column: t}}\noutput: {{file: a.csv, column: x, unit: '{unit}'}}\n")


@pytest.mark.parametrize("unit", ["N*m", "N m", "px", "%", "1", "m/s²", "inH2O", "counts/s"])
def test_a_machines_own_unit_is_read(unit):
    Signals.from_text(f"time: {{column: t}}\noutput: {{file: a.csv, column: x, unit: '{unit}'}}\n")
