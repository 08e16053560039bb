"""Recorded data of a machine with several joints, in stretches without gaps and contact, on one grid for all joints."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from rhythmid.body.machine import FREE, Machine
from rhythmid.errors import InputError
from rhythmid.identify.drive import controlled
from rhythmid.identify.inverse_dynamics.motion import FEWEST_STRETCH_SAMPLES
from rhythmid.identify.inverse_dynamics.reference_path import Commanded
from rhythmid.identify.joints.reference_lead import HeldReference, held_reference
from rhythmid.identify.noise import runs
from rhythmid.model import Model
from rhythmid.record.joint_record import JointRecord
from rhythmid.record.record import Record, Uniform

Array = NDArray[np.float64]
# [m] distance of two surfaces below which they may touch: errors of encoders and of link shapes
TOUCHING_DISTANCE = 0.002
WHOLE = 0.99  # share of a sample that must be measured rather than interpolated over a gap
# poses of a record at which contact is checked: contacts last longer than the time between them
MOST_POSES = 4000


@dataclass(frozen=True, eq=False)
class JointStretch:
    """One stretch of a record on a common grid.

    It holds time (n,) [s], pose (n, nv) of the whole body, and for each joint (n, joints) the effort where it was
    recorded or is the command. The controller's reference, with the feed-forward that the controller adds to its
    force, is stored for the whole record; the stretch is its `part`. `held` are references that are held while the
    effort was recorded in step with them. `smooth` are the joints whose references move between their timestamps.
    """

    record: int
    name: str
    time: Array
    pose: Array
    effort: dict[str, Array]
    reference: dict[str, Commanded]
    forward: dict[str, Array]
    period: float
    held: dict[str, HeldReference] = field(default_factory=dict)
    smooth: frozenset[str] = frozenset()
    part: slice = field(default_factory=lambda: slice(None))


def joint_stretches(machine: Machine, records: Sequence[JointRecord]) -> list[JointStretch]:
    """The stretches of all records. Raises InputError where a joint's motion was not recorded, or no stretch is long enough."""
    found: list[JointStretch] = []
    for number, record in enumerate(records):
        check_recorded(machine, record)
        grid, period, columns, valid = _common(machine, record)
        pose = np.tile(machine.body.reference, (len(grid), 1))
        for joint, one in columns.items():
            pose[:, machine.body.joints[joint].position] = one.output
        every = max(1, len(grid) // MOST_POSES)
        touching = machine.body.touches(pose[::every], TOUCHING_DISTANCE)
        beside = touching.copy()  # a contact may begin between the checked poses
        beside[1:] |= touching[:-1]
        beside[:-1] |= touching[1:]
        flying = ~np.repeat(beside, every)[: len(grid)]
        held = {
            joint: one for joint in machine.joints if (one := _held(machine, record, joint, grid)) is not None
        }
        smooth = frozenset(
            joint for joint in machine.joints
            if (one := record.joints[joint]).reference is None and one.hold != "zero"
        )  # fmt: skip
        driven = {j: _drives(machine.paths[j], record.joints[j], columns[j]) for j in machine.joints}
        asked = {
            joint: Commanded(grid, one[1], float(columns[joint].output[0]))
            for joint, one in driven.items()
            if one[1] is not None
        }
        for part in runs(valid & flying):
            if part.stop - part.start < FEWEST_STRETCH_SAMPLES:
                continue
            found.append(
                JointStretch(
                    number, record.name, grid[part], pose[part],
                    {joint: one[0][part] for joint, one in driven.items() if one[0] is not None},
                    asked,
                    {joint: one[2][part] for joint, one in driven.items() if one[2] is not None},
                    period,
                    {joint: replace(one, between=one.between[part]) for joint, one in held.items()},
                    smooth,
                    part,
                )
            )  # fmt: skip
    if not found:
        raise InputError(f"no stretch without a gap and without contact has {FEWEST_STRETCH_SAMPLES} samples")
    return found


def check_recorded(machine: Machine, record: JointRecord) -> None:
    """Raise InputError where the motion of a joint or of the base was not recorded."""
    body = machine.body
    if body.base == FREE:
        raise InputError(
            f"{record.name}: the base of {body.path.name} floats, and its motion was not recorded; hold it fast and write "
            "base: fixed, or lead it along a joint that is recorded"
        )
    for joint in machine.joints:
        if joint not in record.joints:
            raise InputError(
                f"{record.name}: the joint {joint!r} is not recorded; it has {', '.join(record.joints)}"
            )
    for joint in record.joints:
        if joint not in machine.joints:
            raise InputError(
                f"{record.name}: the joint {joint!r} has no path in the model; name it under 'joints:'"
            )
    for joint in body.joints:
        if joint == body.base and record.base is None:
            raise InputError(
                f"{record.name}: the base moves along {joint!r}, which is not recorded; name it in signals.yaml as 'base:'"
            )
        if joint != body.base and joint not in machine.joints:
            raise InputError(
                f"{body.path.name}: the joint {joint!r} moves, but the model says nothing of it; name it under 'joints:'"
            )


def _common(
    machine: Machine, record: JointRecord
) -> tuple[Array, float, dict[str, Uniform], NDArray[np.bool_]]:
    """The grid of the first joint within the time that all joints share, every joint's channels there, and the
    samples without a gap."""
    every = dict(record.joints)
    if record.base is not None:
        every[machine.body.base] = record.base
    grids = {joint: one.uniform() for joint, one in every.items()}
    first = next(iter(grids.values()))
    start = max(float(one.time[0]) for one in grids.values())
    end = min(float(one.time[-1]) for one in grids.values())
    time = first.time[(first.time >= start - 1e-9) & (first.time <= end + 1e-9)]
    if len(time) < FEWEST_STRETCH_SAMPLES:
        raise InputError(
            f"{record.name}: the joints have less than {FEWEST_STRETCH_SAMPLES} samples in common"
        )
    moved = {joint: _at(one, time) for joint, one in grids.items()}
    valid = np.all([one.valid for one in moved.values()], axis=0)
    return time, first.period, moved, valid


def _at(grid: Uniform, time: Array) -> Uniform:
    """A joint's channels, interpolated at other times."""
    if len(grid.time) == len(time) and np.abs(grid.time - time).max() < 1e-9:
        return grid

    def moved(values: Array | None) -> Array | None:
        return None if values is None else np.asarray(CubicSpline(grid.time, values)(time))

    output = moved(grid.output)
    assert output is not None
    valid = np.interp(time, grid.time, grid.valid.astype(float)) > WHOLE
    missing = np.interp(time, grid.time, grid.missing.astype(float)) > 0.0
    held = {} if grid.input is None else {"input": np.interp(time, grid.time, grid.input)}
    return Uniform(
        time, output, grid.period, valid, missing, **held, forcing=moved(grid.forcing), effort=moved(grid.effort),
        reference=moved(grid.reference),
    )  # fmt: skip


def _held(machine: Machine, record: JointRecord, joint: str, grid: Array) -> HeldReference | None:
    """The reference of a joint that is held between its timestamps, where the effort was recorded in step with it;
    else None."""
    one = record.joints[joint]
    given = one.reference or (one.input if one.input_kind == "reference" else None)
    if one.effort is None or given is None or one.hold != "zero" or not machine.controlled(joint):
        return None
    return held_reference(one.effort, given, grid)


def _drives(model: Model, record: Record, grid: Uniform) -> tuple[Array | None, Array | None, Array | None]:
    """Effort, reference and feed-forward of a joint."""
    if record.effort is not None:
        return grid.effort, None, None
    if controlled(model):
        reference = grid.reference if grid.reference is not None else grid.input
        if reference is None or (grid.reference is None and record.input_kind != "reference"):
            raise InputError(
                f"{record.name}: of a joint with a controller neither the effort nor the reference is recorded"
            )
        return None, reference, grid.forcing
    if record.input is not None and record.input_kind == "force" and grid.input is not None:
        return grid.input if grid.forcing is None else grid.input + grid.forcing, None, None
    if any(term.element.slot in ("command", "actuator") for term in model.terms):
        raise InputError(f"{record.name}: of a joint that is driven neither effort nor command is recorded")
    return np.zeros(len(grid.time)), None, None
