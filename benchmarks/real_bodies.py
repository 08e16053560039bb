"""The DFKI pendulum and the XL330 servo as bodies of one hinge, diagnosed as machines of several joints are.

    python benchmarks/real_bodies.py [--only pendulum,xl330]

The same recordings, windows and known values as the one-axis cases of real_recordings.py: weight and inertia come from an MJCF file instead of
`pendulum_gravity` and `inertia`, mass and rotor are free. Printed for each: verdict, names with probability, the errors of the effort on held-out records
of the refitted nominal and of the augmented model in % of the effort, and the mass and rotor that were fitted. docs/real.md says where the recordings are searched.
"""

import argparse
import math
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from bench_case import write_table
from recording_sets import (
    PENDULUM_FILES,
    UNTOUCHED,
    XL330_HELD_OUT,
    data_folder,
    torque_span,
    xl330_log,
)

from rhythmid.body.machine import Machine
from rhythmid.diagnose.joints.joint_diagnosis import MachineAnswer, diagnose_machine
from rhythmid.record.joint_record import JointRecord, JointSignals, read_joint_record

# a point mass on a rod without weight, hanging where the angle is 0; MuJoCo wants a link's own inertia, which is small here
HINGE = """<mujoco>
  <option gravity="0 0 -9.81" timestep="0.001"/>
  <worldbody>
    <body name="rod">
      <joint name="shoulder" type="hinge" axis="0 1 0" armature="{armature}"/>
      <inertial pos="0 0 {down}" mass="{mass}" diaginertia="1e-6 1e-6 1e-6"/>
    </body>
  </worldbody>
</mujoco>
"""
MODEL = """
body: {{mjcf: {name}.xml, step: 0.001, contacts: false, free: {{rod.mass: {{prior: {{mean: {mass}, std: {spread}}}}}, shoulder.armature: {{}}}}}}
joints: {{shoulder: {{force: [{force}]}}}}
"""
# 0.6755 kg at 0.5 m are the values in the owners' own controller files; a rotor of a hundredth of that
PENDULUM = {"armature": 0.001, "down": -0.5, "mass": 0.6755}
# in volts, that is, torques divided by kt/R: a weight of 5 V, which a mass of 5.1 at 0.1 m has, and an inertia of 0.07 V s^2 in all
XL330 = {"armature": 0.019, "down": -0.1, "mass": 5.097}
XL330_DAMPING = "viscous_damper: {damping: {value: 0.4, unit: N*m*s/rad}}"
MASS_SPREAD = 0.3  # of a mass: as wide as the inertia's in the one-axis cases


@dataclass(frozen=True)
class BodyCase:
    """A body and its records, for the fit and held out."""

    name: str
    machine: Machine
    train: tuple[JointRecord, ...]
    holdout: tuple[JointRecord, ...]


def body_of(folder: Path, name: str, sizes: dict[str, float], force: str = "") -> Machine:
    """The hinge with these sizes, its files written to a folder."""
    (folder / f"{name}.xml").write_text(HINGE.format(**sizes))
    spread = MASS_SPREAD * sizes["mass"]
    text = MODEL.format(name=name, mass=sizes["mass"], spread=spread, force=f"{{{force}}}" if force else "")
    (folder / f"{name}.yaml").write_text(text)
    return Machine.load(folder / f"{name}.yaml")


def record_of(
    folder: Path, table: Path, channels: Sequence[str], use: tuple[float, float] | None
) -> JointRecord:
    """A table's record between two times [s]."""
    text = "\n".join(["joints: [shoulder]", *channels])
    if use is not None:
        text += f"\nuse: [{use[0]}, {use[1]}]"
    return read_joint_record(table, JointSignals.from_text(text, folder / "signals.yaml"))


def pendulum(data: Path, folder: Path) -> BodyCase:
    """The windows of the pendulum that no hand disturbs, the last of them held out."""
    channels = [
        "time: {column: time}",
        "effort: {column: torque, unit: N*m, taken: after_actuator}",
        "output: {column: position, unit: rad}",
    ]
    records = {
        name: record_of(folder, data / PENDULUM_FILES[file], channels, use)
        for name, (file, use) in UNTOUCHED.items()
    }
    machine = body_of(folder, "pendulum", PENDULUM)
    return BodyCase("pendulum", machine, (records["swing_up1"], records["decay"]), (records["whirl"],))


def xl330(data: Path, folder: Path) -> BodyCase:
    """Three trajectories of the servo for the fit at each gain, one held out."""
    channels = [
        "time: {column: t}",
        "effort: {column: volts, unit: N*m, taken: after_actuator}",
        "output: {column: position, unit: rad}",
    ]
    train: list[JointRecord] = []
    holdout: list[JointRecord] = []
    for path in sorted(data.glob("*.json.gz")):
        told, columns = xl330_log(path)
        span = torque_span(columns)
        use = None if math.isclose(span[1], columns["t"][-1]) else (span[0], span[1] - 0.01)
        name = f"xl330_{told['kp']}_{told['trajectory']}"
        record = record_of(folder, write_table(folder / f"{name}.csv", columns), channels, use)
        (holdout if told["trajectory"] == XL330_HELD_OUT else train).append(record)
    machine = body_of(folder, "xl330", XL330, XL330_DAMPING)
    return BodyCase("xl330", machine, tuple(train), tuple(holdout))


SETS = {"pendulum": pendulum, "xl330": xl330}


def row_of(case: BodyCase, answer: MachineAnswer) -> str:
    """The answer as a row of docs/real.md."""
    found = answer.diagnosis
    one = found.joints["shoulder"]
    names = [f"{effect.element} {effect.probability:.2f}" for effect in found.missing]
    names += [
        f"({effect.element} {effect.probability:.2f})" for effect in one.missing if not found.missing
    ]  # first, not stated
    before, after = (one.fit[name].heldout_nrmse for name in ("refitted_nominal", "augmented"))
    body = answer.machine.body.parameters
    return (
        f"| {case.name} | {len(case.train)}+{len(case.holdout)} | {found.verdict} | {', '.join(names) or '-'} | "
        f"{100.0 * (before or 0.0):.3g} → {100.0 * (after or 0.0):.3g} | {body['rod.mass']:.4g} | {body['shoulder.armature']:.3g} |"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", default=",".join(SETS))
    given = parser.parse_args()
    print("| set | records | verdict | names | held out, % of the effort | mass | rotor |")
    for name in given.only.split(","):
        if not (data_folder() / name).is_dir():
            print(f"{name}: no recordings in {data_folder()}", file=sys.stderr)
            continue
        with tempfile.TemporaryDirectory(prefix="bodies_") as folder:
            case = SETS[name](data_folder() / name, Path(folder))
            answer = diagnose_machine(case.train, case.machine, case.holdout)
            print(row_of(case, answer), flush=True)


if __name__ == "__main__":
    main()
