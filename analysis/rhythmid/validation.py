"""Validation of a document's values against the type that they are read into. Error messages name file, line and key.

A type is a dataclass or pydantic model whose fields state what is allowed (`Annotated[Number, Field(ge=0)]`). Every file of a
user is read through `validated`, so that the checks of a value are stated once, in its type.
"""

import math
import re
from collections.abc import Mapping
from typing import Annotated, Any, NoReturn, TypeVar

from pydantic import AfterValidator, BeforeValidator, Discriminator, Field, Tag, TypeAdapter, ValidationError

from rhythmid.document import Node, unknown_key

T = TypeVar("T")
UNKNOWN_KEY = ("extra_forbidden", "unexpected_keyword_argument")


def _numeric(value: Any) -> Any:
    """Needed because YAML 1.1 reads 1e-3 as text, and pydantic reads a truth value as a number."""
    if isinstance(value, bool) or not isinstance(value, (int, float, str)):
        raise ValueError(f"a number is expected, not {value!r}")
    try:
        number = float(value)
    except (ValueError, OverflowError):
        raise ValueError(f"a number is expected, not {value!r}") from None
    if math.isnan(number):
        raise ValueError("is not a number (NaN)")
    return number if isinstance(value, str) else value


def _rising(ends: tuple[float, float]) -> tuple[float, float]:
    if not ends[0] < ends[1]:
        raise ValueError(
            f"[{ends[0]:g}, {ends[1]:g}] is no range: two numbers [low, high] are expected, low < high"
        )
    return ends


def _two(value: Any) -> Any:
    if isinstance(value, list) and len(value) != 2:
        raise ValueError(f"two numbers [low, high] are expected, low < high, not {len(value)}")
    return value


def _word(value: Any) -> Any:
    return str(value) if isinstance(value, (int, float)) else value


Number = Annotated[float, BeforeValidator(_numeric), Field(allow_inf_nan=False)]
End = Annotated[float, BeforeValidator(_numeric)]  # of a range, which may be open
Whole = Annotated[int, BeforeValidator(_numeric)]
Range = Annotated[tuple[End, End], BeforeValidator(_two), AfterValidator(_rising)]
Word = Annotated[str, BeforeValidator(_word)]  # text that YAML may read as a number, such as the unit 1


def by_shape(value: Any) -> str:
    """Tag of a value that is either a mapping or a plain value."""
    return "mapping of keys" if isinstance(value, Mapping) else "plain value"


InKeys, Plain = Tag("mapping of keys"), Tag("plain value")
ByShape = Discriminator(by_shape)

NUMBER: TypeAdapter[float] = TypeAdapter(Number)


def validated(node: Node, wanted: TypeAdapter[T], context: Mapping[str, Any] | None = None) -> T:
    """The node's value as `wanted`. Raises InputError at the place of the first value that is not allowed, unknown keys first."""
    try:
        return wanted.validate_python(node.plain, context=None if context is None else dict(context))
    except ValidationError as error:
        first = min(error.errors(), key=lambda one: one["type"] not in UNKNOWN_KEY)
    _refuse(node, wanted, first)


def _refuse(node: Node, wanted: TypeAdapter[Any], error: Any) -> NoReturn:
    kind, found, limits = error["type"], error.get("input"), error.get("ctx", {})
    place, location = node, error["loc"]
    for part in location:
        place = place.at(part)
    if kind == "union_tag_invalid":
        place = place.at(limits["discriminator"].strip("'"))
    if kind in UNKNOWN_KEY:
        place.fail(unknown_key(str(location[-1]), _known(wanted, location[:-1])))
    if kind == "union_tag_not_found":
        place.fail(f"'{limits['discriminator'].strip(chr(39))}:' is missing")
    if kind.startswith("missing"):
        last = location[-1]
        place.fail(f"item {last + 1} is missing" if isinstance(last, int) else f"'{last}:' is missing")
    place.fail(_problem(kind, found, limits, error["msg"]))


def _problem(kind: str, found: Any, limits: Mapping[str, Any], message: str) -> str:
    """What is wrong with a value; pydantic's message is replaced if it does not say what to write."""
    if kind == "value_error":
        return message.removeprefix("Value error, ")
    if kind in ("literal_error", "union_tag_invalid"):
        return f"{limits.get('tag', found)!r} is none of {_listed(limits.get('expected_tags') or limits['expected'])}"
    bound = {
        "greater_than": ("gt", "too small; more than"),
        "greater_than_equal": ("ge", "too small; at least"),
        "less_than": ("lt", "too large; less than"),
        "less_than_equal": ("le", "too large; at most"),
    }.get(kind)
    if bound is not None:
        return f"{found} is {bound[1]} {limits[bound[0]]:g} is expected"
    shapes = (
        (("float_", "decimal_"), "a number is expected"),
        (("int_",), "a whole number is expected"),
        (("string_", "path_"), "text is expected"),
        (("bool_",), "true or false is expected"),
    )
    if kind == "finite_number":
        return "must be finite" if not math.isnan(float(found)) else "is not a number (NaN)"
    for starts, words in shapes:
        if kind.startswith(starts):
            return f"{words}, not {found!r}"
    if kind == "model_attributes_type":  # of a union that is told by its type
        return "a mapping with a 'type' is expected"
    if kind in ("dataclass_type", "model_type", "dict_type", "mapping_type"):
        return "a mapping (key: value) is expected here"
    if kind in ("tuple_type", "list_type"):
        return "a list (- item) is expected here"
    return message[:1].lower() + message[1:]


def _listed(quoted: str) -> str:
    return ", ".join(re.findall(r"'([^']*)'", quoted))


def _known(wanted: TypeAdapter[Any], location: tuple[Any, ...]) -> list[str]:
    """The keys that are allowed at a place, read off the type's JSON schema; aliases and tags of unions are followed."""
    root = wanted.json_schema(by_alias=True)
    open_ends: list[Any] = [root]

    def resolved(schema: dict[str, Any]) -> list[dict[str, Any]]:
        if "$ref" in schema:
            schema = root["$defs"][schema["$ref"].rsplit("/", 1)[-1]]
        options = [*schema.get("anyOf", []), *schema.get("oneOf", [])]
        return [one for option in options for one in resolved(option)] if options else [schema]

    for part in location:
        found = []
        for schema in (one for end in open_ends for one in resolved(end)):
            if isinstance(part, int):
                found += (
                    [schema["items"]] if "items" in schema else schema.get("prefixItems", [])[part : part + 1]
                )
            elif part in schema.get("properties", {}):
                found.append(schema["properties"][part])
            elif schema.get("properties", {}).get("type", {}).get("const") == part:
                found.append(schema)
        open_ends = found or open_ends
    every = [schema.get("properties", {}) for end in open_ends for schema in resolved(end)]
    return list(dict.fromkeys(name for one in every for name in one))
