"""A body that an MJCF or URDF file describes and MuJoCo integrates.

E. Todorov, T. Erez, Y. Tassa, MuJoCo: a physics engine for model-based control, IROS 2012.
"""

import copy
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rhythmid.body.body import Array, Body, Joint, Passive
from rhythmid.body.robot_file import FIXED, FREE, LEAST_MASS, mujoco, read_robot, refused, warnings_told
from rhythmid.errors import InputError

HEAVIEST = 1e6  # [kg] a link with a larger mass is a mistake
WEIGHTLESS = 1e-10  # [kg] links that weigh less together have no mass but `LEAST_MASS` each


@dataclass(frozen=True, eq=False)
class MujocoBody(Body):
    """A compiled file. `model` belongs to it alone and is never changed: those who run it take a copy, see `worker`."""

    path: Path
    model: Any
    joints: Mapping[str, Joint]
    step: float
    base: str = FIXED
    contacts: bool = True
    passive: Mapping[str, Passive] = field(default_factory=dict)
    given: Mapping[str, float] = field(default_factory=dict)
    notes: tuple[str, ...] = ()  # in words, what of the file was left out or changed
    hold: Mapping[str, float] = field(default_factory=dict)  # positions of the file's joints that are held

    @classmethod
    def load(
        cls,
        path: str | Path,
        base: str = FIXED,
        step: float | None = None,
        contacts: bool = True,
        hold: Mapping[str, float] | None = None,
    ) -> "MujocoBody":
        """The body in a file, some of its joints held fast. Raises InputError where MuJoCo refuses the file, or `base` is no joint of it.

        The file's viscous damping and dry friction of joints are taken out of it, see `passive`; its actuators are switched off.
        """
        mj, path = mujoco(), Path(path)
        robot = read_robot(path, base, contacts, hold)
        with warnings_told() as told:
            try:
                model = robot.spec.compile()
            except (ValueError, mj.FatalError) as error:
                raise refused(path, error) from None
        joints, passive = _joints(model, path), _passive(model)
        if base not in (FIXED, FREE, *joints):
            raise InputError(f"{path}: base: {base!r} is neither fixed, free nor a joint; {_listed(joints)}")
        if base == FREE and model.nq == model.nv:
            raise InputError(f"{path}: base: free, but the file has no free joint")
        weightless = [
            model.body(i).name
            for i in range(1, model.nbody)
            if model.body_jntnum[i] > 0 and model.body_subtreemass[i] < WEIGHTLESS
        ]
        if weightless:
            raise InputError(f"{path}: the link {weightless[0]!r} moves but has no mass")
        model.dof_damping[:] = 0.0
        model.dof_frictionloss[:] = 0.0
        model.opt.timestep = model.opt.timestep if step is None else step
        model.opt.integrator = mj.mjtIntegrator.mjINT_EULER
        off = mj.mjtDisableBit.mjDSBL_ACTUATION | mj.mjtDisableBit.mjDSBL_AUTORESET
        off = off if contacts else off | mj.mjtDisableBit.mjDSBL_CONTACT
        model.opt.disableflags |= int(off)
        return cls(
            path,
            model,
            joints,
            float(model.opt.timestep),
            base,
            contacts,
            passive,
            notes=(*robot.notes, *told),
            hold=hold or {},
        )

    def with_losses(self, joints: Iterable[str]) -> "MujocoBody":
        """A copy in which these joints, which have no path, lose again what the file says: a rail on which the base slides."""
        model = copy.copy(self.model)
        for name in joints:
            dof, known = self.joints[name].velocity, self.passive[name]
            model.dof_damping[dof], model.dof_frictionloss[dof] = known.damping, known.friction
        return replace(self, model=model)

    def worker(self) -> tuple[Any, Any]:
        """A model and the data of a run, for one thread."""
        model = copy.copy(self.model)
        return model, mujoco().MjData(model)

    def joint(self, name: str) -> Joint:
        """A joint by name. Raises InputError for an unknown one."""
        if name not in self.joints:
            raise InputError(f"{self.path}: has no joint {name!r}; {_listed(self.joints)}")
        return self.joints[name]

    @cached_property
    def links(self) -> dict[str, int]:
        """Numbers of the links that move, by name."""
        return {
            self.model.body(i).name: i
            for i in range(1, self.model.nbody)
            if self.model.body_weldid[i] != 0 and self.model.body_mass[i] > LEAST_MASS
        }

    def joint_of(self, link: str) -> str:
        """The joint that moves a link: its own, or the nearest one between it and the world."""
        number = self.links[link]
        while number:
            first, count = int(self.model.body_jntadr[number]), int(self.model.body_jntnum[number])
            if count:
                return str(self.model.joint(first + count - 1).name)
            number = int(self.model.body_parentid[number])
        raise InputError(f"{self.path}: the link {link!r} does not move")

    @property
    def parameters(self) -> dict[str, float]:
        masses = {f"{name}.mass": float(self.model.body_mass[i]) for name, i in self.links.items()}
        armatures = {
            f"{name}.armature": float(self.model.dof_armature[one.velocity])
            for name, one in self.joints.items()
        }
        return masses | armatures

    def with_parameters(self, values: Mapping[str, float]) -> "MujocoBody":
        mj, model = mujoco(), copy.copy(self.model)
        known = self.parameters
        for name, value in values.items():
            if name not in known:
                raise InputError(f"{self.path}: has no parameter {name!r}; it has {', '.join(known)}")
            owner, _, kind = name.rpartition(".")
            if kind == "armature":
                model.dof_armature[self.joints[owner].velocity] = value
            elif not 0.0 < value < HEAVIEST:
                raise InputError(f"the mass of link {owner!r} must be greater than 0, not {value:g}")
            else:
                share = value / known[name]
                model.body_mass[self.links[owner]] *= share
                model.body_inertia[self.links[owner]] *= share
        mj.mj_setConst(model, mj.MjData(model))
        return replace(self, model=model, given={**self.given, **values})

    def inverse(self, position: Array, velocity: Array, acceleration: Array) -> Array:
        model, data = self.worker()
        return self._along(model, data, position, velocity, acceleration)

    def columns(self, names: list[str], position: Array, velocity: Array, acceleration: Array) -> Array:
        made = np.zeros((len(position), self.model.nv, len(names)))
        for place, name in enumerate(names):
            owner, _, kind = name.rpartition(".")
            if kind == "armature":
                dof = self.joints[owner].velocity
                made[:, dof, place] = acceleration[:, dof]
                continue
            made[:, :, place] = self._alone(self.links[owner], position, velocity, acceleration)
            made[:, :, place] /= self.parameters[name]
        return made

    def _alone(self, link: int, position: Array, velocity: Array, acceleration: Array) -> Array:
        """Forces (n, nv) for the inertia and weight of one link alone."""
        model = self.model
        place = model.body_ipos[link], model.body_iquat[link]
        inertia = float(model.body_mass[link]), model.body_inertia[link]
        return self._of_one(link, *inertia, *place, (position, velocity, acceleration))

    def _of_one(
        self, link: int, mass: float, inertia: Any, centre: Any, turn: Any, motion: tuple[Array, Array, Array]
    ) -> Array:
        """Forces (n, nv) for one link of this mass, principal moments of inertia, centre and axes, the others without any."""
        model, data = self.worker()
        for one in (model.body_mass, model.body_inertia, model.jnt_stiffness, model.dof_damping):
            one[:] = 0.0
        model.dof_armature[:] = 1.0  # MuJoCo factors the inertia matrix in any case
        model.body_mass[link], model.body_inertia[link] = mass, inertia
        model.body_ipos[link], model.body_iquat[link] = centre, turn
        return self._along(model, data, *motion) - motion[2]

    def inertial_columns(self, link: str, position: Array, velocity: Array, acceleration: Array) -> Array:
        """Columns (n, nv, 10) of a link's mass, mass times the centre's place (3), and inertia about the link's frame (xx, yy,
        zz, xy, xz, yz), in all of which inverse dynamics is linear."""
        number = self.links[link]
        motion = position, velocity, acceleration

        def made(mass: float, centre: Any, inertia: Any, turn: Any = (1.0, 0.0, 0.0, 0.0)) -> Array:
            return self._of_one(number, mass, inertia, centre, turn, motion)

        origin = (0.0, 0.0, 0.0)
        unit = np.eye(3)
        weight = made(1.0, origin, origin)
        main = [made(0.0, origin, tuple(unit[axis])) for axis in range(3)]
        first = []
        for axis in range(3):
            others = [main[other] for other in range(3) if other != axis]
            first.append(made(1.0, tuple(unit[axis]), origin) - weight - others[0] - others[1])
        mixed = []
        eighth = np.pi / 8.0  # half of a turn by 45 degrees, as in a quaternion
        for (one, other), axis, sign in (((0, 1), 2, 1.0), ((0, 2), 1, -1.0), ((1, 2), 0, 1.0)):
            turn = np.concatenate([[np.cos(eighth)], sign * np.sin(eighth) * unit[axis]])
            turned = made(0.0, origin, tuple(unit[one]), tuple(turn))
            mixed.append(2.0 * turned - main[one] - main[other])
        return np.stack([weight, *first, *main, *mixed], axis=2)

    def inertial(self, link: str) -> Array:
        """The ten parameters of a link to which `inertial_columns` belong."""
        from scipy.spatial.transform import Rotation

        number = self.links[link]
        mass, centre = float(self.model.body_mass[number]), self.model.body_ipos[number]
        turn = Rotation.from_quat(np.roll(self.model.body_iquat[number], -1)).as_matrix()
        about = turn @ np.diag(self.model.body_inertia[number]) @ turn.T
        about = about + mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
        sides = about[[0, 0, 1], [1, 2, 2]]
        return np.concatenate([[mass], mass * centre, np.diag(about), sides])

    def _along(self, model: Any, data: Any, position: Array, velocity: Array, acceleration: Array) -> Array:
        from rhythmid.body.libmujoco import inverse_along

        mj = mujoco()
        model.opt.disableflags |= int(mj.mjtDisableBit.mjDSBL_CONSTRAINT)  # contacts, limits
        out = np.empty((len(position), model.nv))
        motion = (np.ascontiguousarray(one, dtype=float) for one in (position, velocity, acceleration))
        known = data.qpos, data.qvel, data.qacc, data.qfrc_inverse
        run: Any = inverse_along
        run(model._address, data._address, *known, *motion, out)
        return out

    @cached_property
    def reference(self) -> Array:
        """The pose (nq,) at which inertias are borrowed: the first key frame, else the file's own."""
        return np.array(self.model.key_qpos[0] if self.model.nkey else self.model.qpos0)

    def effective_inertia(self, joint: str) -> float:
        mj = mujoco()
        model, data = self.worker()
        data.qpos[:] = self.reference
        mj.mj_forward(model, data)
        whole = np.zeros((model.nv, model.nv))
        mj.mj_fullM(model, data, whole)
        return float(1.0 / np.linalg.inv(whole)[self.joints[joint].velocity, self.joints[joint].velocity])

    def touches(self, position: Array, margin: float = 0.0) -> NDArray[np.bool_]:
        if not self.contacts:
            return np.zeros(len(position), dtype=bool)
        mj = mujoco()
        model, data = self.worker()
        model.geom_margin[:] = np.maximum(model.geom_margin, margin)
        found = np.zeros(len(position), dtype=bool)
        for k, pose in enumerate(position):
            data.qpos[:] = pose
            mj.mj_kinematics(model, data)
            mj.mj_collision(model, data)
            found[k] = data.ncon > 0
        return found


def _joints(model: Any, path: Path) -> dict[str, Joint]:
    """Joints with one degree of freedom. Raises InputError for a ball joint, and where there is none."""
    mj, found = mujoco(), {}
    for number in range(model.njnt):
        kind, name = model.jnt_type[number], model.joint(number).name
        if kind == mj.mjtJoint.mjJNT_BALL:
            raise InputError(f"{path}: the ball joint {name!r} cannot be described; write it as three hinges")
        if kind != mj.mjtJoint.mjJNT_FREE:
            found[name] = Joint(
                name, kind == mj.mjtJoint.mjJNT_HINGE, int(model.jnt_qposadr[number]), int(model.jnt_dofadr[number])
            )  # fmt: skip
    if not found:
        raise InputError(f"{path}: has no hinge and no slide")
    if "" in found:
        raise InputError(f"{path}: has a joint without a name")
    return found


def _passive(model: Any) -> dict[str, Passive]:
    return {
        model.joint(number).name: Passive(float(model.dof_damping[dof]), float(model.dof_frictionloss[dof]))
        for number, dof in enumerate(model.jnt_dofadr)
    }


def _listed(joints: Mapping[str, Joint]) -> str:
    return f"its joints: {', '.join(joints)}"
