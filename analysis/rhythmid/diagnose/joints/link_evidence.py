"""A value of a link is the same for all joints that it moves: its estimate from all of them, and the evidence of all of them for it.

Each joint is judged with the effects that were found at that joint, because a friction that is not explained looks like any value.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rhythmid.body.body import BODY
from rhythmid.diagnose.effort.fitted import Fitted
from rhythmid.diagnose.evidence import difference, predict
from rhythmid.diagnose.hypothesis import Prediction
from rhythmid.diagnose.joints.joint_case import JointResult
from rhythmid.diagnose.rejections import decisive
from rhythmid.identify.inverse_dynamics.balance import Balance
from rhythmid.identify.inverse_dynamics.estimate import fit_effort
from rhythmid.identify.joints.joint_motion import JointBalances
from rhythmid.model import Model
from rhythmid.simulation.transport import INPUT_DELAY

Array = NDArray[np.float64]


def own_path(balances: JointBalances, one: JointResult) -> Model:
    """The path of a joint with the effects found there, and with the values of the body and of its rotor as they are given."""
    nominal = balances.models[one.joint]
    return replace(with_body_of(nominal, one.result.chosen.fit.model), mass=nominal.mass)


def with_body_of(nominal: Model, model: Model) -> Model:
    """A path of a joint with the values of the body as its `nominal` path has them.

    Its inertia is that which the balance has subtracted from what the body asks for; it stays free where it is.
    """
    inertia = replace(nominal.mass, fixed=model.mass.fixed)
    given = nominal.term(BODY)
    if given is None:
        return replace(model, mass=inertia)
    terms = tuple(given if term.label == BODY else term for term in model.terms)
    return replace(model, mass=inertia, terms=terms)


def _of_effects(one: JointResult) -> Fitted:
    """The hypothesis of a joint that predicts best among those that free no value of the body."""
    found = [
        fit for fit in one.result.search.hypotheses if not any(e.startswith(f"{BODY}.") for e in fit.elements)
    ]
    score = {h.elements: h.prediction.score for h in one.result.contest.hypotheses}
    return max(found, key=lambda fit: score[fit.elements])


def parts_of(one: JointResult) -> list[Fitted]:
    """The hypotheses of a joint that a cause beside it may leave: those whose effects are part of the chosen ones or of the best ones without a
    value of the body, the nominal path among them. A longer delay is no such effect."""
    wholes = [set(one.result.chosen.elements), set(_of_effects(one).elements)]
    return [
        fit
        for fit in one.result.search.hypotheses
        if INPUT_DELAY not in fit.elements and any(set(fit.elements) <= whole for whole in wholes)
    ]


def laws_of(one: JointResult) -> list[Fitted]:
    """The hypotheses of a joint that free no value of the body and have no longer delay, the nominal path among them."""
    return [
        fit
        for fit in one.result.search.hypotheses
        if INPUT_DELAY not in fit.elements and not any(e.startswith(f"{BODY}.") for e in fit.elements)
    ]


def gain_of(
    one: JointResult,
    hypotheses: Sequence[Fitted],
    before: tuple[Model, Balance],
    after: tuple[Model, Balance],
) -> tuple[float, Fitted]:
    """Log odds of a joint for the values of the body `after` against those `before`, each a nominal path and its balance, and what is best there.

    Each side has the best of these hypotheses, of which an effect costs what any addition has to gain in a search: a value of a link
    that needs another effect at a joint beside it explains less than one that needs none.
    """
    sides = [_moved(one, fitted, *side) for side in (before, after) for fitted in hypotheses]
    net = np.zeros(len(sides))
    if (predictions := _predictions(one, sides)) is not None:
        prices = [_price(one) * len(fitted.elements) for fitted in sides]
        net = np.array([each.score for each in predictions]) - np.array(prices)
    first = len(hypotheses)
    best = first + int(net[first:].argmax())
    return float(net[best] - net[:first].max()), sides[best]


def advantage(one: JointResult, first: Fitted, second: Fitted) -> tuple[float, float]:
    """Log odds of a joint for the first of two hypotheses against the second, beside different values of the body, and their standard error
    from the blocks of the records."""
    predictions = _predictions(one, [first, second])
    if predictions is None:
        return 0.0, 0.0
    gain, error = difference(*predictions)
    return gain - _price(one) * (len(first.elements) - len(second.elements)), error


def _predictions(one: JointResult, fits: Sequence[Fitted]) -> list[Prediction] | None:
    """What hypotheses about a joint predict; None where they do not have the same rows."""
    linearised, search = [fitted.linearised for fitted in fits], one.result.search
    if len({len(fit.residual) for fit in linearised}) > 1:
        return None
    return predict(linearised, search.blocks, search.balance.record)


def _price(one: JointResult) -> float:
    """What an effect of a joint's search has to gain [nat]."""
    return decisive(one.result.contest.candidates)


def _moved(one: JointResult, fitted: Fitted, nominal: Model, balance: Balance) -> Fitted:
    """A hypothesis about a joint, fitted again where a nominal path and its balance have other values of the body than the joint's search had."""
    if balance is one.result.search.balance:
        return fitted
    model = fitted.fit.model
    made = with_body_of(nominal, model)
    if not model.mass.fixed:
        made = replace(made, mass=replace(made.mass, value=max(model.mass.value, made.mass.bounds[0])))
    names = [name for name in fitted.fit.names if name in model.parameters]
    fit = fit_effort(balance, made, names, fitted.priors, alignment=fitted.fit.alignment)
    return Fitted.of(fitted.elements, fitted.kind, fit, fitted.priors, balance)
