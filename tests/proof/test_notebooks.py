"""The notebooks of the documentation run from their first cell to their last, and what they show can be shown."""

import ast
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

FOLDER = Path(__file__).parents[2] / "docs" / "notebooks"
DATA = Path(os.environ.get("RHYTHMID_DATA") or Path(__file__).parents[3] / "shared" / "data")
NOTEBOOKS = ("paper_hopper", "your_bag", "real_recording")
LONG = {"real_recording": pytest.mark.long}  # a diagnosis of Silverbox, which test_silverbox makes too


def as_script(notebook: Path) -> str:
    """The notebook's code; the last expression of a cell is rendered as a notebook renders it."""
    cells = json.loads(notebook.read_text(encoding="utf-8"))["cells"]
    lines = ["def shown(value):", "    return getattr(value, '_repr_html_', value.__repr__)()"]
    for cell in cells:
        if cell["cell_type"] != "code":
            continue
        tree = ast.parse("".join(cell["source"]))
        last = tree.body[-1]
        if isinstance(last, ast.Expr):
            call = ast.Call(ast.Name("shown", ast.Load()), [last.value], [])
            tree.body[-1] = ast.Assert(ast.Compare(call, [ast.IsNot()], [ast.Constant("")]))
        lines.append(ast.unparse(ast.fix_missing_locations(tree)))
    return "\n".join(lines) + "\n"


@pytest.mark.timeout(600)
@pytest.mark.parametrize("name", [pytest.param(name, marks=LONG.get(name, ())) for name in NOTEBOOKS])
def test_a_notebook_runs_to_its_end(name, tmp_path):
    if name == "real_recording" and not (DATA / "silverbox").is_dir():
        pytest.skip(f"the Silverbox data are not in {DATA}; set RHYTHMID_DATA")
    script = tmp_path / "notebook.py"
    script.write_text(as_script(FOLDER / f"{name}.ipynb"), encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "-W", "ignore", script],
        cwd=tmp_path, capture_output=True, text=True, timeout=580.0, check=False,
        env={**os.environ, "MPLBACKEND": "agg", "RHYTHMID_DATA": str(DATA)},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-3000:]


def test_no_notebook_is_left_out_and_none_holds_outputs():
    assert {path.stem for path in FOLDER.glob("*.ipynb")} == set(NOTEBOOKS)
    for path in FOLDER.glob("*.ipynb"):
        for cell in json.loads(path.read_text(encoding="utf-8"))["cells"]:
            assert not cell.get("outputs"), f"{path.name}: clear the outputs before it is committed"
