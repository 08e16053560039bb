"""The reference of the result of `rhythmid diagnose --json`, written from its JSON schema."""

import json
from pathlib import Path
from typing import Any

SCHEMA = Path(__file__).parents[1] / "schema" / "diagnose.schema.json"
HEAD = """# JSON of a diagnosis

This page is generated from [diagnose.schema.json](schema/diagnose.schema.json), the JSON schema of what `rhythmid diagnose --json`
writes. [Read a diagnosis](diagnose.md#the-json) says what the fields mean.
"""


def page() -> str:
    """Markdown with one table for the answer and one for each type that it refers to."""
    schema = json.loads(SCHEMA.read_text(encoding="utf-8"))
    parts = [HEAD, _section("Diagnosis", schema, "The whole answer.")]
    parts += [_section(name, one, "") for name, one in schema["$defs"].items() if "properties" in one]
    return "\n".join(parts)


def _section(name: str, schema: dict[str, Any], otherwise: str) -> str:
    needed = schema.get("required", ())
    rows = [
        f"| `{field}` | {_type(one)} | {'always' if field in needed else 'may be absent'} |"
        for field, one in schema["properties"].items()
    ]
    head = ["| field | type | present |", "| --- | --- | --- |"]
    return "\n".join([f"## {name}", "", schema.get("description", otherwise), "", *head, *rows, ""])


def _type(schema: Any) -> str:
    """A type in words; a name of another type is a link to its section."""
    if schema is True or not schema:
        return "any"
    if "$ref" in schema:
        name = schema["$ref"].rpartition("/")[2]
        return f"[{name}](#{name.lower()})"
    if "anyOf" in schema:
        return " or ".join(dict.fromkeys(_type(one) for one in schema["anyOf"]))
    if "enum" in schema:
        return ", ".join(f"`{one}`" for one in schema["enum"])
    if "const" in schema:
        return f"`{schema['const']}`"
    kinds = schema.get("type", "any")
    return " or ".join(_kind(kind, schema) for kind in ([kinds] if isinstance(kinds, str) else kinds))


def _kind(kind: str, schema: dict[str, Any]) -> str:
    if kind == "array":
        return f"list of {_type(schema.get('items', True))}"
    if kind == "object" and isinstance(schema.get("additionalProperties"), dict):
        return f"mapping of names to {_type(schema['additionalProperties'])}"
    return kind
