"""Wrongly declared records of machines of several joints, and rightly declared records of machines that their file hardly fits.

    python benchmarks/joint_plausibility.py [--cases N] [--seed S]

Every machine has links with other masses than the file, and dry friction that the file lacks. In right records the masses are wrong by a factor of 2 (standard
deviation), in wrong ones by 1.2. In the latter one fault is drawn (two joints exchanged, degrees, an opposite sign, amperes, at one joint or at all).
"""

import argparse
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))
from legged import MODELS, recorded
from legs import BODIES, asked

from rhythmid.body.machine import Machine
from rhythmid.elements.catalogue import load_catalogue
from rhythmid.identify.joints.joint_plausibility import likely_joint_mend
from rhythmid.record.joint_record import JointRecord

FAULTS = {"degrees": (180.0 / np.pi, 1.0), "turned position": (-1.0, 1.0), "turned effort": (1.0, -1.0), "amperes": (1.0, 0.1)}  # fmt: skip
SAID = {"degrees": "degrees", "turned position": "position of {} seems to have its sign", "turned effort": "effort of {} seems to have its sign",
        "amperes": "such as a motor's current", "exchanged": "is recorded as"}  # fmt: skip


def made(machine: Machine, body: str, spread: float, friction: float, rng: np.random.Generator, held: bool) -> JointRecord:  # fmt: skip
    """Eight seconds of a machine whose links and losses are not those of the file."""
    time = np.arange(0.0, 8.0, 0.002)
    given = asked(body, machine, time, rng)
    plain = recorded(machine, given, time, rng)
    masses = {f"{link}.mass": machine.body.parameters[f"{link}.mass"] * float(np.exp(rng.normal(0.0, spread))) for link in machine.body.links}  # fmt: skip
    plant = machine.with_inertial(masses)
    law = load_catalogue()["coulomb_friction"]
    for joint in machine.joints:
        effort = plain.joints[joint].effort
        if effort is not None and plant.paths[joint].term(law.name) is None:
            size = float(np.std(effort.value)) * friction * float(rng.uniform())
            plant = plant.with_element(joint, law, {"force": size, "transition": 0.05})
    return recorded(plant, given, time, rng, held=held)


def with_fault(record: JointRecord, fault: str, joints: list[str]) -> JointRecord:
    """The record as it is read with this fault at these joints."""
    known = dict(record.joints)
    if fault == "exchanged":
        first, second = joints
        return replace(record, joints={**known, first: record.joints[second], second: record.joints[first]})
    position, effort = FAULTS[fault]
    for joint in joints:
        one = record.joints[joint]
        assert one.effort is not None and one.input is not None
        known[joint] = replace(
            one,
            output=replace(one.output, value=position * one.output.value),
            input=replace(one.input, value=position * one.input.value),
            effort=replace(one.effort, value=effort * one.effort.value),
        )
    return replace(record, joints=known)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--cases", type=int, default=36)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    false = right = other = wrong = 0
    for number in range(options.cases):
        rng = np.random.default_rng([options.seed, number])
        body = BODIES[number % len(BODIES)]
        machine = Machine.load(MODELS / f"{body}.yaml")
        record = made(machine, body, 0.7, 1.5, rng, number % 2 == 1)
        said = likely_joint_mend(machine, [record])
        false += said is not None
        if said:
            print(f"{number} {body}: false: {said}", flush=True)
        fault = list(SAID)[int(rng.integers(len(SAID)))]
        count = 2 if fault == "exchanged" else int(rng.choice([1, len(machine.joints)]))
        joints = [str(one) for one in rng.choice(machine.joints, count, replace=False)]
        changed = with_fault(made(machine, body, 0.2, 0.3, rng, number % 2 == 1), fault, joints)
        said = likely_joint_mend(machine, [changed])
        names = joints[0] if count == 1 else "every joint"
        if said is not None and SAID[fault].format(names) in said:
            right += 1
        elif said is None:
            other += 1
            print(f"{number} {body}: {fault} at {names}: nothing told", flush=True)
        else:
            wrong += 1
            print(f"{number} {body}: {fault} at {names}: {said}", flush=True)
    print(f"right records refused: {false} of {options.cases}")
    print(f"faults told: {right} of {options.cases}; nothing told: {other}; something else told: {wrong}")


if __name__ == "__main__":
    main()
