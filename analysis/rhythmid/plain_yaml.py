"""YAML of plain values, for content that is given as a mapping instead of a file."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml

from rhythmid.errors import InputError


def plain_yaml(content: Mapping[str, Any], name: str) -> str:
    """YAML of a mapping of numbers, text, lists and mappings, NumPy's numbers and paths among them.

    Raises InputError, with `name` for the mapping, where it holds anything else.
    """

    def plain(value: Any) -> Any:
        if hasattr(value, "tolist"):
            return value.tolist()
        if isinstance(value, Path):
            return str(value)
        raise InputError(
            f"{name}: {value!r} is no plain value; numbers, text, lists and mappings are expected"
        )

    return yaml.safe_dump(json.loads(json.dumps(content, default=plain)), sort_keys=False)
