"""A loop around MuJoCo's step, with a model as it was and as it was identified, against a recording.

    rhythmid export leg.yaml --to mujoco --out before.xml
    rhythmid diagnose bag --model leg.yaml --signals signals.yaml --save-model after.xml
    python mujoco_loop.py before.xml after.xml bag signals.yaml

The loop is the usual one; `rhythmid.mujoco.apply` is its only new line.
"""

# pyright: reportAttributeAccessIssue=false
# (MuJoCo's module has no types)

import sys

import mujoco
import numpy as np

import rhythmid
from rhythmid.record.joint_record import JointRecord, load_joint_records
from rhythmid.record.record import Channel

SECONDS = 2.0  # of the recording: further on, small errors of a hopping machine have become large


def positions(path: str, record: JointRecord, apply: bool) -> tuple[np.ndarray, np.ndarray]:
    """Times (n,) and simulated positions (n, joints) along a recording, from its first pose."""
    model = mujoco.MjModel.from_xml_path(path)
    data = mujoco.MjData(model)
    step, begin = model.opt.timestep, record.span[0]
    places = [int(model.joint(name).qposadr[0]) for name in record.joints]
    controls = [model.actuator(name).id for name in record.joints]
    data.qpos[places] = [one.output.value[0] for one in record.joints.values()]
    times = begin + step * np.arange(round(SECONDS / step))
    asked = np.column_stack([np.interp(times, *series(one.input)) for one in record.joints.values()])
    found = np.empty((len(times), len(places)))
    for k, command in enumerate(asked):
        data.ctrl[controls] = command
        if apply:
            rhythmid.mujoco.apply(model, data)
        found[k] = data.qpos[places]
        mujoco.mj_step(model, data)
    return times, found


def series(channel: Channel | None) -> tuple[np.ndarray, np.ndarray]:
    """Times and values of a channel that was recorded."""
    assert channel is not None
    return channel.time, channel.value


def main() -> None:
    before, after, bag, signals = sys.argv[1:]
    (record,) = load_joint_records([bag], signals)
    for name, path, apply in (("before", before, False), ("after", after, True)):
        times, found = positions(path, record, apply)
        for place, (joint, one) in enumerate(record.joints.items()):
            measured = np.interp(times, *series(one.output))
            error = np.std(found[:, place] - measured) / np.std(measured)
            print(f"{name}, {joint}: {100.0 * error:.2g} % of the motion")


if __name__ == "__main__":
    main()
