"""Design references for a machine of several joints, and predict the accuracy of its base parameters.

Each joint gets a multisine with random phases about the middle of its range. The joints' lines are interleaved, so that their
references are orthogonal over a period. Of several draws of the phases the one is taken whose regression has the largest determinant
(J. Swevers, C. Ganseman, D. B. Tükel, J. De Schutter, H. Van Brussel, IEEE Trans. Robot. Autom. 13 (1997) 730). The run is then
simulated, and the references are reduced until the joints' forces are within the limit. The Fisher information of the inverse
dynamics along the simulated motion, with white noise on the measured forces, gives every standard deviation.
"""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import qr

from rhythmid.body.joint_experiment import JointExcitation, JointExperiment, perform
from rhythmid.body.joint_run import JointRun
from rhythmid.body.machine import Machine
from rhythmid.errors import InputError
from rhythmid.excitation.multisine import Multisine
from rhythmid.identify.inverse_dynamics.balance import Balance
from rhythmid.identify.inverse_dynamics.estimate import EffortFit, fit_effort
from rhythmid.identify.joints.base_parameters import SEEN, InertialEstimate, estimate_inertia
from rhythmid.identify.joints.joint_identification import JointEstimate, rotor_freed
from rhythmid.identify.joints.joint_motion import JointBalances
from rhythmid.model import INERTIA
from rhythmid.progress import Tell
from rhythmid.record.joint_record import JointRecord

Array = NDArray[np.float64]
PERIODS_IN_A_RUN = 2  # repetitions of the multisines in a run, whose differences show the noise
# share of a joint's travel at either end that references leave free for the controllers' overshoot
MARGIN = 0.1
DRAWS = 20  # draws of the phases, of which the best is taken
POSES = 200  # poses of a period at which draws are compared
SMALLER = 0.8  # factor of each reduction of the references
SMALLEST = 0.02  # smallest share of the travel: with less a joint does not move


@dataclass(frozen=True)
class JointRequirements:
    """Requirements of a run.

    Attributes
    ----------
    duration : length of the run [s].
    band : lowest and highest frequency of the references [Hz].
    max_effort : largest force at any joint [N*m or N].
    noise_std : standard deviation of a measured force [N*m or N].
    rate : rate of commands and measurements [Hz].
    envelope : range, about the reference pose, of joints whose file states none [rad or m].
    seed : seed of the random phases.
    """

    duration: float
    band: tuple[float, float]
    max_effort: float
    noise_std: float
    rate: int = 1000
    envelope: tuple[float, float] | None = None
    seed: int = 0


@dataclass(frozen=True)
class JointDesign:
    """An experiment and its predictions.

    `peak` is the largest force by joint, `parameters` are those of the paths. The base parameters of the links have their
    standard deviations.
    """

    experiment: JointExperiment
    excitation: Mapping[str, Mapping[str, Any]]
    peak: Mapping[str, float]
    parameters: Mapping[str, JointEstimate]
    inertia: InertialEstimate

    def to_dict(self) -> dict[str, Any]:
        """The design as plain data."""
        return {
            "excitation": {joint: dict(one) for joint, one in self.excitation.items()},
            "peak_effort": dict(self.peak),
            "parameters": {name: asdict(one) for name, one in self.parameters.items()},
            "inertia": asdict(self.inertia),
        }


def design_joints(machine: Machine, wanted: JointRequirements, tell: Tell = lambda _: None) -> JointDesign:
    """References for a machine under its controllers.

    Raises InputError where a joint has no controller or no range, or where the forces stay too large.
    """
    for joint in machine.joints:
        if not machine.controlled(joint):
            raise InputError(f"{joint}: has no position_control, so that no reference can be designed for it")
    ranges = {joint: _range(machine, joint, wanted.envelope) for joint in machine.joints}
    tell("drawing phases")
    seed = max(range(wanted.seed, wanted.seed + DRAWS), key=lambda one: _seen(machine, wanted, ranges, one))
    share = 1.0
    while share > SMALLEST:
        tell(f"simulating with {100.0 * share:.0f} % of the travel")
        excitation = _excitation(machine, wanted, ranges, seed, share)
        experiment = _experiment(wanted, excitation)
        record, peak = rehearsed(machine, experiment)
        if record is not None and max(peak.values()) <= wanted.max_effort:
            tell("information of the run")
            parameters, inertia = predicted(machine, record, wanted.noise_std)
            return JointDesign(experiment, excitation, peak, parameters, inertia)
        share *= SMALLER
    most = max(peak, key=lambda joint: peak[joint])
    raise InputError(
        f"the force at {most} stays at {peak[most]:.3g}, above --max-effort {wanted.max_effort:g}: gravity or the band asks for it"
    )


def _range(machine: Machine, joint: str, envelope: tuple[float, float] | None) -> tuple[float, float]:
    """Positions that a joint may take: the range in the body's file, else the envelope about the reference pose."""
    body = machine.body
    model, place = body.model, body.joints[joint].position
    number = int(np.flatnonzero(model.jnt_qposadr == place)[0])
    if model.jnt_limited[number]:
        low, high = model.jnt_range[number]
        return float(low), float(high)
    if envelope is None:
        raise InputError(
            f"{body.path}: the joint {joint!r} has no range; write one there, or give --envelope"
        )
    middle = float(body.reference[place])
    return middle + envelope[0], middle + envelope[1]


def _excitation(
    machine: Machine, wanted: JointRequirements, ranges: Mapping[str, tuple[float, float]], seed: int, share: float
) -> dict[str, dict[str, Any]]:  # fmt: skip
    """The excitation of each joint, in the format of an experiment's file."""
    period = wanted.duration / PERIODS_IN_A_RUN
    found: dict[str, dict[str, Any]] = {}
    for place, joint in enumerate(machine.joints):
        low, high = ranges[joint]
        spec: dict[str, Any] = {
            "type": "multisine", "period": period, "periods": PERIODS_IN_A_RUN, "band": list(wanted.band), "select": "all",
            "part": [place, len(machine.joints)], "seed": seed * len(machine.joints) + place,
        }  # fmt: skip
        try:
            shape = Multisine(**{**spec, "rms": 1.0})
        except ValueError as error:
            raise InputError(
                f"{joint}: no line of the multisine is left for it in the band; make the run longer or the band wider"
            ) from error
        peak = float(np.abs(shape(np.linspace(0.0, period, 4000))).max())
        reach = 0.5 * (1.0 - MARGIN) * (high - low)
        rounded = {"offset": round(0.5 * (low + high), 6), "limits": [low, high]}
        found[joint] = {**rounded, **spec, "rms": round(share * reach / peak, 6)}
    return found


def _experiment(wanted: JointRequirements, excitation: Mapping[str, Mapping[str, Any]]) -> JointExperiment:
    made = {}
    for joint, one in excitation.items():
        about = ("offset", "limits")
        signal = Multisine(**{name: value for name, value in one.items() if name not in about})
        low, high = one["limits"]
        made[joint] = JointExcitation(one["offset"], (low, high), signal)
    return JointExperiment(wanted.duration, wanted.rate, made, namespace="/machine")


def _seen(
    machine: Machine, wanted: JointRequirements, ranges: Mapping[str, tuple[float, float]], seed: int
) -> tuple[int, float]:
    """Rank of the inertial columns along the references, and the logarithm of their determinant."""
    body = machine.body
    experiment = _experiment(wanted, _excitation(machine, wanted, ranges, seed, 0.5))
    time = np.linspace(0.0, wanted.duration / PERIODS_IN_A_RUN, POSES, endpoint=False)
    pose = np.tile(body.reference, (POSES, 1))
    rate, acceleration = np.zeros((POSES, body.model.nv)), np.zeros((POSES, body.model.nv))
    step = 1e-3  # step of the differences [s]; references are smooth
    for joint, one in experiment.excitation.items():
        before, now, after = (one(time + shift) for shift in (-step, 0.0, step))
        own = body.joints[joint]
        pose[:, own.position] = now
        rate[:, own.velocity] = (after - before) / (2.0 * step)
        acceleration[:, own.velocity] = (after - 2.0 * now + before) / step**2
    driven = [body.joints[joint].velocity for joint in machine.joints]
    columns = np.concatenate(
        [body.inertial_columns(link, pose, rate, acceleration)[:, driven] for link in body.links], axis=2
    )
    matrix = columns.reshape(-1, columns.shape[2])
    matrix = matrix / np.maximum(np.linalg.norm(matrix, axis=0), 1e-12)
    made: Any = qr(matrix, mode="r", pivoting=True)
    diagonal = np.abs(np.diag(made[0]))
    rank = int(np.sum(diagonal > SEEN * diagonal[0]))
    return rank, float(np.sum(np.log(diagonal[:rank])))


def rehearsed(machine: Machine, experiment: JointExperiment) -> tuple[JointRecord | None, dict[str, float]]:
    """The noise-free record of the run and the largest force at each joint; no record where the run diverges."""
    try:
        made = perform(machine, experiment)
    except InputError:
        return None, dict.fromkeys(machine.joints, np.inf)
    record = JointRun(machine, experiment, made).record
    efforts = {joint: one.effort for joint, one in record.joints.items()}
    peak = {joint: float(np.abs(one.value).max()) for joint, one in efforts.items() if one is not None}
    return record, peak


def predicted(
    machine: Machine, record: JointRecord, noise_std: float
) -> tuple[dict[str, JointEstimate], InertialEstimate]:
    """Standard deviations of the paths' parameters and of the base parameters, from the machine's own noise-free record.

    `noise_std` is that of a measured force; noise is independent from sample to sample.
    """
    balances = JointBalances.of(machine, [record])
    rotors = {
        joint: rotor_freed(model, machine.body.parameters[f"{joint}.armature"])
        for joint, model in balances.models.items()
    }
    balances = replace(balances, models=rotors)
    sampled = balances.bodies[0].stretch.period
    fits: dict[str, tuple[Balance, EffortFit]] = {}
    found: dict[str, JointEstimate] = {}
    for joint in machine.joints:
        balance = balances.balance(joint)
        fit = fit_effort(balance, balances.models[joint], steps=0)
        spacing = float(np.median(np.diff(balance.places[0]))) * balance.motions[0].period
        # standard deviation of low-passed white noise in each row, if the rows counted as independent
        scale = noise_std * np.sqrt(sampled / spacing)
        fits[joint] = balance, replace(fit, scale=scale, correlation=1.0)
        normal = fit.jacobian.T @ fit.jacobian / scale**2 + np.diag(fit.precision)
        size = 1.0 / np.sqrt(np.diag(normal))
        std = size * np.sqrt(np.diag(np.linalg.pinv(normal * np.outer(size, size))))
        for place, name in enumerate(fit.names, start=1):
            value = fit.model.parameters[name]
            rotor = name == INERTIA
            label = f"body.{joint}.armature" if rotor else f"{joint}.{name}"
            known = machine.body.parameters[f"{joint}.armature"] if rotor else value.value
            found[label] = JointEstimate(known, float(std[place]), value.unit)
    return found, estimate_inertia(balances, fits)


def save_joint_design(found: JointDesign, machine: Machine, model: Path, folder: Path) -> None:
    """Write `experiment.yaml` for `rhythmid run`, and `signals.yaml`, with which its bag is identified."""
    import os

    import yaml

    from rhythmid.output import write_text

    content = {
        "model": os.path.relpath(model.resolve(), folder.resolve()),
        "duration": found.experiment.duration,
        "rate": found.experiment.rate,
        "namespace": found.experiment.namespace,
        "excitation": {joint: dict(one) for joint, one in found.excitation.items()},
        "record": {"path": "bag"},
    }
    space = found.experiment.namespace
    signals: dict[str, Any] = {
        "joints": list(machine.joints),
        "input": {"topic": f"{space}/command", "field": "position[*]"},
        "output": {"topic": f"{space}/joint_states", "field": "position[*]"},
        "effort": {"field": "effort[*]", "taken": "after_actuator", "sampled": "mean"},
    }
    if machine.body.base in machine.body.joints:
        signals["base"] = {"field": f"position[{machine.body.base}]"}
    folder.mkdir(parents=True)
    for name, one in (("experiment", content), ("signals", signals)):
        text = yaml.safe_dump(one, sort_keys=False, default_flow_style=None, width=140)
        write_text(folder / f"{name}.yaml", text)
