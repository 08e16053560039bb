"""Speed of the simulation of a leg with elements along its joints, compared with MuJoCo's own loop in the same run.

    python benchmarks/leg_stepping.py [SECONDS]

A leg of three joints hops on the floor, at steps of 1 ms: controllers, a lag, dry friction and dampers along its joints in the compiled
loop; and the bare body, with the controller's force held, in a Python loop around `mj_step`. Then a user's own loop with the file that
`rhythmid export` writes, plain and with `rhythmid.mujoco.apply`: the leg, and a quadruped of twelve joints in the air. Prints times
real time, by CPU time.
"""

import sys
import tempfile
import time
from dataclasses import replace
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

import rhythmid
from rhythmid.body.machine import Machine
from rhythmid.body.mujoco_body import MujocoBody
from rhythmid.body.robot_file import mujoco
from rhythmid.body.simulate import run_steps
from rhythmid.body.write_back import save_machine
from rhythmid.elements.catalogue import load_catalogue
from rhythmid.simulation.signal import spline

MODELS = Path(str(files("rhythmid"))) / "models" / "legs"
STEP = 0.001  # [s]
REPEATS = 5  # runs, of which the fastest counts, because the computer may be shared


def leg() -> Machine:
    """The hopping leg with more elements along its joints."""
    machine = Machine.load(MODELS / "leg.yaml")
    body = MujocoBody.load(machine.body.path, "rail", STEP)
    catalogue = load_catalogue()
    machine = replace(machine, body=body)
    machine = machine.with_element("knee", catalogue["coulomb_friction"], {"force": 0.3, "transition": 0.02})
    return machine.with_element("hip", catalogue["actuator_lag"], {"time_constant": 0.005})


def compiled(machine: Machine, seconds: float) -> float:
    """CPU seconds of a run in the compiled loop."""
    time_of = np.arange(0.0, seconds, 0.01)
    wave = 0.35 * np.sin(2.0 * np.pi * 1.8 * time_of)
    command = {"hip": spline(time_of, 0.6 + wave), "knee": spline(time_of, -1.2 - 2.0 * wave)}
    worker = machine.body.worker()
    began = time.process_time()
    run_steps(machine, 0.0, round(seconds / STEP), command, worker=worker)
    return time.process_time() - began


def plain(machine: Machine, seconds: float) -> float:
    """CPU seconds of MuJoCo's own loop on the same body."""
    mj = mujoco()
    model, data = machine.body.worker()
    model.dof_damping[:] = 0.05
    data.qpos[:] = machine.body.reference
    began = time.process_time()
    for k in range(round(seconds / STEP)):
        wave = 0.35 * np.sin(2.0 * np.pi * 1.8 * k * STEP)
        data.qfrc_applied[1] = 60.0 * (0.6 + wave - data.qpos[1]) - 1.2 * data.qvel[1]
        data.qfrc_applied[2] = 60.0 * (-1.2 - 2.0 * wave - data.qpos[2]) - 1.2 * data.qvel[2]
        mj.mj_step(model, data)
    return time.process_time() - began


def exported(machine: Machine) -> Any:
    """The model of the file that is written of a machine."""
    with tempfile.TemporaryDirectory() as folder:
        save_machine(machine, Path(folder) / "machine.xml")
        model = mujoco().MjModel.from_xml_path(str(Path(folder) / "machine.xml"))
    model.opt.timestep = STEP
    return model


def users(machine: Machine, seconds: float, apply: bool) -> float:
    """CPU seconds of a user's loop with the controllers' references in `ctrl`."""
    mj = mujoco()
    model, reference = exported(machine), machine.body.reference
    data = mj.MjData(model)
    middle = np.array([reference[machine.body.joints[name].position] for name in machine.joints])
    asked = middle + 0.3 * np.sin(2.0 * np.pi * 1.8 * STEP * np.arange(round(seconds / STEP)))[:, None]
    if apply:
        rhythmid.mujoco.apply(model, data)  # compiles
        mj.mj_resetData(model, data)
    data.qpos[:] = reference
    began = time.process_time()
    for command in asked:
        data.ctrl[:] = command
        if apply:
            rhythmid.mujoco.apply(model, data)
        mj.mj_step(model, data)
    return time.process_time() - began


def main() -> None:
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else 20.0
    machine = leg()
    compiled(machine, 0.1)  # compiles
    ours = min(compiled(machine, seconds) for _ in range(REPEATS))
    theirs = min(plain(machine, seconds) for _ in range(REPEATS))
    print(f"elements in the compiled loop: {seconds / ours:.0f} x real time")
    print(f"MuJoCo's own loop in Python:   {seconds / theirs:.0f} x real time")
    for name, one in (("leg", machine), ("quadruped", Machine.load(MODELS / "quadruped.yaml"))):
        plainly, applied = (min(users(one, seconds, how) for _ in range(REPEATS)) for how in (False, True))
        print(
            f"user's loop, {name}: {seconds / plainly:.0f} x real time plain, {seconds / applied:.0f} x with the paths applied, "
            f"{100.0 * plainly / applied:.0f} % of the speed"
        )


if __name__ == "__main__":
    main()
