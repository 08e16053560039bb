"""Model files that are wrong: each is refused with one line that names file, line, parameter and what to do."""

import pytest

from rhythmid.elements.catalogue import load_catalogue
from rhythmid.errors import InputError
from rhythmid.model import Model

CATALOGUE = load_catalogue()
GOOD = """\
inertia: {mass: {value: 1.0, unit: kg, fixed: true}}
command: [{input_delay: {delay: {value: 0.04, unit: s}}}]
force:
  - gravity: {acceleration: {value: 9.81, unit: m/s^2}}
  - linear_spring:
      stiffness: {value: 200.0, unit: N/m, bounds: [100, 300], prior: {mean: 190, std: 20}}
      rest_length: {value: 0.2, unit: m}
  - viscous_damper: {damping: {value: 2.0, unit: N*s/m}}
"""


def test_the_file_that_is_spoilt_below_is_good():
    assert Model.from_text(GOOD, catalogue=CATALOGUE).value("linear_spring.stiffness") == 200.0


@pytest.mark.parametrize(
    ("before", "after", "line", "words"),
    [
        # names
        ("viscous_damper", "viscous_dumper", 8, ["unknown element 'viscous_dumper'", "did you mean 'viscous_damper'?"]),
        ("viscous_damper", "zzz", 8, ["unknown element 'zzz'"]),
        ("rest_length", "rest_lenght", 7, ["force[1].linear_spring.rest_lenght", "did you mean 'rest_length'?"]),
        ("unit: m}", "unti: m}", 7, ["unti", "did you mean 'unit'?"]),
        ("command:", "comand:", 2, ["comand", "did you mean 'command'?"]),
        ("mass:", "weight:", 1, ["weight", "known: mass"]),
        # units
        ("unit: m}", "unit: mm}", 7, ["rest_length", "'mm'", "'m'", "multiply it by 0.001"]),
        ("unit: N/m,", "unit: N*m,", 6, ["linear_spring.stiffness", "'N*m'", "'N/m'", "different things"]),
        ("unit: kg", "unit: lb", 1, ["inertia.mass", "'lb'", "multiply it by 0.453592"]),
        ("unit: s}", "unit: ms}", 2, ["input_delay.delay", "multiply it by 0.001"]),
        # values
        ("value: 2.0", "value: -2.0", 8, ["viscous_damper.damping", "-2 N*s/m is outside [0, inf]", "damping c"]),
        ("value: 200.0", "value: 400.0", 6, ["linear_spring.stiffness", "400 N/m is outside [100, 300]"]),
        ("value: 0.04", "value: -0.04", 2, ["input_delay.delay", "-0.04 s is outside [0, inf]"]),
        ("value: 0.2", "value: .nan", 7, ["rest_length", "NaN"]),
        ("value: 0.2", "value: .inf", 7, ["rest_length", "must be finite"]),
        ("value: 0.2", "value: two", 7, ["rest_length", "a number is expected, not 'two'"]),
        ("value: 0.2", "value: yes", 7, ["rest_length", "a number is expected, not True"]),
        ("value: 0.2", "value:", 7, ["rest_length", "a number is expected, not None"]),
        ("value: 1.0", "value: 0.0", 1, ["inertia.mass", "must be greater than 0"]),
        ("fixed: true", "fixed: 3", 1, ["fixed", "true or false is expected, not 3"]),
        # bounds and priors
        ("[100, 300]", "[300, 100]", 6, ["bounds", "low < high"]),
        ("[100, 300]", "[100]", 6, ["bounds", "two numbers [low, high]"]),
        ("[100, 300]", "100", 6, ["bounds", "a list"]),
        ("[100, 300]", "[100, .nan]", 6, ["bounds", "NaN"]),
        (", std: 20", "", 6, ["prior", "'std:' is missing"]),
        ("std: 20", "std: 0", 6, ["prior.std", "too small; more than 0"]),
        # what is there, and what is not
        ("{value: 2.0, unit: N*s/m}", "{unit: N*s/m}", 8, ["viscous_damper.damping", "'value:' is missing"]),
        ("{damping: {value: 2.0, unit: N*s/m}}", "", 8, ["'damping' is missing", "N*s/m"]),
        ("      stiffness:", "      #", 5, ["'stiffness' is missing", "N/m"]),
        ("rest_length: {value: 0.2", "stiffness: {value: 0.2", 7, ["linear_spring.stiffness", "is given twice"]),
        ("{mass: {value: 1.0, unit: kg, fixed: true}}", "{}", 1, ["inertia", "'mass' is missing"]),
        ("inertia:", "#", 2, ["no 'inertia:'", "write inertia:"]),
        # places
        ("input_delay: {delay: {value: 0.04, unit: s}}", "gravity:", 2, ["gravity belongs under 'force:'", "'command:'"]),
        ("[{input_delay: {delay: {value: 0.04, unit: s}}}]", "input_delay", 2, ["command", "a list (- item)"]),
        ("- gravity: {", "- linear_damper: {}\n    gravity: {", 4, ["one element is expected here"]),
        ("- gravity: {acceleration: {value: 9.81, unit: m/s^2}}", "- gravity", 4, ["a mapping (key: value)"]),
        # not YAML
        ("unit: m}", "unit: m", 8, ["is not valid YAML"]),
        ("force:", "force", 4, ["is not valid YAML"]),
    ],
)  # fmt: skip
def test_one_line_names_place_and_problem(before, after, line, words, tmp_path):
    assert before in GOOD
    file = tmp_path / "hopper.yaml"
    file.write_text(GOOD.replace(before, after, 1), encoding="utf-8")
    with pytest.raises(InputError) as refused:
        Model.load(file, CATALOGUE)
    message = str(refused.value)
    assert "\n" not in message
    assert message.startswith(f"{file}:{line}: "), message
    for word in words:
        assert word in message, message


def test_an_empty_file_is_refused(tmp_path):
    (tmp_path / "empty.yaml").write_text("# nothing yet\n", encoding="utf-8")
    with pytest.raises(InputError, match="empty.yaml: the model file is empty"):
        Model.load(tmp_path / "empty.yaml", CATALOGUE)


def test_an_effect_on_something_absent_is_refused_by_name():
    text = "inertia: {mass: 1}\nforce:\n- {stiffness_jump: {change: 0.1, time: 1}}"
    with pytest.raises(InputError) as refused:
        Model.from_text(text, catalogue=CATALOGUE)
    expected = "model:3: force[0]: stiffness_jump needs 'linear_spring', which the model does not have"
    assert str(refused.value) == expected


def test_an_element_that_another_one_needs_is_not_taken_away():
    model = Model.from_text(GOOD, catalogue=CATALOGUE)
    jumping = model.with_element(CATALOGUE["stiffness_jump"], {"change": 0.1, "time": 1.0})
    with pytest.raises(InputError, match="'stiffness_jump' needs 'linear_spring'"):
        jumping.without("linear_spring")
