"""One wrong link in the place of several effects: its evidence over all joints that feel it.

A payload or a wrong mass acts at every joint that carries it, at each of them as something that an effect of that joint may resemble: at most joints of
an arm that moves slowly as a constant force. Searched one by one the joints name as many effects. So the one value that fits the efforts of all of them
best is compared with these effects by the same prediction of blocks that no fit has seen.
"""

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rhythmid.body.body import BODY
from rhythmid.diagnose.evidence import Linearised, predict
from rhythmid.diagnose.hypothesis import Prediction
from rhythmid.diagnose.joints.joint_case import JointResult
from rhythmid.diagnose.rejections import decisive
from rhythmid.diagnose.selection import Selection
from rhythmid.diagnose.verdict import decide
from rhythmid.identify.inverse_dynamics.estimate import linearise
from rhythmid.identify.joints.joint_motion import JointBalances
from rhythmid.identify.student import autocorrelation_time, scale_of, weights_of

Array = NDArray[np.float64]
ROUNDS = 5  # of reweighted least squares: what the other joints miss moves no weight any more
FEWEST = 2  # joints that have to feel a link: at one alone it is a hypothesis of the search there


@dataclass(frozen=True, eq=False)
class SharedCause:
    """A parameter of the body that explains the efforts of several joints, by log odds of `evidence` better than the effects that were named
    there, with the joint that has `shown` it best."""

    parameter: str
    evidence: float
    shown: JointResult


@dataclass(frozen=True, eq=False)
class _Felt:
    """What one joint says of a parameter: residual (n,) of its nominal fit, and how the effort changes (n,) for a unit of it."""

    one: JointResult
    residual: Array
    column: Array
    jacobian: Array
    precision: Array
    departure: Array


def shared_cause(
    balances: JointBalances, found: Mapping[str, JointResult], stated: Mapping[str, Collection[str]],
    known: Collection[str],
) -> SharedCause | None:  # fmt: skip
    """The body's parameter that explains the joints better than what is `stated` at them; none of those `known`. None where there is none."""
    names = {name for joint in found for name in balances.links(joint)} - set(known)
    rotors = {name for joint in found for name in balances.rotors(joint)}
    made = [_judged(balances, found, stated, name) for name in sorted(names - rotors)]
    return max(filter(None, made), key=lambda one: one.evidence, default=None)


def _judged(
    balances: JointBalances, found: Mapping[str, JointResult], stated: Mapping[str, Collection[str]], name: str
) -> SharedCause | None:  # fmt: skip
    """A parameter with its evidence against what is stated; None where that explains the joints as well."""
    label = f"{BODY}.{name}"
    tried = {
        joint: hypothesis
        for joint, one in found.items()
        for hypothesis in one.result.contest.hypotheses
        if hypothesis.elements == (label,)
    }
    joints = [joint for joint in found if name in balances.links(joint)]
    if not tried or len(joints) < FEWEST or not any(stated[joint] for joint in joints):
        return None
    felt = [_felt(found[joint], label) for joint in joints]
    change = _change(felt)
    replaced, evidence = 0, 0.0
    for joint, one in zip(joints, felt, strict=True):
        alone, chosen, nominal = _predicted(one, change)
        effects = len(stated[joint])
        if alone.score < nominal.score - decisive(1):
            return None  # it harms here
        if not effects:
            evidence += alone.score - nominal.score
        elif alone.score >= chosen.score - effects * decisive(1):
            replaced += effects
            evidence += alone.score - chosen.score
    evidence += (replaced - 1) * decisive(1)  # each further cause has to bring that
    if replaced == 0 or evidence <= (decisive(1) if replaced == 1 else 0.0):
        return None
    shown = max(tried, key=lambda joint: tried[joint].prediction.score - found[joint].result.contest.nominal.prediction.score)  # fmt: skip
    return SharedCause(name, evidence, _with_choice(found[shown], label, evidence))


def _felt(one: JointResult, label: str) -> _Felt:
    nominal, balance = one.result.nominal, one.result.search.balance
    fit, linear = nominal.fit, nominal.linearised
    _, columns = linearise(balance, fit.model, [label], fit.alignment)
    return _Felt(one, linear.residual, columns[:, 1], linear.jacobian, linear.precision, linear.departure)


def _change(felt: list[_Felt]) -> float:
    """Change of the parameter that fits all joints best, the other parameters of each refitted."""
    left = [one.residual for one in felt]
    change = 0.0
    for _ in range(ROUNDS):
        pull = strength = 0.0
        parts: list[tuple[Array, Array]] = []
        for one, error in zip(felt, left, strict=True):
            scale = scale_of(error)
            lasts = autocorrelation_time(error, one.one.result.search.balance.record)
            weight = weights_of(error, scale) / (scale**2 * lasts)
            normal = (one.jacobian * weight[:, None]).T @ one.jacobian + np.diag(one.precision / lasts)
            both = np.column_stack([one.residual, one.column])
            right = one.jacobian.T @ (weight[:, None] * both)
            right[:, 0] += one.precision / lasts * one.departure
            solved = np.linalg.lstsq(normal, right, rcond=1e-12)[0]
            residual, column = (both - one.jacobian @ solved).T
            pull += float(column @ (weight * residual))
            strength += float(column @ (weight * column))
            parts.append((residual, column))
        change = -pull / strength if strength > 0.0 else 0.0
        left = [residual + change * column for residual, column in parts]
    return change


def _predicted(one: _Felt, change: float) -> tuple[Prediction, Prediction, Prediction]:
    """What a joint predicts with the parameter changed alone, with what was chosen there, and with the nominal model."""
    result = one.one.result
    moved = Linearised(one.residual + change * one.column, one.jacobian, one.precision, one.departure)
    fits = [moved, result.chosen.linearised, result.nominal.linearised]
    alone, chosen, nominal = predict(fits, result.search.blocks, result.search.balance.record)
    return alone, chosen, nominal


def _with_choice(one: JointResult, label: str, evidence: float) -> JointResult:
    """The result of a joint where the parameter is chosen, with the probability that the evidence over all joints gives it."""
    result = one.result
    hypothesis = next(h for h in result.contest.hypotheses if h.elements == (label,))
    chosen = next(f for f in result.search.hypotheses if f.elements == (label,))
    selection = Selection(hypothesis, result.selection.rejections)
    decision = decide(result.contest, selection, result.detectable, {})
    probability = 1.0 / (1.0 + math.exp(-min(evidence, 700.0)))
    decision = replace(decision, named=(label,), probability={label: probability})
    return replace(one, result=replace(result, selection=selection, decision=decision, chosen=chosen))
