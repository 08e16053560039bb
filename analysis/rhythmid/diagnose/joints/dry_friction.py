"""Dry friction beside a cause of the machine as a whole: nearly every gear has it, and an unknown weight may hide it from the search of a joint."""

import math

from rhythmid.diagnose.effort.candidate import extended, priors_of_effect, starts_of
from rhythmid.diagnose.effort.fitted import Fitted
from rhythmid.diagnose.effort.scales import scales_of
from rhythmid.diagnose.joints.joint_case import JointResult
from rhythmid.diagnose.joints.link_evidence import laws_of, parts_of
from rhythmid.identify.inverse_dynamics.estimate import fit_effort

DRY = "coulomb_friction"


def with_dry_friction(one: JointResult) -> list[Fitted]:
    """The nominal path of a joint with dry friction; none where the search has fitted that, or the path has it, or the catalogue lacks it."""
    nominal, balance = one.result.nominal, one.result.search.balance
    if any(fit.elements == (DRY,) for fit in one.result.search.hypotheses):
        return []
    model, aligned = nominal.fit.model, nominal.fit.alignment
    starts = starts_of(one.case.catalogue, model, scales_of(balance, model), balance)
    start = next((start for start in starts if start.name == DRY), None)
    if start is None:
        return []
    model, label = extended(model, start)
    added = priors_of_effect(balance, model, label, aligned)
    if any(not 0.0 < prior.std < math.inf for prior in added.values()):
        return []
    priors = {**nominal.priors, **added}
    names = [name for name in model.free if name in priors]
    fit = fit_effort(balance, model, names, priors, alignment=aligned)
    return [Fitted.of((label,), "effects", fit, priors, balance)]


def laws_found(one: JointResult) -> list[Fitted]:
    """The laws that a cause may leave at a joint: those of its `parts_of` that free no value of the body, and dry friction."""
    laws, parts = laws_of(one), parts_of(one)
    return [fit for fit in laws if fit in parts or fit.elements == (DRY,)] + with_dry_friction(one)


def dry_in_place(one: JointResult, law: Fitted) -> Fitted:
    """Dry friction in place of another single law of friction; any other hypothesis as it is."""
    terms = [law.fit.model.term(label) for label in law.elements]
    if len(terms) != 1 or terms[0] is None or terms[0].element.family != "friction":
        return law
    return next((fit for fit in laws_found(one) if fit.elements == (DRY,)), law)
