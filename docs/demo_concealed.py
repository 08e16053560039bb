"""The second act of `make demo`: an effect is concealed in the plant, and found from the bags of the graph.

    python docs/demo_concealed.py [FOLDER] [SEED]      FOLDER is new; the seed chooses the effect, default the time of day

The plant node runs a model file with one element more than the nominal model. Which one, and how much of it, is drawn at
random and written to a sealed file that nobody reads until the diagnosis is there.
"""

import json
import sys
import time
from datetime import datetime
from pathlib import Path

import numpy as np
import yaml
from demo_command import rhythmid, seal_of
from rich.console import Console

from rhythmid.elements.catalogue import load_catalogue
from rhythmid.model import Model
from rhythmid.report.quantity import with_std

ROOT = Path(__file__).parents[1]
NOMINAL = ROOT / "analysis/rhythmid/models/paper_hopper.yaml"
NOISE = 1e-4  # [m]

# What can be concealed: sizes at which the effect leaves a residual of one to a few times the noise.
EFFECTS = {
    "coulomb_friction": {"force": (0.005, 0.02)},
    "quadratic_drag": {"coefficient": (0.1, 0.4)},
    "cubic_stiffness": {"coefficient": (200.0, 800.0)},
    "quadratic_stiffness": {"coefficient": (40.0, 150.0)},
    "viscoelastic_relaxation": {"stiffness": (3.0, 10.0), "time_constant": (0.05, 0.12)},
    "actuator_deadband": {"threshold": (0.015, 0.05)},
    "actuator_lag": {"time_constant": (0.01, 0.025)},
    "command_lag": {"time_constant": (0.01, 0.025)},
    "sensor_lag": {"time_constant": (0.01, 0.025)},
}
RECORDS = {
    "cycle": ({"type": "silence", "length": 8.0}, 3.0),
    "chirp": ({"type": "chirp", "amplitude": 1.0, "band": [0.2, 7.0], "sweep": 20.0}, 1.0),
    "multisine": ({"type": "multisine", "rms": 0.4, "period": 5.0, "periods": 4, "band": [0.2, 8.0], "seed": 4}, 1.0),
    "unseen": ({"type": "chirp", "amplitude": 0.5, "band": [7.0, 0.2], "sweep": 15.0}, 2.0),
}  # fmt: skip


def conceal(folder: Path, seed: int) -> tuple[Path, Path]:
    """Draw a machine: the plant's model file, and the sealed truth."""
    rng = np.random.default_rng(seed)
    catalogue = load_catalogue()
    name = list(EFFECTS)[rng.integers(len(EFFECTS))]
    values = {
        key: float(np.exp(rng.uniform(np.log(low), np.log(high))))
        for key, (low, high) in EFFECTS[name].items()
    }
    delays = {"input": float(rng.uniform(0.005, 0.06)), "measurement": float(rng.uniform(0.005, 0.06))}
    machine = Model.load(NOMINAL, catalogue).with_values(
        {
            "linear_spring.stiffness": 200.0 * rng.uniform(0.9, 1.1),
            "switched_damper.stance": 2.0 * rng.uniform(0.8, 1.2),
        }
    )
    plant = folder / "plant.yaml"
    machine.with_element(catalogue[name], values).save(plant)
    truth = {
        "element": name,
        "values": values,
        "delays": delays,
        "stiffness": machine.value("linear_spring.stiffness"),
        "stance": machine.value("switched_damper.stance"),
    }
    sealed = folder / "sealed.json"
    sealed.write_text(json.dumps(truth, indent=2), encoding="utf-8")
    for record, (excitation, forcing) in RECORDS.items():
        experiment = {
            "model": plant.name,
            "excitation": excitation,
            "forcing": {"amplitude": forcing, "frequency": 1.0},
            "delays": delays,
            "noise": {"measurement_std": NOISE},
            "time": {"mode": "lockstep", "layout": "composed"},
            "seed": int(rng.integers(1_000_000)),
        }
        (folder / f"{record}.yaml").write_text(yaml.safe_dump(experiment, sort_keys=False), encoding="utf-8")
    return plant, sealed


def main() -> None:
    default = ROOT / "out" / datetime.now().strftime("concealed-%Y%m%d-%H%M%S")
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else default
    seed = int(sys.argv[2]) if len(sys.argv) > 2 else int(time.time())
    folder.mkdir(parents=True)
    console = Console()
    _, sealed = conceal(folder, seed)
    digest = seal_of(sealed)
    console.print(f"An effect is concealed in the plant (seed {seed}). Sealed: SHA-256 {digest[:16]}…")
    for record in RECORDS:
        rhythmid("run", folder / f"{record}.yaml", "--out", folder / record)
    seen = [folder / record for record in RECORDS if record != "unseen"]
    answer, report, augmented = (
        folder / "diagnosis.json",
        folder / "diagnosis.html",
        folder / "augmented.yaml",
    )
    rhythmid("diagnose", *seen, "--model", NOMINAL, "--holdout", folder / "unseen", "--json", answer,
             "--report", report, "--save-model", augmented)  # fmt: skip
    assert seal_of(sealed) == digest
    truth, found = (
        json.loads(sealed.read_text(encoding="utf-8")),
        json.loads(answer.read_text(encoding="utf-8")),
    )
    named = [effect["element"] for effect in found["missing"]]
    console.print(f"\nThe seal is opened. Concealed: [bold]{truth['element']}[/] {truth['values']}")
    console.print(f"Diagnosis: [bold]{found['verdict']}[/], {', '.join(named) or 'nothing named'}")
    for effect in found["missing"]:
        for name, value in effect["parameters"].items():
            true = truth["values"].get(name) if effect["element"] == truth["element"] else None
            beside = "" if true is None else f"   (true {true:.4g})"
            console.print(f"  {effect['element']}.{name} = {with_std(value['value'], value['std'])}{beside}")
    for name in ("input", "measurement"):
        delay = found["delays"][name]
        console.print(
            f"  {name} delay = {1e3 * delay['value']:.3f} ms   (true {1e3 * truth['delays'][name]:.3f} ms)"
        )
    console.print(f"report: {report}\naugmented model: {augmented}")


if __name__ == "__main__":
    main()
