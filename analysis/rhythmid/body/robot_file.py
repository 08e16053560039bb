"""A robot's MJCF or URDF file as a specification that MuJoCo compiles.

URDF files of real robots seldom compile unchanged. Their meshes are named by ROS package (`package://`) or have
formats that MuJoCo does not read. Links that only carry a frame have no mass. Some inertias, rounded or guessed,
are physically impossible. A body needs masses and inertias; its shapes matter only for contacts.
"""

import os
import warnings
import xml.etree.ElementTree as tree
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rhythmid.errors import InputError

MISSING = "machines of several joints need MuJoCo: pip install 'rhythmid[legs]'"
FIXED, FREE = "fixed", "free"
MESHES = (".stl", ".obj", ".msh")  # formats that MuJoCo reads (its documentation, "mesh")
PACKAGE, FILE = "package://", "file://"
# [kg, kg m^2] for a moving link without mass, so that MuJoCo can divide by it
LEAST_MASS, LEAST_INERTIA = 1e-12, 1e-14
# relative margin of a moment to the physical limit, so that MuJoCo's rounding does not reject it
ROUNDING = 1e-9
SEVERAL = frozenset({"visual", "collision"})  # elements that may occur several times in a link of a URDF
# largest relative violation of the physical limits that counts as rounding in the file and is not reported
ROUNDED = 1e-3


def mujoco() -> Any:
    """The module `mujoco`. Raises InputError where it is not installed."""
    try:
        import mujoco as module
    except ImportError:
        raise InputError(MISSING) from None
    return module


@dataclass(frozen=True)
class RobotFile:
    """Content of a robot's file.

    Attributes
    ----------
    spec : a `mujoco.MjSpec`, to be compiled.
    notes : parts that were left out or changed, in words.
    idle : joints that were taken out because they move no mass.
    """

    spec: Any
    notes: tuple[str, ...] = ()
    idle: tuple[str, ...] = ()


def read_robot(
    path: Path, base: str = FIXED, contacts: bool = True, hold: Mapping[str, float] | None = None
) -> RobotFile:
    """The specification in a file, without the free joint of a fixed base, and with the joints in `hold` fixed at
    these positions.

    Meshes of a URDF are left out where there are no contacts. Raises InputError where contacts need a mesh that
    cannot be read, and where MuJoCo rejects the file.
    """
    mj = mujoco()
    if not path.is_file():
        raise InputError(f"{path}: no such file")
    with warnings_told() as told:
        try:
            spec = mj.MjSpec.from_file(str(path))
        except (ValueError, mj.FatalError) as error:
            text, repeated = without_repetitions(path)
            if not repeated:
                raise _without_links(path) or refused(path, error) from None
            told.extend(repeated)
            try:
                spec = mj.MjSpec.from_string(text)
            except (ValueError, mj.FatalError) as further:
                raise _without_links(path) or refused(path, further) from None
    _require_text(spec, path)
    if base == FIXED:
        floating = [one for one in spec.joints if one.type == mj.mjtJoint.mjJNT_FREE]
        for one in (*floating, *(spec.keys if floating else ())):  # key frames contain its positions, too
            spec.delete(one)
    if path.suffix.lower() != ".urdf":
        _hold(spec, hold or {}, path)
        return RobotFile(spec, (*told, *_coupled(spec)))
    spec.compiler.inertiafromgeom = 0  # a link without <inertial> has no mass, whatever its shape
    spec.compiler.boundmass, spec.compiler.boundinertia = LEAST_MASS, LEAST_INERTIA
    if contacts:
        _find_meshes(spec, path)
    else:
        _leave_meshes_out(spec)
    told.extend(_with_possible_inertias(spec))
    _hold(spec, hold or {}, path)
    idle = _held_fast(spec)
    if idle:
        told.append(f"held fast, because what they move has no mass: {', '.join(idle)}")
    return RobotFile(spec, (*told, *_coupled(spec)), idle)


def _require_text(spec: Any, path: Path) -> None:
    """Raise InputError where a name, or the file of a mesh, is not UTF-8 text."""
    named = (
        spec.bodies, spec.joints, spec.geoms, spec.sites, spec.meshes, spec.actuators, spec.sensors, spec.tendons,
        spec.equalities, spec.keys,
    )  # fmt: skip
    try:
        for one in chain(*named):
            str(one.name)
        for mesh in spec.meshes:
            str(mesh.file)
    except UnicodeDecodeError:
        raise InputError(f"{path}: a name in it is not UTF-8 text; save the file as UTF-8") from None


@contextmanager
def warnings_told() -> Iterator[list[str]]:
    """Collects MuJoCo's warnings, one line each, which it would otherwise print and write to a file in the current
    folder."""
    mj, told = mujoco(), list[str]()
    before = mj.get_mju_user_warning()
    mj.set_mju_user_warning(lambda line: told.append(" ".join(line.split())))
    try:
        with warnings.catch_warnings(record=True) as others:
            yield told
    finally:
        mj.set_mju_user_warning(before)
    told.extend(str(one.message) for one in others)


def quiet_data(model: Any) -> Any:
    """An `MjData` for which MuJoCo prints no warnings about a run; the caller checks for values that are not finite.

    MuJoCo prints a warning, and writes it to a file in the current folder, only where the count of its kind in the
    data is 0 (its documentation, mjWarningStat; engine_core_util.c, mj_warning).
    """
    data = mujoco().MjData(model)
    for kind in data.warning:
        kind.number = 1
    return data


def refused(path: Path, error: Exception) -> InputError:
    """MuJoCo's message about a file, in one line."""
    return InputError(f"{path}: MuJoCo refuses it: {' '.join(str(error).split())}")


def without_repetitions(path: Path) -> tuple[str, list[str]]:
    """The text of a URDF without repeated elements where one is expected, and a note on each; no notes where there
    are none.

    The first one is kept, as in ROS's parser (urdfdom, `FirstChildElement`).
    """
    try:
        robot = tree.parse(path).getroot()
    except tree.ParseError:
        return "", []
    notes: list[str] = []
    for owner in (one for kind in ("joint", "link") for one in robot.findall(kind)):
        for part in (owner, *owner) if owner.tag == "link" else (owner,):
            seen = set[str]()
            for child in list(part):
                if child.tag in seen and child.tag not in SEVERAL:
                    part.remove(child)
                    where = "" if part is owner else f" in its {part.tag}"
                    notes.append(
                        f"{owner.tag} {owner.get('name')!r} has a further <{child.tag}>{where}; the first one is taken, as ROS does"
                    )
                seen.add(child.tag)
    return tree.tostring(robot, encoding="unicode"), notes


def _without_links(path: Path) -> InputError | None:
    """Advice about links that joints of a URDF name but that do not exist, in one line; None where there are none."""
    try:
        robot = tree.parse(path).getroot()
    except tree.ParseError:
        return None
    links = {one.get("name") for one in robot.iter("link")}
    for joint in robot.iter("joint"):
        for end in ("parent", "child"):
            named = joint.find(end)
            link = None if named is None else named.get("link")
            if link is not None and link not in links:
                return InputError(
                    f"{path}: joint {joint.get('name')!r} has the {end} link {link!r}, which the file lacks: "
                    f'add  <link name="{link}"/>  to it, or name one of its links there'
                )
    return None


def _leave_meshes_out(spec: Any) -> None:
    for shape in [one for one in spec.geoms if one.type == mujoco().mjtGeom.mjGEOM_MESH]:
        spec.delete(shape)
    for mesh in list(spec.meshes):
        spec.delete(mesh)


def _find_meshes(spec: Any, path: Path) -> None:
    """Set the file of every mesh. Raises InputError where there is none in a format that MuJoCo reads."""
    folder = path.resolve().parent
    unreadable = []
    for mesh in spec.meshes:
        found = mesh_file(mesh.file, folder)
        if found is None or found.suffix.lower() not in MESHES:
            unreadable.append(mesh.file)
        else:
            mesh.file = os.path.relpath(found, folder)
    if unreadable:
        raise InputError(
            f"{path}: {len(unreadable)} of {len(spec.meshes)} meshes cannot be read, the first is {unreadable[0]}: where nothing touches, write "
            f"contacts: false under body:; else MuJoCo reads {', '.join(MESHES)}, and packages are sought above the file, on ROS_PACKAGE_PATH "
            "and in share/ on AMENT_PREFIX_PATH"
        )


def mesh_file(name: str, folder: Path) -> Path | None:
    """The file of a mesh name in a URDF in `folder`; None where there is none.

    A package is a folder of that name above the file, in a folder of ROS_PACKAGE_PATH, or in share/ of a folder of
    AMENT_PREFIX_PATH.
    """
    if name.startswith(PACKAGE):
        package = name.removeprefix(PACKAGE)
        places = [
            *folder.parents,
            folder,
            *_listed("ROS_PACKAGE_PATH"),
            *(one / "share" for one in _listed("AMENT_PREFIX_PATH")),
        ]
        named = [one / package for one in places]
    else:
        named = [folder / name.removeprefix(FILE)]
    return next((one for one in named if one.is_file()), None)


def _listed(variable: str) -> list[Path]:
    return [Path(one) for one in os.environ.get(variable, "").split(os.pathsep) if one]


def _hold(spec: Any, hold: Mapping[str, float], path: Path) -> None:
    """Remove joints, with the links that they move rotated or shifted to these positions.

    Raises InputError where the file has no such hinge or slide joint.
    """
    mj = mujoco()
    kinds = mj.mjtJoint.mjJNT_HINGE, mj.mjtJoint.mjJNT_SLIDE
    joints = {one.name: one for one in spec.joints if one.type in kinds}
    for name in hold:
        if name not in joints:
            raise InputError(f"{path}: hold: has no hinge or slide {name!r}; its joints: {', '.join(joints)}")
    drawn = _compiled(spec.copy(), path) if any(hold.values()) else None
    for name, position in hold.items():
        if drawn is not None:
            _turn(joints[name], drawn, position)
    _take_out(spec, [joints[name] for name in hold])


def _turn(joint: Any, drawn: Any, position: float) -> None:
    """Move the link of a joint to this position; `drawn` is the compiled file, in which all frames have one form."""
    link, known = joint.parent, drawn.joint(joint.name)
    number = int(known.bodyid[0])
    frame = Rotation.from_quat(np.roll(drawn.body_quat[number], -1))
    moved = (position - float(known.qpos0[0])) * known.axis
    if joint.type == mujoco().mjtJoint.mjJNT_SLIDE:
        shift, turn = moved, Rotation.identity()
    else:
        turn = Rotation.from_rotvec(moved)
        shift = known.pos - turn.apply(known.pos)
    link.pos = drawn.body_pos[number] + frame.apply(shift)
    link.alt.type = mujoco().mjtOrientation.mjORIENTATION_QUAT
    link.quat = np.roll((frame * turn).as_quat(), 1)


def _compiled(spec: Any, path: Path) -> Any:
    with warnings_told():
        try:
            return spec.compile()
        except (ValueError, mujoco().FatalError) as error:
            raise refused(path, error) from None


def _held_fast(spec: Any) -> tuple[str, ...]:
    """Remove the joints that move no mass, such as those of a gripper that is described only by its shapes; their names."""
    idle = [joint for joint in spec.joints if _mass_beyond(joint.parent) == 0.0]
    names = tuple(joint.name for joint in idle)
    _take_out(spec, idle)
    return names


def _coupled(spec: Any) -> Iterator[str]:
    """Joints that are coupled in the file, such as the fingers of a gripper (`mimic` in a URDF)."""
    for one in spec.equalities:
        if one.type == mujoco().mjtEq.mjEQ_JOINT and one.name2:
            yield (
                f"the file couples {one.name1} to {one.name2}: the force of that coupling is in no balance of efforts; where it does not matter, "
                f"write hold: [{one.name1}] under body:"
            )


def _take_out(spec: Any, joints: Sequence[Any]) -> None:
    """Remove joints and everything that refers to them: couplings, actuators, sensors, and key frames, whose
    positions would have other indices."""
    names = {joint.name for joint in joints}
    spoken = [one for one in spec.equalities if names & {one.name1, one.name2}]
    spoken += [one for one in spec.actuators if one.target in names]
    spoken += [one for one in spec.sensors if one.objname in names]
    for one in (*spoken, *(spec.keys if joints else ()), *joints):
        spec.delete(one)


def _mass_beyond(link: Any) -> float:
    """Mass [kg] of a link and of all links that it carries."""
    return float(sum(one.mass for one in (link, *link.find_all("body"))))


def _with_possible_inertias(spec: Any) -> Iterator[str]:
    """Replace physically impossible inertias by the nearest possible ones."""
    for link in spec.bodies:
        if not link.explicitinertial or not np.all(np.isfinite(link.fullinertia)):
            continue
        own = _matrix(link.fullinertia)
        moments, axes = np.linalg.eigh(own)
        nearest = possible_moments(moments)
        change, size = float(np.max(np.abs(nearest - moments))), float(np.max(np.abs(moments)))
        if change == 0.0:
            continue
        near = axes @ np.diag(nearest) @ axes.T
        link.fullinertia = near[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
        if change > ROUNDED * size:
            yield (
                f"the inertia of link {link.name!r} is that of no rigid body (principal moments "
                f"{', '.join(f'{one:.3g}' for one in moments)} kg*m^2); the nearest possible one is taken"
            )


def _matrix(six: Any) -> NDArray[np.float64]:
    """The inertia (3, 3) with the entries xx, yy, zz, xy, xz, yz."""
    xx, yy, zz, xy, xz, yz = (float(one) for one in six)
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def possible_moments(moments: NDArray[np.float64]) -> NDArray[np.float64]:
    """The physically possible principal moments of inertia (3,) nearest to these, in ascending order.

    None is negative, and none exceeds the sum of the other two (L. D. Landau, E. M. Lifshitz, Mechanics, section 32).
    """
    low, middle, high = np.maximum(moments, LEAST_INERTIA)
    beyond = high - low - middle
    if beyond <= 0.0:
        return np.array([low, middle, high])
    third = beyond / 3.0 * (1.0 + ROUNDING)
    return np.array([low + third, middle + third, high - third])
