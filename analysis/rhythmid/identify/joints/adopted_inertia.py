"""Adoption of the links' inertias that were fitted to the efforts, if they predict held-out efforts better than the file's."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from rhythmid.body.inertial_parameter import ARMATURE, split
from rhythmid.body.machine import Machine
from rhythmid.errors import InputError
from rhythmid.identify.inverse_dynamics.balance import Balance
from rhythmid.identify.inverse_dynamics.estimate import EffortFit, fit_effort, linearise, size_of
from rhythmid.identify.joints.base_parameters import NAMES, InertialEstimate
from rhythmid.identify.joints.joint_motion import JointBalances
from rhythmid.model import Model
from rhythmid.record.joint_record import JointRecord

LEAST_FALL = 0.05  # least mean fall of the logarithm of the joints' held-out errors for the file's inertias to be replaced
LEAST_ERROR = 1e-3  # share of an effort below which errors are not compared further


@dataclass(frozen=True, eq=False)
class Adopted:
    """The machine with the fitted inertias, its joints' paths with the rotor free, and the fits of these beside them."""

    machine: Machine
    models: Mapping[str, Model]
    fits: Mapping[str, tuple[Balance, EffortFit]]
    note: str


def adopted_inertia(
    balances: JointBalances, fits: Mapping[str, tuple[Balance, EffortFit]], inertia: InertialEstimate,
    seen: Sequence[JointRecord], unseen: Sequence[JointRecord], free_rotor: Callable[[Model, float], Model],
) -> Adopted | None:  # fmt: skip
    """The machine with the fitted inertias; None if the file's predict as well, or if the model lists masses or inertias of its own."""
    machine = balances.machine
    if any(split(name)[1] != ARMATURE for name in machine.inertial):
        return None
    tens = {link: np.array([values[name] for name in NAMES]) for link, values in inertia.links.items()}
    try:
        made = machine.with_inertials(tens)
        own = JointBalances.of(made, seen, balances)
        models = {
            joint: free_rotor(model, made.body.parameters[f"{joint}.{ARMATURE}"])
            for joint, model in own.models.items()
        }
        own = replace(own, models=models)
        better = {joint: (balance, fit_effort(balance, models[joint])) for joint in machine.joints for balance in (own.balance(joint),)}  # fmt: skip
        before, after = (
            _errors(JointBalances.of(one, unseen, balances), those)
            for one, those in ((machine, fits), (made, better))
        )
    except InputError:  # too little was held out
        return None
    if not after or _mean(before) - _mean(after) < LEAST_FALL:
        return None
    most = max(before, key=lambda joint: before[joint] - after[joint])
    note = (
        f"the links have the inertias that were fitted to the efforts: on held-out data they miss {100.0 * after[most]:.3g} % of the effort of "
        f"{most}, those of the file {100.0 * before[most]:.3g} %"
    )
    return Adopted(made, models, better, note)


def _errors(balances: JointBalances, fits: Mapping[str, tuple[Balance, EffortFit]]) -> dict[str, float]:
    """Error of each joint's effort as a share of the effort, without joints of which too little was held out."""
    found: dict[str, float] = {}
    for joint, (_, fit) in fits.items():
        try:
            balance = balances.balance(joint)
        except InputError:
            continue
        residual, _ = linearise(balance, fit.model, (), fit.alignment)
        found[joint] = float(np.sqrt(np.mean(residual**2))) / size_of(balance)
    return found


def _mean(errors: Mapping[str, float]) -> float:
    return float(np.mean([math.log(one + LEAST_ERROR) for one in errors.values()]))
