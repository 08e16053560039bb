"""Inertia of one link in ten additive parameters, and the position of a link's end.

The ten parameters: the mass, the mass times the position of the centre (3), and the inertia about the link's frame
(xx, yy, zz, xy, xz, yz). For two bodies that are fixed to each other they add up.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rhythmid.body.robot_file import mujoco, quiet_data

Array = NDArray[np.float64]
WRITTEN = 1e-3  # share by which a moment may be impossible through the rounding of numbers with four digits


@dataclass(frozen=True, eq=False)
class Principal:
    """Inertia of a link in MuJoCo's form: mass, principal moments (3,), position of the centre (3,), and the axes
    as a quaternion (w, x, y, z)."""

    mass: float
    moments: Array
    centre: Array
    turn: Array

    @classmethod
    def of(cls, model: Any, link: int) -> "Principal":
        """The inertia of a link of a compiled model."""
        return cls(
            float(model.body_mass[link]),
            model.body_inertia[link].copy(),
            model.body_ipos[link].copy(),
            model.body_iquat[link].copy(),
        )

    @classmethod
    def from_ten(cls, ten: Array) -> "Principal":
        """The inertia with these ten parameters (10,); the mass is positive."""
        mass, centre = float(ten[0]), ten[1:4] / ten[0]
        xx, yy, zz, xy, xz, yz = ten[4:]
        about = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        moments, axes = np.linalg.eigh(about - _of_point(mass, centre))
        axes[:, 2] *= np.sign(np.linalg.det(axes))  # a rotation, not a reflection
        return cls(mass, moments, centre, np.roll(Rotation.from_matrix(axes).as_quat(), 1))

    @property
    def ten(self) -> Array:
        """The ten parameters (10,)."""
        axes = Rotation.from_quat(np.roll(self.turn, -1)).as_matrix()
        about = axes @ np.diag(self.moments) @ axes.T + _of_point(self.mass, self.centre)
        return _joined(self.mass, self.centre, about)

    @property
    def possible(self) -> bool:
        """Whether a rigid body has these moments: none is negative or greater than the sum of the others, but for the rounding of written numbers."""
        low, middle, high = sorted(self.moments)
        return bool(self.mass > 0.0 and low >= -WRITTEN * high and high <= (low + middle) * (1.0 + WRITTEN))

    def about(self, axis: Array) -> float:
        """Moment of inertia about an axis (3,) of unit length through the centre."""
        along = Rotation.from_quat(np.roll(self.turn, -1)).as_matrix().T @ axis
        return float(self.moments @ along**2)

    def turned(self, axis: Array, inertia: float) -> "Principal":
        """The inertia with this moment about an axis (3,) through the centre. All moments are scaled by one factor,
        so they remain physically consistent; where this moment is zero, they become those of a ball."""
        known = self.about(axis)
        moments = self.moments * (inertia / known) if known > 0.0 else np.full(3, inertia)
        return replace(self, moments=moments)

    def put_into(self, model: Any, link: int) -> None:
        """Set the inertia of a link of a compiled model.

        The compiler marks frames that coincide, and MuJoCo then reads only one of them: a link that is marked keeps its centre and its axes.
        """
        mj = mujoco()
        model.body_mass[link], model.body_inertia[link] = self.mass, self.moments
        model.body_ipos[link], model.body_iquat[link] = self.centre, self.turn
        apart = int(mj.mjtSameFrame.mjSAMEFRAME_NONE)
        model.body_sameframe[link] = apart
        with_inertia = [int(mj.mjtSameFrame.mjSAMEFRAME_INERTIA), int(mj.mjtSameFrame.mjSAMEFRAME_INERTIAROT)]
        for owner, same in (
            (model.geom_bodyid, model.geom_sameframe),
            (model.site_bodyid, model.site_sameframe),
        ):
            same[(owner == link) & np.isin(same, with_inertia)] = apart


@dataclass(frozen=True, eq=False)
class Hinge:
    """A hinge in the frame of a link that it rotates: its position (3,) and its axis (3,) of unit length."""

    place: Array
    axis: Array

    def distance(self, point: Array) -> float:
        """Distance [m] of a point (3,) from the axis."""
        return float(np.linalg.norm(np.cross(self.axis, point - self.place)))


def hinges(model: Any, links: Mapping[str, int]) -> dict[str, Hinge]:
    """For each rotating link, the nearest hinge that rotates it."""
    mj = mujoco()
    data = quiet_data(model)
    mj.mj_kinematics(model, data)
    found: dict[str, Hinge] = {}
    for name, link in links.items():
        axes, number = data.xmat[link].reshape(3, 3), link
        while number and name not in found:
            first, count = int(model.body_jntadr[number]), int(model.body_jntnum[number])
            for joint in range(first, first + count):
                if model.jnt_type[joint] == mj.mjtJoint.mjJNT_HINGE:
                    place = axes.T @ (data.xanchor[joint] - data.xpos[link])
                    found[name] = Hinge(place, axes.T @ data.xaxis[joint])
            number = int(model.body_parentid[number])
    return found


def ten_of(mass: float, centre: Array, about: Array) -> Array:
    """The ten numbers (10,) of a mass at a centre (3,) and the inertia about it, along the frame's axes (6,): xx, yy, zz, xy, xz, yz."""
    xx, yy, zz, xy, xz, yz = about
    own = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    return _joined(mass, centre, own + _of_point(mass, centre))


def about_centre(ten: Array) -> tuple[float, Array, Array]:
    """Mass, centre (3,) and inertia about it (6,) of the ten numbers (10,): the reverse of `ten_of`."""
    mass, centre = float(ten[0]), ten[1:4] / ten[0]
    return mass, centre, ten[4:] - point_mass(centre)[4:] * mass


def point_mass(place: Array) -> Array:
    """The ten parameters (10,) of 1 kg at a position (3,) in a link's frame."""
    return _joined(1.0, place, _of_point(1.0, place))


def _joined(mass: float, centre: Array, about: Array) -> Array:
    return np.concatenate([[mass], mass * centre, np.diag(about), about[[0, 0, 1], [1, 2, 2]]])


def _of_point(mass: float, place: Array) -> Array:
    """Inertia (3, 3) about the frame of a mass at a position (3,)."""
    return mass * (place @ place * np.eye(3) - np.outer(place, place))


def end_links(model: Any, links: dict[str, int]) -> dict[str, Array]:
    """The links at the ends of the chains, and the position (3,) of each link's end in its frame.

    It is the point farthest from the link's joint among the features of the link and of everything fixed to it:
    frames, sites and the centres of the faces of its shapes' bounding boxes. Without features, it is twice as far
    as the centre of mass, as for a uniform rod.
    """
    mj = mujoco()

    data = quiet_data(model)
    mj.mj_kinematics(model, data)
    group = model.body_weldid
    carrying = {int(group[model.body_parentid[root]]) for root in set(group.tolist()) - {0}}
    found: dict[str, Array] = {}
    for name, link in links.items():
        root = int(group[link])
        if root in carrying or any(group[links[one]] == root for one in found):
            continue
        shown = _shown(model, data, root)
        origin, axes = data.xpos[link], data.xmat[link].reshape(3, 3)
        places = np.array([axes.T @ (one - origin) for one in shown]).reshape(-1, 3)
        reach = np.linalg.norm(places, axis=1)
        found[name] = (
            places[int(np.argmax(reach))] if reach.max(initial=0.0) > 0.0 else 2.0 * model.body_ipos[link]
        )
    return found


def _shown(model: Any, data: Any, root: int) -> list[Array]:
    """World positions of the features of the links that are fixed to `root`."""
    group = model.body_weldid
    own = [body for body in range(1, model.nbody) if group[body] == root]
    shown = [data.xpos[body] for body in own if body != root]
    shown += [data.site_xpos[site] for site in range(model.nsite) if group[model.site_bodyid[site]] == root]
    for shape in (one for one in range(model.ngeom) if group[model.geom_bodyid[one]] == root):
        axes = data.geom_xmat[shape].reshape(3, 3)
        middle, half = model.geom_aabb[shape, :3], model.geom_aabb[shape, 3:]
        faces = [middle + sign * half * np.eye(3)[axis] for axis in range(3) for sign in (-1.0, 1.0)]
        shown += [data.geom_xpos[shape] + axes @ face for face in faces]
    return shown
