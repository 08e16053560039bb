"""What MJCF cannot express, in your own loop around MuJoCo's step.

model = mujoco.MjModel.from_xml_path("better.xml")      # rhythmid export better.yaml --to mujoco --out better.xml
data = mujoco.MjData(model)
while True:
    data.ctrl[:] = reference                            # one for each joint, as without rhythmid
    rhythmid.mujoco.apply(model, data)
    mujoco.mj_step(model, data)
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from rhythmid.body import soft_constraint
from rhythmid.body.body import Array, Joint
from rhythmid.body.embedded import paths_in
from rhythmid.body.live_source import ARRAYS, generate_live, numbers_of, rows_of
from rhythmid.body.path_source import COLUMNS, Layout
from rhythmid.body.robot_file import mujoco
from rhythmid.body.simulate import start_states, vector_of
from rhythmid.errors import InputError
from rhythmid.model import Model
from rhythmid.simulation.machine_code import load_run

BOUND = 1024  # runs that are kept at once; others are bound again at their next call


def apply(model: Any, data: Any, elements: tuple[str, ...] = ()) -> Array:
    """Put the forces of the joints' paths into `data`, before `mj_step`.

    From then on delays, lags, controllers, friction laws and all other elements of the command, actuator and force slots act as in
    `rhythmid simulate`. MuJoCo's own actuators, damping and dry friction of these joints are switched off, except for friction that is a constraint. `data.ctrl` holds the
    commands: a reference if the path has a controller, else a force. States and past signals are stored in `data.userdata`, so that a reset clears them.

    Parameters
    ----------
    model, data : MjModel of a file that `rhythmid export` or `--save-model` wrote, and its MjData. The model's time step is read at the
        first call.
    elements : files or folders with elements of your own that the paths have.

    Returns
    -------
    float64[joints], the positions [rad or m] that the joints' sensors measure now, with delays, without noise and rounding. The next
    call overwrites it.

    Raises
    ------
    InputError : the file holds no paths, lacks an actuator of theirs, or has too little `userdata` for its delays at this time step.
    """
    bound = _bound(model, data, elements)
    if bound.run(*bound.arguments):
        bound.begin(model, data)
        bound.run(*bound.arguments)
    return bound.output


@dataclass(frozen=True)
class _Bound:
    """The compiled step and the places of one run's arrays; `model` and `data` are not kept alive by anything else."""

    paths: dict[str, Model]
    joints: dict[str, Joint]
    control: list[int]
    layout: Layout
    run: Callable[..., int]
    arguments: tuple[Any, ...]
    output: Array

    def begin(self, model: Any, data: Any) -> None:
        """Steady states at this pose with this command."""
        states = start_states(
            self.paths, self.joints, self.layout, data.qpos, data.qvel, data.ctrl[self.control], np.zeros(len(self.paths))
        )  # fmt: skip
        data.userdata[:2] = 1.0, data.time
        data.userdata[2 : 2 + len(states)] = states
        rest(model, self.joints, self.control)
        soft_constraint.put(model, self.joints, self.paths)


def rest(model: Any, joints: dict[str, Joint], control: list[int]) -> None:
    """Switch off what the paths replace: dry friction and actuators; damping is set at each step."""
    model.dof_frictionloss[[one.velocity for one in joints.values()]] = 0.0
    model.actuator_gainprm[control] = 0.0
    model.actuator_biasprm[control] = 0.0


@lru_cache(maxsize=BOUND)
def _bound(model: Any, data: Any, elements: tuple[str, ...]) -> _Bound:
    paths = paths_in(model, elements)
    joints, control = {}, []
    for name in paths:
        one = model.joint(name)
        joints[name] = Joint(name, True, int(one.qposadr[0]), int(one.dofadr[0]))
        control.append(actuator_of(model, name))
    module, layout = generate_live(paths)
    step = float(model.opt.timestep)
    needed = numbers_of(layout, rows_of(paths, step))
    if len(data.userdata) < needed:
        raise InputError(
            f"delays at steps of {step:g} s need <size nuserdata={needed}> in the model's file, which has {len(data.userdata)}; "
            "export it again from a body with this step"
        )
    places = [[one.position for one in joints.values()], [one.velocity for one in joints.values()], control]
    named = (data.qpos, data.qvel, data.qfrc_applied, model.dof_damping, data.ctrl, data.userdata[:needed])
    arrays = np.array([[one.ctypes.data, len(one)] for one in named], dtype=np.int64)
    assert len(arrays) == len(ARRAYS)
    out = np.zeros((1, len(paths) * len(COLUMNS)))
    arguments = arrays, np.array(places, dtype=np.int64), vector_of(paths, layout), step, np.zeros((1, len(paths))), out  # fmt: skip
    seen = out[0, COLUMNS.index("output") :: len(COLUMNS)]
    return _Bound(paths, joints, control, layout, load_run(module), arguments, seen)


def actuator_of(model: Any, joint: str) -> int:
    """The first actuator of a joint, whose control is the path's command."""
    mj = mujoco()
    along = (model.actuator_trntype == mj.mjtTrn.mjTRN_JOINT) & (
        model.actuator_trnid[:, 0] == model.joint(joint).id
    )
    if not np.any(along):
        raise InputError(f"the model has no actuator at the joint {joint!r}")
    return int(np.flatnonzero(along)[0])
