"""A body described by an MJCF or URDF file and integrated by MuJoCo.

E. Todorov, T. Erez, Y. Tassa, MuJoCo: a physics engine for model-based control, IROS 2012.
"""

import copy
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rhythmid.body.body import Array, Body, Joint, Passive
from rhythmid.body.compiled_joints import joints_of, passive_of
from rhythmid.body.inertial_parameter import ARMATURE, MASS, PAYLOAD, TURNING, split
from rhythmid.body.link_inertia import Hinge, Principal, end_links, hinges, point_mass
from rhythmid.body.remembered import Remembered
from rhythmid.body.robot_file import (
    FIXED,
    FREE,
    LEAST_MASS,
    mujoco,
    quiet_data,
    read_robot,
    refused,
    warnings_told,
)
from rhythmid.errors import InputError

HEAVIEST = 1e6  # [kg] a larger mass of a link is a mistake
AS_THE_LINK = np.array([1.0, 0.0, 0.0, 0.0])  # axes aligned with the link's frame
WEIGHTLESS = 1e-10  # [kg] if all links together weigh less, they have no mass other than `LEAST_MASS`


@dataclass(frozen=True, eq=False)
class MujocoBody(Body):
    """A compiled file. `model` belongs to this object and is never changed; runs use a copy, see `worker`."""

    path: Path
    model: Any
    joints: Mapping[str, Joint]
    step: float
    base: str = FIXED
    contacts: bool = True
    passive: Mapping[str, Passive] = field(default_factory=dict)
    given: Mapping[str, float] = field(default_factory=dict)
    # for links that may carry a payload, its position (3,) in their frames
    ends: Mapping[str, Array] = field(default_factory=dict)
    centres: Mapping[str, Array] = field(default_factory=dict)  # (3,) of links, where they are not the file's
    notes: tuple[str, ...] = ()  # parts of the file that were left out or changed, in words
    idle: tuple[str, ...] = ()  # joints of the file that are held fast because they move no mass
    hold: Mapping[str, float] = field(default_factory=dict)  # positions of the file's joints that are fixed
    # for links whose inertia is not the file's, the ten numbers (10,) without a payload
    replaced: Mapping[str, Array] = field(default_factory=dict)
    mounted: bool = False  # whether gravity differs from the file's
    _alone: Remembered = field(default_factory=Remembered, repr=False)  # forces of single links

    @classmethod
    def load(
        cls,
        path: str | Path,
        base: str = FIXED,
        step: float | None = None,
        contacts: bool = True,
        hold: Mapping[str, float] | None = None,
    ) -> "MujocoBody":
        """The body in a file, with some of its joints fixed. Raises InputError where MuJoCo rejects the file, or
        `base` is no joint of it.

        Viscous damping and dry friction of the file's joints are removed, see `passive`; its actuators are disabled.
        """
        mj, path = mujoco(), Path(path)
        robot = read_robot(path, base, contacts, hold)
        with warnings_told() as told:
            try:
                model = robot.spec.compile()
            except (ValueError, mj.FatalError) as error:
                raise refused(path, error) from None
        joints, passive = joints_of(model, path), passive_of(model)
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
        made = cls(
            path,
            model,
            joints,
            float(model.opt.timestep),
            base,
            contacts,
            passive,
            notes=(*robot.notes, *told),
            idle=robot.idle,
            hold=hold or {},
        )
        return replace(made, ends=end_links(model, made.links))

    def with_losses(self, joints: Iterable[str]) -> "MujocoBody":
        """A copy with the file's losses restored in these joints, which have no path: for example a rail on which
        the base slides."""
        model = copy.copy(self.model)
        for name in joints:
            dof, known = self.joints[name].velocity, self.passive[name]
            model.dof_damping[dof], model.dof_frictionloss[dof] = known.damping, known.friction
        return replace(self, model=model)

    @property
    def gravity(self) -> Array:
        """Acceleration of gravity (3,) [m/s^2] in the frame of the file's world."""
        return np.array(self.model.opt.gravity)

    def with_gravity(self, gravity: Sequence[float] | Array) -> "MujocoBody":
        """A copy with another acceleration of gravity (3,) [m/s^2] in the frame of the file's world, as of a base that hangs or is on a wall."""
        model = copy.copy(self.model)
        model.opt.gravity[:] = gravity
        return replace(self, model=model, mounted=True, _alone=Remembered())

    def worker(self) -> tuple[Any, Any]:
        """A model and the data of a run, for use in one thread."""
        model = copy.copy(self.model)
        return model, quiet_data(model)

    def joint(self, name: str) -> Joint:
        """A joint by name. Raises InputError for an unknown one."""
        if name not in self.joints:
            raise InputError(f"{self.path}: has no joint {name!r}; {_listed(self.joints)}")
        return self.joints[name]

    @cached_property
    def links(self) -> dict[str, int]:
        """Indices of the moving links, by name."""
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

    @cached_property
    def hinges(self) -> dict[str, Hinge]:
        """For each rotating link, the nearest hinge that rotates it."""
        return hinges(self.model, self.links)

    def about_hinge(self, link: str) -> float:
        """Moment of inertia [kg*m^2] of a link, without its payload, about the hinge that rotates it."""
        own, hinge = self.own(link), self.hinges[link]
        return own.about(hinge.axis) + own.mass * hinge.distance(own.centre) ** 2

    @property
    def parameters(self) -> dict[str, float]:
        masses = {f"{name}.{MASS}": self.own(name).mass for name in self.links}
        turning = {f"{name}.{TURNING}": self.own(name).about(one.axis) for name, one in self.hinges.items()}
        payloads = {f"{name}.{PAYLOAD}": self._payload(name) for name in self.ends}
        armatures = {
            f"{name}.{ARMATURE}": float(self.model.dof_armature[one.velocity])
            for name, one in self.joints.items()
        }
        return masses | turning | payloads | armatures

    def with_parameters(self, values: Mapping[str, float]) -> "MujocoBody":
        known, armatures, changed = self.parameters, {}, {}
        for name, value in values.items():
            if name not in known:
                raise InputError(f"{self.path}: has no parameter {name!r}; it has {', '.join(known)}")
            owner, kind = split(name)
            if kind == ARMATURE:
                armatures[self.joints[owner].velocity] = value
            elif kind == MASS and not 0.0 < value < HEAVIEST:
                raise InputError(f"the mass of link {owner!r} must be greater than 0, not {value:g}")
            elif not 0.0 <= value < HEAVIEST:
                raise InputError(f"the {kind} of link {owner!r} must be 0 or greater, not {value:g}")
            else:
                changed[owner] = self.own(owner)
        given = {**self.given, **values}
        for link, own in changed.items():
            share = values.get(f"{link}.{MASS}", own.mass) / own.mass
            own = replace(own, mass=own.mass * share, moments=own.moments * share)
            if (inertia := given.get(f"{link}.{TURNING}")) is not None:
                own = own.turned(self.hinges[link].axis, inertia)
            changed[link] = own
        return replace(self, model=self._model_with(changed, values, armatures), given=given)

    def with_ends(self, places: Mapping[str, Array]) -> "MujocoBody":
        """A copy with payloads at these positions (3,) in the links' frames. Raises InputError for a link that
        carries none."""
        for link in places:
            if link not in self.ends:
                raise InputError(
                    f"{self.path}: {link!r} is not the last link of a chain; those are {', '.join(self.ends)}"
                )
        loads = {f"{link}.{PAYLOAD}": self._payload(link) for link in places}
        bare = self.with_parameters(dict.fromkeys(loads, 0.0))
        return replace(bare, ends={**self.ends, **places}).with_parameters(loads)

    def with_inertials(self, values: Mapping[str, Array]) -> "MujocoBody":
        """A copy whose links have these ten numbers (10,), see `inertial_columns`, besides their payloads.

        Raises InputError for an unknown link, and for numbers that are those of no rigid body.
        """
        made: dict[str, Principal] = {}
        for link, ten in self._of_links(values).items():
            own = Principal.from_ten(ten) if ten[0] > 0.0 else None
            if own is None or not own.possible:
                raise InputError(
                    f"{self.path}: the inertia given for the link {link!r} is that of no rigid body"
                )
            made[link] = own
        gone = {f"{one}.{TURNING}" for one in values}
        given = {name: value for name, value in self.given.items() if name not in gone}
        return replace(self, model=self._model_with(made), given=given, replaced={**self.replaced, **values})

    def with_centres(self, places: Mapping[str, Array]) -> "MujocoBody":
        """A copy in which the centres of mass of links, without their payloads, are at these places (3,) in their frames. Mass and inertia
        about the centre stay. Raises InputError for an unknown link."""
        made = {
            link: replace(self.own(link), centre=np.asarray(place, dtype=float))
            for link, place in self._of_links(places).items()
        }
        return replace(self, model=self._model_with(made), centres={**self.centres, **places})

    def _of_links(self, values: Mapping[str, Array]) -> Mapping[str, Array]:
        """The values; raises InputError for one of an unknown link."""
        for link in values:
            if link not in self.links:
                raise InputError(
                    f"{self.path}: has no link {link!r} that moves; those are {', '.join(self.links)}"
                )
        return values

    def _model_with(
        self,
        inertias: Mapping[str, Principal],
        values: Mapping[str, float] | None = None,
        armatures: Mapping[int, float] | None = None,
    ) -> Any:
        """The compiled model with these inertias of links, to which payloads are added: those among `values`, or else the present ones."""
        mj, model = mujoco(), copy.copy(self.model)
        for place, armature in (armatures or {}).items():
            model.dof_armature[place] = armature
        for link, own in inertias.items():
            if payload := (values or {}).get(f"{link}.{PAYLOAD}", self._payload(link)):
                own = Principal.from_ten(own.ten + payload * point_mass(self.ends[link]))
            own.put_into(model, self.links[link])
        mj.mj_setConst(model, quiet_data(model))
        return model

    def _payload(self, link: str) -> float:
        return self.given.get(f"{link}.{PAYLOAD}", 0.0)

    def own(self, link: str) -> Principal:
        """The inertia of a link without its payload."""
        whole = Principal.of(self.model, self.links[link])
        if payload := self._payload(link):
            return Principal.from_ten(whole.ten - payload * point_mass(self.ends[link]))
        return whole

    def inverse(self, position: Array, velocity: Array, acceleration: Array) -> Array:
        model, data = self.worker()
        return self._along(model, data, position, velocity, acceleration)

    def columns(self, names: list[str], position: Array, velocity: Array, acceleration: Array) -> Array:
        made = np.zeros((len(position), self.model.nv, len(names)))
        motion = position, velocity, acceleration
        for place, name in enumerate(names):
            owner, kind = split(name)
            if kind == ARMATURE:
                dof = self.joints[owner].velocity
                made[:, dof, place] = acceleration[:, dof]
            elif kind == PAYLOAD:
                unit = Principal(1.0, np.zeros(3), self.ends[owner], AS_THE_LINK)
                made[:, :, place] = self._of_one(self.links[owner], unit, motion)
            elif kind == TURNING:
                ball = replace(self.own(owner), mass=0.0).turned(self.hinges[owner].axis, 1.0)
                made[:, :, place] = self._of_one(self.links[owner], ball, motion)
            else:
                own = self.own(owner)
                if f"{owner}.{TURNING}" in self.given:  # it is independent of the mass
                    own = replace(own, moments=np.zeros(3))
                made[:, :, place] = self._of_one(self.links[owner], own, motion) / own.mass
        return made

    def _of_one(self, link: int, inertia: Principal, motion: tuple[Array, Array, Array]) -> Array:
        """Forces (n, nv) for one link with this inertia and the others without any, read-only.

        They do not depend on the inertia that the link has in this body, so that bodies with other inertias share what is known.
        """
        numbers = (inertia.moments, inertia.centre, inertia.turn, *motion)
        name = link, inertia.mass, len(motion[0])
        return self._alone.of(name, numbers, lambda: self._forces_of_one(link, inertia, motion))

    def _forces_of_one(self, link: int, inertia: Principal, motion: tuple[Array, Array, Array]) -> Array:
        model, data = self.worker()
        for one in (model.body_mass, model.body_inertia, model.jnt_stiffness, model.dof_damping):
            one[:] = 0.0
        model.dof_armature[:] = 1.0  # MuJoCo always factorises the inertia matrix
        inertia.put_into(model, link)
        return self._along(model, data, *motion) - motion[2]

    def inertial_columns(self, link: str, position: Array, velocity: Array, acceleration: Array) -> Array:
        """Columns (n, nv, 10) of a link's mass, mass times position of the centre (3), and inertia about the link's
        frame (xx, yy, zz, xy, xz, yz); inverse dynamics is linear in all of them."""
        number = self.links[link]
        motion = position, velocity, acceleration

        def made(mass: float, centre: Array, moments: Array, turn: Array = AS_THE_LINK) -> Array:
            return self._of_one(number, Principal(mass, moments, centre, turn), motion)

        origin = np.zeros(3)
        unit = np.eye(3)
        weight = made(1.0, origin, origin)
        main = [made(0.0, origin, unit[axis]) for axis in range(3)]
        first = []
        for axis in range(3):
            others = [main[other] for other in range(3) if other != axis]
            first.append(made(1.0, unit[axis], origin) - weight - others[0] - others[1])
        mixed = []
        eighth = np.pi / 8.0  # half of a 45 degree rotation, as in a quaternion
        for (one, other), axis, sign in (((0, 1), 2, 1.0), ((0, 2), 1, -1.0), ((1, 2), 0, 1.0)):
            turn = np.concatenate([[np.cos(eighth)], sign * np.sin(eighth) * unit[axis]])
            turned = made(0.0, origin, unit[one], turn)
            mixed.append(2.0 * turned - main[one] - main[other])
        return np.stack([weight, *first, *main, *mixed], axis=2)

    def inertial(self, link: str) -> Array:
        """The ten parameters (10,) of a link, in the order of `inertial_columns`."""
        return Principal.of(self.model, self.links[link]).ten

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
        """The pose (nq,) for the borrowed inertias: the first key frame, else the file's default pose."""
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


def _listed(joints: Mapping[str, Joint]) -> str:
    return f"its joints: {', '.join(joints)}"
