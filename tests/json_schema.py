"""JSON against its schema: the keywords that pydantic writes, and no others."""

import json
from pathlib import Path
from typing import Any

from rhythmid.diagnose.answer.result import Diagnosis

SCHEMA = Path(__file__).parents[1] / "docs" / "schema" / "diagnose.schema.json"
TYPES: dict[str, tuple[type, ...]] = {
    "object": (dict,), "array": (list,), "string": (str,), "number": (int, float), "integer": (int,),
    "boolean": (bool,), "null": (type(None),),
}  # fmt: skip
WORDS = {"title", "description", "default", "$defs"}
KNOWN = {
    "$ref", "anyOf", "enum", "const", "type", "properties", "required", "additionalProperties", "propertyNames", "items",
    "prefixItems", "minItems", "maxItems",
}  # fmt: skip


def faults(value: Any, schema: Any, whole: dict[str, Any], place: str = "") -> list[str]:
    """What a JSON value has that its schema forbids; `whole` holds the definitions. KeyError for a keyword that is not known."""
    if schema is True:
        return []
    for word in set(schema) - WORDS - KNOWN:
        raise KeyError(word)
    if "$ref" in schema:
        return faults(value, whole["$defs"][schema["$ref"].rpartition("/")[2]], whole, place)
    if "anyOf" in schema:
        each = [faults(value, one, whole, place) for one in schema["anyOf"]]
        return [] if not all(each) else min(each, key=len)
    if value not in schema.get("enum", [value]) or value != schema.get("const", value):
        return [f"{place}: {value!r} is no word of the schema"]
    kinds = schema.get("type", [])
    allowed = tuple(kind for one in ([kinds] if isinstance(kinds, str) else kinds) for kind in TYPES[one])
    if allowed and (not isinstance(value, allowed) or (isinstance(value, bool) and bool not in allowed)):
        return [f"{place}: {value!r} is not of type {kinds}"]
    found: list[str] = []
    if isinstance(value, dict):
        own = schema.get("properties", {})
        found += [f"{place}: lacks {name}" for name in schema.get("required", ()) if name not in value]
        for name, one in value.items():
            found += faults(
                one, own.get(name, schema.get("additionalProperties", True)), whole, f"{place}.{name}"
            )
            found += faults(name, schema.get("propertyNames", True), whole, f"{place}.{name}")
    if isinstance(value, list):
        first = schema.get("prefixItems", [])
        if not schema.get("minItems", 0) <= len(value) <= schema.get("maxItems", len(value)):
            found.append(f"{place}: {len(value)} items")
        for index, one in enumerate(value):
            part = first[index] if index < len(first) else schema.get("items", True)
            found += faults(one, part, whole, f"{place}[{index}]")
    return found


def conforming(diagnosis: Diagnosis) -> Diagnosis:
    """The diagnosis, whose JSON is as the schema in the documentation says."""
    content = json.loads(json.dumps(diagnosis.to_dict(), allow_nan=False))
    schema = json.loads(SCHEMA.read_text())
    assert faults(content, schema, schema) == []
    return diagnosis
