"""A real quadruped in the air: identification and diagnosis from its references and angles only.

    python benchmarks/go2.py [--folder DIR] [--diagnose]

The recording (docs/real.md) is in $RHYTHMID_DATA, else in ../shared/data beside the checkout. Printed: the error of free runs over
the held-out last fifth of the recording, as a share of the motion of each leg, of the file as it is and as identified; the
rotors' inertias of left and right legs, also of each half and of the whole of the recording; what the data do not separate; and with --diagnose what is missing at which joint. `--folder`
keeps the files that were made.
"""

import argparse
import os
import tempfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from rhythmid.body.machine import Machine
from rhythmid.diagnose.joints.joint_diagnosis import diagnose_machine
from rhythmid.elements.catalogue import load_catalogue
from rhythmid.identify.joints.held_reference import balances_of
from rhythmid.identify.joints.joint_identification import (
    MachineIdentification,
    identify_machine,
    rotor_freed,
)
from rhythmid.identify.joints.reference_delay import fit_with_delay, reference_delay
from rhythmid.model import INERTIA
from rhythmid.record.cleaning import cleaned_joints
from rhythmid.record.joint_record import JointRecord, load_joint_records

LEGS = ("FL", "FR", "RL", "RR")
PARTS = ("hip", "thigh", "calf")
GAINS = (20.0, 1.5)  # N m/rad, N m s/rad: the controller's, on the robot
DATA = Path(os.environ.get("RHYTHMID_DATA", Path(__file__).parents[2] / "shared" / "data")) / "go2"


def files(folder: Path) -> tuple[Path, Path]:
    """A model and a signals file for the recording."""
    path = (
        "command: [{input_delay: {delay: {value: 0.0, unit: s}}}, "
        f"{{position_control: {{proportional: {{value: {GAINS[0]}, unit: N*m/rad, fixed: true}}, "
        f"derivative: {{value: {GAINS[1]}, unit: N*m*s/rad, fixed: true}}}}}}]"
    )
    joints = [f"{leg}_{part}_joint" for leg in LEGS for part in PARTS]
    model, signals = folder / "go2.yaml", folder / "signals.yaml"
    lines = [
        f"body: {{mjcf: {DATA / 'go2.xml'}, base: fixed, step: 0.001, contacts: false,",
        f"       free: {{{', '.join(f'{joint}.armature: {{}}' for joint in joints)}}}}}",
        "joints:",
    ]
    model.write_text("\n".join([*lines, *(f"  {joint}: {{{path}}}" for joint in joints)]) + "\n")
    signals.write_text(
        f"joints: [{', '.join(joints)}]\ntables: {{file: {DATA / 'traj_0.npz'}}}\ntime: {{column: time}}\n"
        'input: {column: "des_dof_pos[*]", kind: reference}\noutput: {column: "dof_pos[*]"}\n'
    )
    return model, signals


def of_legs(errors: dict[str, float]) -> str:
    """Errors of the legs, and their mean."""
    found = [sum(errors[f"{leg}_{part}_joint"] for part in PARTS) / len(PARTS) for leg in LEGS]
    return (
        ", ".join(f"{leg} {value:.4f}" for leg, value in zip(LEGS, found))
        + f"; mean {sum(found) / len(found):.4f}"
    )


def told(name: str, found: MachineIdentification) -> None:
    """Print an identification."""
    print(f"== {name}")
    for which, errors in found.free_run.items():
        print(f"free run, held out, {which}: {of_legs(errors)}")
    for part in PARTS:
        values = [found.parameters[f"body.{leg}_{part}_joint.armature"].value for leg in LEGS]
        print(f"rotor inertia, {part}: {', '.join(f'{value:.4f}' for value in values)} kg m^2")
    for line in (*found.not_separable[-3:], *found.notes):
        print(f"not separable: {line}")


def rotors(records: Sequence[JointRecord], machine: Machine) -> dict[str, str]:
    """The rotors' inertias of these records by inverse dynamics, with their standard deviations, by the part of a leg; and the delay."""
    records, _ = cleaned_joints(records, machine.turning)
    balances = balances_of(machine, records)
    known = machine.body.parameters
    balances = replace(
        balances,
        models={
            joint: rotor_freed(one, known[f"{joint}.armature"]) for joint, one in balances.models.items()
        },
    )
    common = reference_delay(balances, balances.computed)
    made: dict[str, list[str]] = {part: [] for part in PARTS}
    for joint in machine.joints:
        fit = fit_with_delay(
            balances.balance(joint, common.shared.value), balances.models[joint], joint, common
        )
        value = known[f"{joint}.armature"] + fit.model.mass.value - machine.paths[joint].mass.value
        std = fit.std[1 + fit.names.index(INERTIA)]
        made[joint.split("_")[1]].append(f"{value:.4f} ± {std:.4f}")
    return {part: ", ".join(values) for part, values in made.items()} | {"delay": common.told}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--folder", type=Path)
    parser.add_argument("--diagnose", action="store_true")
    given = parser.parse_args()
    folder = given.folder or Path(tempfile.mkdtemp(prefix="rhythmid-go2-"))
    folder.mkdir(parents=True, exist_ok=True)
    model, signals = files(folder)
    machine = Machine.load(model)
    records = load_joint_records([signals], signals)
    found = identify_machine(records, machine)
    told("the file's elements", found)
    constant = load_catalogue()["constant_force"]
    for joint in machine.joints:
        machine = machine.with_element(joint, constant, {"force": 0.0})
    found = identify_machine(records, machine)
    told("with a constant torque at each joint", found)
    found.machine.save(folder / "identified.yaml")
    start, end = records[0].span
    for first, last in ((0.0, 0.5), (0.5, 1.0), (0.0, 1.0)):
        part = records[0].cut(start + first * (end - start), start + last * (end - start))
        print(
            f"== from {first:g} to {last:g} of the record, with a constant torque at each joint, by inverse dynamics alone"
        )
        for name, values in rotors([part], machine).items():
            print(f"{name}: {values}")
    if given.diagnose:
        answer = diagnose_machine(records, Machine.load(model)).diagnosis
        print(answer.summary)
        for one in answer.missing:
            sizes = ", ".join(f"{n} {v.value:.3g} {v.unit}" for n, v in one.parameters.items())
            print(f"{one.joint}: {one.element} ({sizes}), probability {one.probability:.2f}")
        print(
            f"unknown: {', '.join(answer.unknown) or 'none'}; undecided: {', '.join(answer.undecided) or 'none'}"
        )


if __name__ == "__main__":
    main()
