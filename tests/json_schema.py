"""A check of JSON data against the parts of JSON Schema that the schema of a diagnosis uses."""

from typing import Any

TYPES: dict[str, tuple[type, ...]] = {
    "null": (type(None),), "number": (int, float), "string": (str,), "boolean": (bool,), "array": (list,), "object": (dict,),
}  # fmt: skip


def violations(value: Any, schema: dict[str, Any], root: dict[str, Any], at: str = "$") -> list[str]:
    """Places at which a value is not what the schema says; `root` holds the definitions."""
    if "$ref" in schema:
        return violations(value, root["$defs"][schema["$ref"].rpartition("/")[2]], root, at)
    if "anyOf" in schema:
        tried = [violations(value, one, root, at) for one in schema["anyOf"]]
        return [] if [] in tried else min(tried, key=len)
    if "enum" in schema and value not in schema["enum"]:
        return [f"{at}: {value!r} is none of {schema['enum']}"]
    names = schema.get("type", [])
    allowed = [kind for name in ([names] if isinstance(names, str) else names) for kind in TYPES[name]]
    if allowed and not isinstance(value, tuple(allowed)):
        return [f"{at}: {type(value).__name__} is not {names}"]
    found: list[str] = []
    if isinstance(value, dict):
        known, others = schema.get("properties", {}), schema.get("additionalProperties")
        found += [f"{at}: {name} is missing" for name in schema.get("required", []) if name not in value]
        for name, one in value.items():
            part = known.get(name, others if isinstance(others, dict) else None)
            if part is not None:
                found += violations(one, part, root, f"{at}.{name}")
            elif known:
                found.append(f"{at}: {name} is unknown")
    if isinstance(value, list) and isinstance(schema.get("items"), dict):
        for index, one in enumerate(value):
            found += violations(one, schema["items"], root, f"{at}[{index}]")
    return found
