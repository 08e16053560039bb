"""A value of a link is the same for all joints that it moves: its estimate from all of them, and the evidence of all of them for it.

Each joint is judged with the effects that were found at that joint, because a friction that is not explained looks like any value.
"""

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rhythmid.body.body import BODY
from rhythmid.diagnose.answer.result import Estimate
from rhythmid.diagnose.constants import CONTRADICTS
from rhythmid.diagnose.effort.candidate import widest, with_freed
from rhythmid.diagnose.effort.fitted import Fitted
from rhythmid.diagnose.evidence import predict
from rhythmid.diagnose.joints.joint_case import JointResult
from rhythmid.diagnose.rejections import decisive
from rhythmid.identify.inverse_dynamics.balance import Balance
from rhythmid.identify.inverse_dynamics.estimate import fit_effort, linearise
from rhythmid.identify.joints.joint_motion import JointBalances
from rhythmid.identify.robust_covariance import with_robust_std
from rhythmid.model import Model
from rhythmid.simulation.transport import INPUT_DELAY
from rhythmid.value import Prior

Array = NDArray[np.float64]


def own_path(balances: JointBalances, one: JointResult) -> Model:
    """The path of a joint with the effects found there, and with the values of the body and of its rotor as they are given."""
    nominal = balances.models[one.joint]
    return replace(with_body_of(nominal, one.result.chosen.fit.model), mass=nominal.mass)


def with_body_of(nominal: Model, model: Model, kept: bool = False) -> Model:
    """A path of a joint with the values of the body as its `nominal` path has them, or with its own `kept` and those that it lacks.

    Its inertia is that which the balance has subtracted from what the body asks for; it stays free where it is.
    """
    inertia = replace(nominal.mass, fixed=model.mass.fixed)
    given, own = nominal.term(BODY), model.term(BODY)
    if given is None or own is None:
        return replace(model, mass=inertia)
    if kept:
        known = {name: value for name, value in own.values.items() if name in given.values}
        given = replace(given, values={**given.values, **known})
    terms = tuple(given if term.label == BODY else term for term in model.terms)
    return replace(model, mass=inertia, terms=terms)


def shared_estimate(
    balances: JointBalances, found: Mapping[str, JointResult], parameter: str, shown: JointResult, own: Estimate
) -> Estimate:  # fmt: skip
    """A value of a link from all joints that feel it; `own` is that of the joint `shown`, whose search has found it.

    Where the other joints contradict it, they do not mean the same, and the joint's own value is returned.
    """
    others = [
        made
        for joint, one in found.items()
        if joint != shown.joint and parameter in balances.links(joint)
        if (made := _estimate(balances, one, f"{BODY}.{parameter}")) is not None
    ]
    if not own.std or not others:
        return own
    weights = [std**-2 for _, std in others]
    rest = sum(w * value for w, (value, _) in zip(weights, others, strict=True)) / sum(weights)
    freedom = max(len(others) - 1, 1)
    scatter = sum(w * (value - rest) ** 2 for w, (value, _) in zip(weights, others, strict=True)) / freedom
    # the scatter between the joints widens their mean (R. T. Birge, Phys. Rev. 40 (1932) 207)
    std = math.sqrt(max(scatter, 1.0) / sum(weights))
    if abs(rest - own.value) > CONTRADICTS * math.hypot(std, own.std):
        return own
    both = own.std**-2 + std**-2
    return replace(own, value=(own.value / own.std**2 + rest / std**2) / both, std=both**-0.5)


def _estimate(balances: JointBalances, one: JointResult, label: str) -> tuple[float, float] | None:
    """Value of a parameter of the body at a joint, and its standard deviation; None where the joint says nothing of it."""
    balance = balances.balance(one.joint, one.late)
    model = with_freed(own_path(balances, one), [label])
    chosen = one.result.chosen
    priors = {name: prior for name, prior in chosen.priors.items() if not name.startswith(f"{BODY}.")}
    _, columns = linearise(balance, model, [label], chosen.fit.alignment)
    priors[label] = Prior(model.value(label), widest(balance, columns[:, 1]))
    fit = fit_effort(balance, model, None, priors, alignment=chosen.fit.alignment)
    if label not in fit.names:
        return None
    place = 1 + fit.names.index(label)
    std = float((fit if fit.at_limit[place] else with_robust_std(fit, balance.record)).std[place])
    if not 0.0 < std < math.inf:
        return None
    return fit.model.value(label), std


def weight_of_joints(
    before: Mapping[str, JointResult], after: Mapping[str, JointResult], joints: Collection[str]
) -> float:
    """Log odds that these joints together give the searches `after` a value of the body was changed against those `before`.

    A joint that frees a value of the body again speaks for another value, not for this one. So the best hypotheses of effects of
    the joints themselves are compared, and each side also has the effects that the search on the other side has found.
    """
    total = 0.0
    for joint in joints:
        if joint in before and joint in after:
            sides = before[joint], after[joint]
            hypotheses = [fit for one in sides for fit in (one.result.nominal, _of_effects(one))]
            at = [(one.case.nominal, one.result.search.balance) for one in sides]
            total += gain_of(before[joint], hypotheses, *at)
    return total


def _of_effects(one: JointResult) -> Fitted:
    """The hypothesis of a joint that predicts best among those that free no value of the body."""
    found = [
        fit for fit in one.result.search.hypotheses if not any(e.startswith(f"{BODY}.") for e in fit.elements)
    ]
    score = {h.elements: h.prediction.score for h in one.result.contest.hypotheses}
    return max(found, key=lambda fit: score[fit.elements])


def _of_own_link(one: JointResult, link: str, balances: JointBalances) -> list[Fitted]:
    """The hypotheses of a joint that free one value of the link that it turns; none where this is the `link` itself."""
    body = balances.machine.body
    own = tuple(f"{BODY}.{name}." for name in body.links if name != link and body.joint_of(name) == one.joint)
    return [
        fit
        for fit in one.result.search.hypotheses
        if len(fit.elements) == 1 and fit.elements[0].startswith(own)
    ]


def weight_of_values(
    found: Mapping[str, JointResult], before: JointBalances, after: JointBalances, joints: Collection[str], link: str | None = None,
) -> float:  # fmt: skip
    """Log odds that these joints together give the values of the body `after` against those `before`, with the effects found at them.

    Where the values are those of one `link`, a joint that needs another value of the link that it turns, whichever of the two is right, has it:
    what is left of its effort only until its own link is corrected is no evidence for the link that is carried.
    """
    total = 0.0
    for joint in joints:
        one = found[joint]
        sides = [(side.models[joint], side.balance(joint, one.late)) for side in (before, after)]
        plain = [one.result.nominal, _of_effects(one)]
        own = [] if link is None else _of_own_link(one, link, before)
        scores = _net_scores(one, [*plain, *own], sides) if own else None
        if scores is not None and (scores.argmax(axis=1) >= len(plain)).all():
            total += float(scores[1].max() - scores[0].max())
        else:
            total += gain_of(one, plain, *sides)
    return total


def parts_of(one: JointResult) -> list[Fitted]:
    """The hypotheses of a joint that a cause beside it may leave: those whose effects are part of the chosen ones or of the best ones without a
    value of the body, the nominal path among them. A longer delay is no such effect."""
    wholes = [set(one.result.chosen.elements), set(_of_effects(one).elements)]
    return [
        fit
        for fit in one.result.search.hypotheses
        if INPUT_DELAY not in fit.elements and any(set(fit.elements) <= whole for whole in wholes)
    ]


def gain_of(
    one: JointResult,
    hypotheses: Sequence[Fitted],
    before: tuple[Model, Balance],
    after: tuple[Model, Balance],
) -> float:
    """Log odds of a joint for the values of the body `after` against those `before`, each a nominal path and its balance.

    Each side has the best of these hypotheses, of which an effect costs what any addition has to gain in a search: a value of a link
    that needs another effect at a joint beside it explains less than one that needs none.
    """
    scores = _net_scores(one, hypotheses, (before, after))
    return 0.0 if scores is None else float(scores[1].max() - scores[0].max())


def _net_scores(
    one: JointResult, hypotheses: Sequence[Fitted], sides: Sequence[tuple[Model, Balance]]
) -> Array | None:
    """Log scores (sides, hypotheses) less the price of the effects; None where the sides do not have the same rows."""
    fits = [_moved(fitted, *side).linearised for side in sides for fitted in hypotheses]
    if len({len(fit.residual) for fit in fits}) > 1:
        return None
    price = decisive(one.result.contest.candidates)
    search = one.result.search
    scores = [each.score for each in predict(fits, search.blocks, search.balance.record)]
    prices = [price * len(fitted.elements) for fitted in hypotheses]
    return np.reshape(scores, (len(sides), len(hypotheses))) - np.array(prices)


def _moved(fitted: Fitted, nominal: Model, balance: Balance) -> Fitted:
    """A hypothesis about a joint, fitted again with other values of the body: those of a nominal path and its balance."""
    model = fitted.fit.model
    made = with_body_of(nominal, model)
    if not model.mass.fixed:
        made = replace(made, mass=replace(made.mass, value=max(model.mass.value, made.mass.bounds[0])))
    names = [name for name in fitted.fit.names if name in model.parameters]
    fit = fit_effort(balance, made, names, fitted.priors, alignment=fitted.fit.alignment)
    return Fitted.of(fitted.elements, fitted.kind, fit, fitted.priors, balance)
