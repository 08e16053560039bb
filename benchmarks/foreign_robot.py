"""A foreign robot over real topics: MuJoCo simulates it, an effect is concealed in it, and the diagnosis names the effect.

    python benchmarks/foreign_robot.py record BAG [friction:=1.5 ...]            # plays and records, 20 s in real time
    rhythmid diagnose BAG --signals tests/robots/signals.yaml --model tests/robots/nominal.yaml

    python benchmarks/foreign_robot.py campaign --effect nothing --runs 20       # how often the verdict is right

The robot is tests/robots/mujoco_lift.py; its parameters can be concealed. The campaign prints each verdict, and
whether the true values are within the 95 % intervals. The true delay is the time from the sending of a command to
its action, as reported by the robot.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import yaml

from rhythmid.diagnose.diagnosis import diagnose
from rhythmid.elements.catalogue import Catalogue
from rhythmid.model import Model
from rhythmid.record.bag import Bag
from rhythmid.record.read import read_record
from rhythmid.record.signals import Signals
from rhythmid.statistics import NORMAL_95

ROBOT = Path(__file__).parents[1] / "tests" / "robots"
READY_WITHIN = 180.0  # seconds for start and discovery on a busy computer, in addition to the record


@dataclass(frozen=True)
class Effect:
    """What is concealed: the robot's parameters, the elements that would be right, and of these the true values."""

    parameters: Mapping[str, float]
    names: tuple[str, ...] = ()
    truth: Mapping[str, float] = field(default_factory=dict)


EFFECTS = {
    "nothing": Effect({}),
    "delay": Effect({"delay": 0.012}),
    "friction": Effect({"friction": 1.5}, ("coulomb_friction",), {"force": 1.5}),
    "filter": Effect({"filter": 0.02}, ("command_lag",), {"time_constant": 0.02}),
    "floor": Effect(
        {"floor_stiffness": 3000.0}, ("end_stop_contact",), {"stiffness": 3000.0, "position": -0.045}
    ),
}


def excitation(length: float, seed: int) -> dict[str, Any]:
    """A chirp and a multisine of so many seconds each."""
    return {
        "type": "sequence",
        "parts": [
            {"type": "chirp", "amplitude": 8.0, "band": [0.3, 8.0], "sweep": length},
            {"type": "multisine", "rms": 6.0, "period": length / 2, "periods": 2, "band": [0.3, 9.0], "seed": seed},
        ],
    }  # fmt: skip


def record(
    bag: Path,
    given: Mapping[str, Any],
    length: float = 8.0,
    command_type: str = "Float64MultiArray",
    seed: int = 0,
) -> np.ndarray:
    """Play and record the robot with the parameters `given`; the times [ns] at which its commands acted."""
    from rhythmid_bringup.environment import own_domain, run_environment
    from rhythmid_bringup.processes import Supervised, end

    with TemporaryDirectory() as folder, own_domain() as domain:
        log = Path(folder) / "acted.npy"
        parameters = {
            "robot": {"command_type": command_type, "seed": seed, "log": str(log), **given},
            "recorder": {"path": str(bag), "topics": ["commands", "joint_states", "pump", "run"]},
            "excitation": {
                "joint": "lift", "command_type": command_type, "command_topic": "commands",
                "command_joints": ["wheel", "lift"], "excitation": json.dumps(excitation(length, seed)),
                "max_effort": 30.0, "ramp": 0.2, "stale_after": 10.0, "envelope": [-0.3, 0.3], "subscribers": 2,
                "unattended": True,
            },
        }  # fmt: skip
        programs = {
            "robot": [str(ROBOT / "mujoco_lift.py")],
            "recorder": ["-m", "rhythmid_nodes.recorder"],
            "excitation": ["-m", "rhythmid_nodes.excitation"],
        }
        environment = run_environment(os.environ, domain, Path(folder))
        running: dict[str, Supervised] = {}
        said: list[str] = []
        try:
            for name, program in programs.items():
                file = Path(folder) / f"{name}.yaml"
                file.write_text(
                    yaml.safe_dump({"/**": {"ros__parameters": parameters[name]}}), encoding="utf-8"
                )
                line = [
                    sys.executable,
                    *program,
                    "--ros-args",
                    "-r",
                    "__ns:=/lift",
                    "--params-file",
                    str(file),
                ]
                running[name] = Supervised(
                    name, line, environment, lambda who, what: said.append(f"{who}: {what}")
                )
                running[name].hurry()
            patience = time.monotonic() + 2.0 * length + READY_WITHIN
            while running["excitation"].returncode is None and time.monotonic() < patience:
                time.sleep(0.05)
            failed = running["excitation"].returncode != 0
        finally:
            end([running[name] for name in ("recorder", "robot") if name in running])
            end(list(running.values()))
        if failed or not log.exists():
            raise RuntimeError(f"the robot was not recorded: {'; '.join(said) or 'nobody says why'}")
        return np.load(log)


def answer(
    bag: Path, command_type: str = "Float64MultiArray", catalogue: Catalogue | None = None
) -> dict[str, Any]:
    """The diagnosis of a bag, as JSON has it, with the laws of a catalogue."""
    record = read_record(bag, signals(command_type))
    return diagnose([record], Model.load(ROBOT / "nominal.yaml"), (), catalogue).diagnosis.to_dict()


def signals(command_type: str) -> Signals:
    """The signals file for commands of this type."""
    text = (ROBOT / "signals.yaml").read_text(encoding="utf-8")
    field = {"Float64MultiArray": "data[1]", "Float64": "data", "JointState": "effort[lift]"}[command_type]
    return Signals.from_text(text.replace("data[1]", field))


def true_delay(bag: Path, acted: np.ndarray) -> float:
    """Mean time [s] from when a command was sent to when it acted."""
    blocks = Bag(bag).blocks(lambda topic: topic.name == "/lift/commands")
    sent = np.concatenate([block.sent_ns for block in blocks if block.sent_ns is not None])
    count = min(len(sent), len(acted))
    return float(np.mean(acted[:count] - sent[:count])) * 1e-9


def judge(effect: Effect, found: Mapping[str, Any], delay: float, sigmas: float) -> list[str]:
    """Errors of an answer, one phrase each; empty for a right answer. Values may differ by so many standard deviations."""
    wanted = "missing_physics" if effect.names else "consistent"
    wrong = [] if found["verdict"] == wanted else [f"verdict {found['verdict']} instead of {wanted}"]
    named = {one["element"]: one["parameters"] for one in found["missing"]}
    for name in effect.names:
        if name not in named:
            wrong.append(f"{name} is not named, but {', '.join(named) or 'nothing'}")
            continue
        for key, true in effect.truth.items():
            value, std = named[name][key]["value"], named[name][key]["std"]
            if abs(value - true) > sigmas * std:
                wrong.append(f"{key} {value:.6g} ± {std:.2g}, true {true:g}")
    value, std = found["delays"]["input"]["value"], found["delays"]["input"]["std"]
    if abs(value - delay) > sigmas * std:
        wrong.append(f"input delay {1e3 * value:.4f} ± {1e3 * std:.2g} ms, true {1e3 * delay:.4f} ms")
    return wrong


def campaign(name: str, runs: int, length: float, keep: Path | None) -> int:
    """Record and diagnose so many times; the number of wrong verdicts. The bags stay in `keep`, where that is given."""
    right = covered = 0
    for seed in range(runs):
        with TemporaryDirectory() as folder:
            bag = Path(folder) / "bag" if keep is None else keep / f"{name}-{seed}"
            acted = record(bag, EFFECTS[name].parameters, length, seed=seed)
            began = time.monotonic()
            found, delay = answer(bag), true_delay(bag, acted)
            wrong = judge(EFFECTS[name], found, delay, NORMAL_95)
        named_right = not any(phrase.startswith("verdict") or "not named" in phrase for phrase in wrong)
        right, covered = right + named_right, covered + (not wrong)
        told = "; ".join(wrong) or "right"
        print(f"{name} {seed}: {told} ({time.monotonic() - began:.0f} s)", flush=True)
    print(f"{name}: {right} of {runs} verdicts right, {covered} with all true values in their 95 % intervals")
    return runs - right


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    commands = parser.add_subparsers(required=True, dest="what")
    one = commands.add_parser("record", help="record the robot once")
    one.add_argument("bag", type=Path)
    one.add_argument("parameters", nargs="*", metavar="NAME:=VALUE", help="of the robot")
    many = commands.add_parser("campaign", help="record and diagnose many times")
    many.add_argument("--effect", choices=EFFECTS, default="nothing")
    many.add_argument("--runs", type=int, default=20)
    many.add_argument("--keep", type=Path, metavar="FOLDER", help="of the bags, which are deleted else")
    for command in (one, many):
        command.add_argument("--length", type=float, default=8.0, help="of each of two excitations [s]")
    given = parser.parse_args()
    if given.what == "campaign":
        sys.exit(int(campaign(given.effect, given.runs, given.length, given.keep) > 0))
    pairs = (pair.split(":=") for pair in given.parameters)
    record(given.bag.absolute(), {name: float(value) for name, value in pairs}, given.length)
    print(f"bag: {given.bag}")


if __name__ == "__main__":
    main()
