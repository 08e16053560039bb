"""A notebook as a page: its text and its code, without results."""

import json
from pathlib import Path


def page(path: Path) -> str:
    """Markdown of a notebook, with a line under the title that says where the notebook itself is."""
    cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
    parts = [_cell(cell["cell_type"], "".join(cell["source"])) for cell in cells]
    return "\n\n".join(
        [parts[0], f"This page is made from a notebook: [{path.name}](notebooks/{path.name}).", *parts[1:]]
    )


def _cell(kind: str, source: str) -> str:
    return source if kind == "markdown" else f"```python\n{source}\n```"
