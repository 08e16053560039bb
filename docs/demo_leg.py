"""`make demo-leg`: an effect is concealed at one joint of a leg, and found from its records.

    python docs/demo_leg.py [FOLDER] [SEED]      FOLDER is new; the seed chooses joint and effect, default the time of day

The leg of `rhythmid/models/legs` slides on a rail and stands on a floor. The plant has one element more than the nominal model, at its hip or at
its knee. Which one, where, and how much of it, is drawn at random and written to a sealed file that nobody reads until the diagnosis is there.
"""

import json
import sys
import time
from datetime import datetime
from importlib.resources import files
from pathlib import Path

import numpy as np
import yaml
from demo_command import rhythmid, seal_of
from rich.console import Console

from rhythmid.body.machine import Machine
from rhythmid.elements.catalogue import load_catalogue
from rhythmid.report.quantity import with_std

ROOT = Path(__file__).parents[1]
LEGS = Path(str(files("rhythmid"))) / "models" / "legs"
NOMINAL, SIGNALS = LEGS / "leg.yaml", LEGS / "leg_signals.yaml"
RECORDS = {"seen": 1, "unseen": 11}  # the seed of each record's excitation
EFFECTS = {  # what can be concealed, in sizes of some percent of the joint's torque
    "coulomb_friction": {"force": (0.2, 0.5), "transition": (0.01, 0.03)},
    "linear_spring": {"stiffness": (1.5, 4.0), "rest_length": (-0.3, 0.3)},
    "constant_force": {"force": (0.4, 1.0)},
    "quadratic_drag": {"coefficient": (0.02, 0.06)},
}


def conceal(folder: Path, seed: int) -> tuple[Path, Path]:
    """Draw a machine: the plant's model file, and the sealed truth."""
    rng, catalogue = np.random.default_rng(seed), load_catalogue()
    machine = Machine.load(NOMINAL, catalogue)
    joint = str(rng.choice(machine.joints))
    name = list(EFFECTS)[rng.integers(len(EFFECTS))]
    values = {key: float(rng.uniform(low, high)) for key, (low, high) in EFFECTS[name].items()}
    plant, sealed = folder / "plant.yaml", folder / "sealed.json"
    machine.with_element(joint, catalogue[name], values).save(plant)
    sealed.write_text(json.dumps({"joint": joint, "element": name, "values": values}), encoding="utf-8")
    for record, first in RECORDS.items():
        experiment = yaml.safe_load((LEGS / "leg_experiment.yaml").read_text(encoding="utf-8"))
        experiment |= {"model": plant.name, "duration": 8.0}
        for place, one in enumerate(experiment["excitation"].values()):
            one |= {"seed": first + place, "periods": 2}
        (folder / f"{record}.yaml").write_text(yaml.safe_dump(experiment, sort_keys=False), encoding="utf-8")
    return plant, sealed


def main() -> None:
    default = ROOT / "out" / datetime.now().strftime("leg-%Y%m%d-%H%M%S")
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else default
    seed = int(sys.argv[2]) if len(sys.argv) > 2 else int(time.time())
    folder.mkdir(parents=True)
    console = Console()
    plant, sealed = conceal(folder, seed)
    digest = seal_of(sealed)
    console.print(
        f"An effect is concealed at a joint of the leg (seed {seed}). Sealed: SHA-256 {digest[:16]}…"
    )
    for record in RECORDS:
        rhythmid("simulate", plant, "--experiment", folder / f"{record}.yaml", "--out", folder / record)
    answer, report, augmented = folder / "answer.json", folder / "answer.html", folder / "augmented.yaml"
    rhythmid("diagnose", folder / "seen", "--model", NOMINAL, "--signals", SIGNALS, "--holdout", folder / "unseen",
             "--json", answer, "--report", report, "--save-model", augmented)  # fmt: skip
    assert seal_of(sealed) == digest
    truth = json.loads(sealed.read_text(encoding="utf-8"))
    found = json.loads(answer.read_text(encoding="utf-8"))
    named = [f"{effect['element']} at {effect['joint']}" for effect in found["missing"]]
    console.print(
        f"\nThe seal is opened. Concealed: [bold]{truth['element']} at {truth['joint']}[/] {truth['values']}"
    )
    console.print(f"Diagnosis: [bold]{', '.join(named) or found['verdict']}[/]")
    for effect in found["missing"]:
        right = (effect["joint"], effect["element"]) == (truth["joint"], truth["element"])
        for name, value in effect["parameters"].items():
            true = truth["values"].get(name) if right else None
            beside = "" if true is None else f"   (true {true:.4g})"
            console.print(f"  {effect['joint']}: {name} = {with_std(value['value'], value['std'])}{beside}")
    console.print(f"report: {report}\naugmented model: {augmented}")


if __name__ == "__main__":
    main()
