"""A YAML document knows where each of its values stands."""

from dataclasses import dataclass
from typing import Annotated, Literal

import pytest
from pydantic import ConfigDict, Field, TypeAdapter

from rhythmid.document import parse, read
from rhythmid.errors import InputError
from rhythmid.validation import NUMBER, Number, Range, Whole, validated

TEXT = """\
# a comment
name: hopper
sizes: [1, 2.5, 1e-3]
nested:
  deeper:
    flag: true
    list:
      - {a: 1}
      - {a: 2}
nothing:
"""


@pytest.fixture
def document():
    return parse(TEXT, "file.yaml")


def refusal(call, *arguments, **options) -> str:
    with pytest.raises(InputError) as refused:
        call(*arguments, **options)
    assert "\n" not in str(refused.value)
    return str(refused.value)


def test_values_know_line_and_path(document):
    flag = document.mapping()["nested"].mapping()["deeper"].mapping()["flag"]
    assert (flag.place, flag.path) == ("file.yaml:6", "nested.deeper.flag")
    second = document.mapping()["nested"].mapping()["deeper"].mapping()["list"].items()[1]
    assert (second.place, second.path) == ("file.yaml:9", "nested.deeper.list[1]")


def test_a_block_stands_where_its_key_stands(document):
    assert document.mapping()["nested"].mapping()["deeper"].place == "file.yaml:5"


def test_plain_gives_the_content_without_places(document):
    assert document.plain == {
        "name": "hopper",
        "sizes": [1, 2.5, "1e-3"],
        "nested": {"deeper": {"flag": True, "list": [{"a": 1}, {"a": 2}]}},
        "nothing": None,
    }


def test_numbers_are_read_in_every_notation(document):
    assert [validated(node, NUMBER) for node in document.mapping()["sizes"].items()] == [1.0, 2.5, 1e-3]


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        (".nan", "is not a number (NaN)"),
        ("nan", "is not a number (NaN)"),
        (".inf", "must be finite"),
        ("true", "a number is expected, not True"),
        ("six", "a number is expected, not 'six'"),
        ("[1]", "a number is expected, not [1]"),
        ("{a: 1}", "a number is expected, not {'a': 1}"),
        ("", "a number is expected, not None"),
        ("12", "12 is too large; at most 10 is expected"),
        ("1" + "0" * 400, "a number is expected"),
    ],
)
def test_what_is_no_number_within_its_limits_is_refused(text, problem):
    node = parse(f"\nx: {text}", "f.yaml").mapping()["x"]
    message = refusal(validated, node, TypeAdapter(Annotated[Number, Field(ge=0, le=10)]))
    assert message.startswith("f.yaml:2: x: ") and problem in message


def test_the_ends_of_a_range_may_be_infinite():
    assert validated(parse("[-.inf, 1e-3]", "f"), TypeAdapter(Range)) == (float("-inf"), 1e-3)


@pytest.mark.parametrize("text", ["[1, 1]", "[2, 1]", "[1]", "[1, 2, 3]"])
def test_a_range_is_two_rising_numbers(text):
    assert "two numbers [low, high] are expected" in refusal(validated, parse(text, "f"), TypeAdapter(Range))


def test_whole_numbers_are_not_rounded():
    whole = TypeAdapter(Whole)
    assert [validated(parse(text, "f"), whole) for text in ("7", "7.0", "1e3")] == [7, 7, 1000]
    assert "a whole number is expected, not 7.5" in refusal(validated, parse("7.5", "f"), whole)


def test_an_unknown_key_is_refused_with_the_nearest_known_one(document):
    message = refusal(document.mapping, ["nmae", "sizes", "nested", "nothing"])
    assert message == "file.yaml:2: name: unknown key; did you mean 'nmae'?"
    assert "known: x, y" in refusal(document.mapping, ["x", "y"])


def test_other_shapes_are_refused(document):
    keys = document.mapping()
    assert "a mapping (key: value) is expected" in refusal(keys["sizes"].mapping)
    assert "a list (- item) is expected" in refusal(keys["name"].items)
    assert "text is expected, not {'deeper'" in refusal(validated, keys["nested"], TypeAdapter(str))
    walker = TypeAdapter(Literal["walker", "runner"])
    assert "'hopper' is none of walker, runner" in refusal(validated, keys["name"], walker)
    assert keys["nothing"].items() == []


@dataclass(frozen=True)
class Wheel:
    """A part of a machine."""

    __pydantic_config__ = ConfigDict(extra="forbid")
    radius: Number
    spokes: Whole | None = None


@dataclass(frozen=True)
class Cart:
    """A machine of parts."""

    __pydantic_config__ = ConfigDict(extra="forbid")
    wheels: tuple[Wheel, ...]
    axle: Wheel | None = None


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "wheels:\n- {radius: 1}\n- {raduis: 1}",
            "f:3: wheels[1].raduis: unknown key; did you mean 'radius'?",
        ),
        ("wheels: []\naxle: {x: 1, radius: 1}", "f:2: axle.x: unknown key; known: radius, spokes"),
        ("wheels: []\naxel: {radius: 1}", "f:2: axel: unknown key; did you mean 'axle'?"),
        ("wheels:\n- radius: 1\n  spokes: 2.5", "f:3: wheels[0].spokes: a whole number is expected, not 2.5"),
        ("wheels:\n- {spokes: 3}", "f:2: wheels[0]: 'radius:' is missing"),
        ("wheels: 4", "f:1: wheels: a list (- item) is expected here"),
        ("wheels: [4]", "f:1: wheels[0]: a mapping (key: value) is expected here"),
        ("axle: {radius: 1}", "f:1: 'wheels:' is missing"),
        ("{}", "f:1: 'wheels:' is missing"),
        ("", "f: a mapping (key: value) is expected here"),
    ],
)
def test_what_a_type_does_not_allow_is_refused_with_line_and_path(text, message):
    assert refusal(validated, parse(text, "f"), TypeAdapter(Cart)) == message


@pytest.mark.parametrize(
    ("text", "line", "problem"),
    [
        ("a: 1\nb: [1, 2", "2", "is not valid YAML"),
        ("a: 1\n b: 2", "2", "is not valid YAML"),
        ("a: 1\na: 2", "2", "a: is given twice"),
        ("a: 1\n? [b, c]\n: 2", "2", "a key is a single word"),
        ("a: !!python/object:os.system 1", "1", "is not valid YAML"),
        ("a: 2024-13-45", "1", "a: month must be in 1..12"),
    ],
)
def test_a_malformed_document_is_refused_with_its_line(text, line, problem):
    message = refusal(parse, text, "f.yaml")
    assert message.startswith(f"f.yaml:{line}: ") and problem in message


@pytest.mark.parametrize("text", ["a: \0", "&a [*a]", "[" * 5000, "a: 1\n---\nb: 2"])
def test_no_text_makes_the_parser_fail_otherwise(text):
    refusal(parse, text, "f.yaml")


def test_a_file_that_cannot_be_read_is_refused_by_name(tmp_path):
    assert "missing.yaml: cannot be read: No such file" in refusal(read, tmp_path / "missing.yaml")
    assert "cannot be read: Is a directory" in refusal(read, tmp_path)
    (tmp_path / "binary.yaml").write_bytes(b"\xff\xfe\x00\x80")
    assert "binary.yaml: cannot be read: is not a text file" in refusal(read, tmp_path / "binary.yaml")
