"""The concealed machine shares no code with the model that is fitted."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import rhythmid.proof

FOLDER = Path(rhythmid.proof.__file__).parent
MACHINES = tuple(f"machines/{path.name}" for path in sorted((FOLDER / "machines").glob("*.py")))
TRUTH = ("equations.py", "integrator.py", "machine.py", "protocol.py", "sizes.py", "noise.py", *MACHINES)
OWN = {f"rhythmid.proof.{name[:-3].replace('/', '.')}" for name in TRUTH} | {"rhythmid.proof.machines"}


def _imported(path: Path) -> set[str]:
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "relative imports would escape this test"
            found.add(node.module or "")
    return found


@pytest.mark.parametrize("name", TRUTH)
def test_the_concealed_machine_imports_nothing_of_ours_but_itself(name):
    assert {module for module in _imported(FOLDER / name) if module.startswith("rhythmid")} <= OWN


def test_running_the_concealed_machine_loads_no_element_no_simulator_and_no_model():
    code = (
        "import sys, numpy as np\n"
        "from rhythmid.proof.machine import Effect, Forcing, Machine, observe\n"
        "time = np.arange(100) / 1000\n"
        "observe(Machine(1.0, 200.0, 2.0, 0.2, 9.81), [Effect('quadratic_drag', {'coefficient': 0.1})],"
        " Forcing(1.0, 1.0, 0.0), time, np.zeros(100))\n"
        "print(*(name for name in sys.modules if name.startswith('rhythmid')))\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert set(done.stdout.split()) == {
        "rhythmid",
        "rhythmid.proof",
        "rhythmid.proof.equations",
        "rhythmid.proof.integrator",
        "rhythmid.proof.machine",
    }


def test_diagnosis_reads_the_records_and_the_nominal_model_and_knows_no_seal():
    imported = _imported(FOLDER / "examine.py")
    assert not imported & {
        "rhythmid.proof.seal",
        "rhythmid.proof.draw",
        "rhythmid.proof.machine",
        "rhythmid.proof.score",
    }
