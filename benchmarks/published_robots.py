"""Effects concealed in robots whose URDF files others have published, simulated by MuJoCo alone.

    pip install example-robot-data
    python benchmarks/published_robots.py [--cases 24] [--seed 1] [--robots ur5_robot,solo12] [--folder DIR]

A robot follows references under its controllers in a separate loop, at steps of 1 ms and with MuJoCo's own dry friction and springs. Its log is a CSV
file of references, positions and efforts at 500 Hz with an encoder's noise and 1 % of noise on the effort. From there on the tool is used as on the
command line: `init --body` with the file as published, then `diagnose`.
"""

from __future__ import annotations

import argparse
import importlib
import sysconfig
import tempfile
import time as clock
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from legs import family, wilson

from rhythmid.body.machine import Machine
from rhythmid.diagnose.joints.joint_diagnosis import diagnose_machine
from rhythmid.elements.catalogue import load_catalogue
from rhythmid.errors import InputError
from rhythmid.record.joint_record import load_joint_records
from rhythmid.start.robot import start_robot

mujoco: Any = importlib.import_module("mujoco")  # incomplete type hints
ROBOTS = (
    "ur3_robot", "ur5_robot", "ur10_robot", "xarm7", "kinova", "z1", "so100", "so101", "solo12", "a1", "go1", "go2", "laikago", "bolt",
    "talos_left_arm", "TwoDofs", "finger_edu", "hyq_no_sensors",
)  # fmt: skip
EFFECTS = {"none": None, "friction": "coulomb_friction", "spring": "linear_spring", "mass": "link_mass"}
STEP, EVERY = 1e-3, 2  # s; steps in a sample
LASTS, HELD_OUT = 20.0, 10.0  # s
BANDWIDTH, DAMPING = 3.0, 0.9  # Hz and damping ratio of the controllers
FASTEST = 2.5  # Hz, of the references
ENCODER, TORQUE = 2e-5, 0.01  # rad; share of the effort's standard deviation


@dataclass(frozen=True)
class Case:
    """A case: the concealed effect, its joint, and the answer."""

    robot: str
    joint: str
    effect: str
    named: tuple[tuple[str, str], ...]
    open: tuple[str, ...]
    joints: int
    seconds: float

    @property
    def right(self) -> bool:
        """Whether the concealed effect, or its family, is named at its joint; or whether nothing is named if nothing is concealed."""
        wanted = EFFECTS[self.effect]
        if wanted is None:
            return not self.named and not self.open
        return any(
            joint == self.joint and family(name) in (family(wanted), wanted) for joint, name in self.named
        )

    @property
    def false(self) -> int:
        """Other joints at which something is named."""
        return len({joint for joint, _ in self.named if joint != self.joint or self.effect == "none"})


def plant(path: Path) -> Any:
    """The robot as MuJoCo compiles it without its shapes, with a fixed base, rotors of a twentieth of the joints' inertia, and a little damping."""
    spec = mujoco.MjSpec.from_file(str(path))
    for shape in [one for one in spec.geoms if one.type == mujoco.mjtGeom.mjGEOM_MESH]:
        spec.delete(shape)
    for mesh in list(spec.meshes):
        spec.delete(mesh)
    spec.compiler.boundmass, spec.compiler.boundinertia, spec.compiler.balanceinertia = 1e-10, 1e-12, True
    model = spec.compile()
    model.opt.timestep = STEP
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    return model


def inertias(model: Any, middle: np.ndarray, span: np.ndarray) -> np.ndarray:
    """The largest inertia at each joint over twenty poses."""
    data, rng = mujoco.MjData(model), np.random.default_rng(0)
    whole, found = np.zeros((model.nv, model.nv)), np.zeros(model.nv)
    for _ in range(20):
        data.qpos[:] = middle + span * rng.uniform(-1.0, 1.0, model.nq)
        mujoco.mj_forward(model, data)
        mujoco.mj_fullM(model, data, whole)
        found = np.maximum(found, np.diag(whole))
    return found


def log(
    model: Any,
    inertia: np.ndarray,
    middle: np.ndarray,
    span: np.ndarray,
    lasts: float,
    rng: np.random.Generator,
) -> np.ndarray:
    """Rows of time, references, positions and efforts under the controllers, which compensate the robot's weight."""
    data = mujoco.MjData(model)
    data.qpos[:] = middle
    time = STEP * np.arange(round(lasts / STEP))
    lines = np.arange(1, int(FASTEST * lasts)) / lasts
    asked = np.empty((len(time), model.nq))
    for joint in range(model.nq):
        own = lines[joint % len(lines) :: model.nq]
        phases = rng.uniform(0.0, 2.0 * np.pi, len(own))
        wave = (np.cos(2.0 * np.pi * np.outer(time, own) + phases) / np.maximum(own, 0.5)).sum(axis=1)
        asked[:, joint] = middle[joint] + span[joint] * wave / np.abs(wave).max() * np.minimum(1.0, time)
    natural = 2.0 * np.pi * BANDWIDTH
    gain, rate = inertia * natural**2, 2.0 * DAMPING * inertia * natural
    rows, total = [], np.zeros(model.nv)
    for step, wanted in enumerate(asked):
        if step % EVERY == 0:
            rows.append(np.concatenate([[time[step]], wanted, data.qpos, total / EVERY]))
            total = np.zeros(model.nv)
        effort = gain * (wanted - data.qpos) - rate * data.qvel + data.qfrc_bias
        total += effort
        data.qfrc_applied[:] = effort
        mujoco.mj_step(model, data)
    made = np.array(rows)
    efforts = made[:, 1 + 2 * model.nq :]
    made[:, 1 + model.nq : 1 + 2 * model.nq] += ENCODER * rng.standard_normal((len(made), model.nq))
    efforts += TORQUE * np.std(efforts, axis=0) * rng.standard_normal(efforts.shape)
    return made


def conceal(
    model: Any, effect: str, joint: int, inertia: np.ndarray, middle: np.ndarray, weight: float
) -> None:
    """Put an effect of a third of the joint's usual effort into the robot."""
    size = 0.3 * (0.3 * inertia[joint] * (2.0 * np.pi) ** 2 + 0.3 * weight)
    if effect == "friction":
        model.dof_frictionloss[joint] = size
    elif effect == "spring":
        model.jnt_stiffness[joint], model.qpos_spring[joint] = size / 0.3, middle[joint]
    elif effect == "mass":
        link = int(model.jnt_bodyid[joint])
        model.body_mass[link] *= 1.5
        model.body_inertia[link] *= 1.5
        mujoco.mj_setConst(model, mujoco.MjData(model))


def run(number: int, seed: int, robots: Mapping[str, Path]) -> Case:
    """One case: the robots in turn, joint and effect drawn."""
    rng = np.random.default_rng([seed, number])
    name = list(robots)[number % len(robots)]
    model = plant(robots[name])
    names = [model.joint(place).name for place in range(model.njnt)]
    limited = model.jnt_limited.astype(bool)
    middle = np.where(limited, model.jnt_range.mean(axis=1), 0.0)
    span = np.minimum(np.where(limited, 0.175 * np.ptp(model.jnt_range, axis=1), 0.6), 0.6)
    inertia = inertias(model, middle, span)
    model.dof_armature[:] = 0.05 * inertia + 1e-4
    inertia = inertia + model.dof_armature
    model.dof_damping[:], model.dof_frictionloss[:] = 0.3 * np.sqrt(inertia), 0.0
    data = mujoco.MjData(model)
    data.qpos[:] = middle
    mujoco.mj_forward(model, data)
    joint, effect = int(rng.integers(model.njnt)), str(rng.choice(list(EFFECTS)))
    conceal(model, effect, joint, inertia, middle, float(abs(data.qfrc_bias[joint])))
    heads = ",".join(["t", *(f"{kind}_{one}" for kind in ("ref", "q", "tau") for one in names)])
    with tempfile.TemporaryDirectory() as folder:
        logs = []
        for which, lasts in (("run", LASTS), ("held_out", HELD_OUT)):
            logs.append(Path(folder) / f"{which}.csv")
            rows = log(model, inertia, middle, span, lasts, rng)
            np.savetxt(logs[-1], rows, delimiter=",", header=heads, comments="", fmt="%.9g")
        began = clock.process_time()
        catalogue = load_catalogue()
        begun = start_robot(logs[:1], robots[name], Path(folder), None, catalogue)
        (Path(folder) / "signals.yaml").write_text(begun.signals)
        (Path(folder) / "model.yaml").write_text(begun.model)
        machine = Machine.load(Path(folder) / "model.yaml", catalogue)
        learn, judge = (load_joint_records([one], Path(folder) / "signals.yaml") for one in logs)
        answer = diagnose_machine(learn, machine, judge, catalogue).diagnosis
    named = tuple((one.place, one.element) for one in answer.missing)
    return Case(
        name, names[joint], effect, named, (*answer.unknown, *answer.undecided), model.njnt, clock.process_time() - began
    )  # fmt: skip


def told(cases: Sequence[Case]) -> None:
    """Print the counts."""
    nulls = [one for one in cases if one.effect == "none"]
    real = [one for one in cases if one.effect != "none"]
    others = sum(one.joints - (one.effect != "none") for one in cases)
    print(f"effect named at its joint: {wilson(sum(one.right for one in real), len(real))}")
    print(f"nothing concealed, nothing named or open: {wilson(sum(one.right for one in nulls), len(nulls))}")
    print(f"other joints falsely named: {wilson(sum(one.false for one in cases), others)}")
    print(f"seconds of processor time a case: median {np.median([one.seconds for one in cases]):.0f}")


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--cases", type=int, default=24)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--robots", default=",".join(ROBOTS))
    parser.add_argument(
        "--folder",
        type=Path,
        default=Path(sysconfig.get_path("purelib")) / "cmeel.prefix/share/example-robot-data/robots",
    )
    given = parser.parse_args()
    files = {path.stem: path for path in given.folder.rglob("*.urdf")}
    robots = {name: files[name] for name in given.robots.split(",") if name in files}
    if not robots:
        parser.error(f"no such robot below {given.folder}; pip install example-robot-data, or give --folder")
    cases: list[Case] = []
    for number in range(given.cases):
        try:
            cases.append(run(number, given.seed, robots))
        except InputError as error:
            print(f"{number}: {error}", flush=True)
            continue
        one = cases[-1]
        said = "; ".join(f"{joint}: {name}" for joint, name in one.named) or f"open: {one.open}"
        mark = "" if one.right and not one.false else " *"
        print(
            f"{number} {one.robot} {one.joint}: {one.effect} -> {said} ({one.seconds:.0f} s){mark}",
            flush=True,
        )
    told(cases)


if __name__ == "__main__":
    main()
