"""The demonstration behind `make demo`: the graph runs for a minute, then its bag alone gives the delays back.

    python docs/demo.py [FOLDER]      FOLDER is new; default out/demo-<date>-<time>

The truth is read from the experiment file and compared afterwards; the identification sees the bag only.
"""

import json
import sys
from datetime import datetime
from pathlib import Path

from demo_command import rhythmid
from rich.console import Console
from rich.table import Table

from rhythmid.experiment import Experiment

ROOT = Path(__file__).parents[1]
EXPERIMENT = ROOT / "ros_ws/src/rhythmid_bringup/config/demo.yaml"
MODEL = ROOT / "analysis/rhythmid/models/paper_hopper.yaml"


def compare(experiment: Experiment, result: dict) -> Table:
    """True against estimated values."""
    table = Table("quantity", "true", "estimated", "std", "error", title="true against estimated")

    def row(name: str, true: float, found: dict, unit: str, scale: float = 1.0) -> None:
        value, std = (scale * found[key] for key in ("value", "std"))
        error = value - scale * true
        share = f" ({100 * error / (scale * true):+.2f} %)" if true else ""
        table.add_row(
            name, f"{scale * true:.4g} {unit}", f"{value:.4f}", f"{std:.2g}", f"{error:+.4f}{share}"
        )

    for name, delay in (("input", experiment.input_delay), ("measurement", experiment.measurement_delay)):
        row(f"{name} delay", delay.constant, result["delays"][name], "ms", 1e3)
    for name, found in result["parameters"].items():
        if name in experiment.model.parameters and not name.endswith(".delay"):
            row(name, experiment.model.value(name), found, found["unit"])
    return table


def main() -> None:
    default = ROOT / "out" / datetime.now().strftime("demo-%Y%m%d-%H%M%S")
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else default
    folder.mkdir(parents=True)
    bag, answer, report = folder / "bag", folder / "result.json", folder / "report.html"
    rhythmid("run", EXPERIMENT, "--out", bag)
    rhythmid("identify", bag, "--model", MODEL, "--json", answer, "--report", report)
    Console().print(compare(Experiment.load(EXPERIMENT), json.loads(answer.read_text(encoding="utf-8"))))
    print(f"bag: {bag}\nresult: {answer}\nreport with plots: {report}")


if __name__ == "__main__":
    main()
