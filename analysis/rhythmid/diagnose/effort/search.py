"""Forward search for missing effects by the recorded effort: from the nominal model, add the best further effect in turn.

All hypotheses predict the same rows of effort. Related laws (one family, or one a special case of the other) compete for one
place: an addition replaces a related law instead of standing beside it.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from rhythmid.deadline import SPENT, time_is_up, without_deadline
from rhythmid.diagnose.case import Budget
from rhythmid.diagnose.constants import PRACTICAL_EFFORT
from rhythmid.diagnose.effort.beyond_gain import beyond_gain, recorded_efforts
from rhythmid.diagnose.effort.candidate import (
    Screened,
    Start,
    extended,
    late_start,
    not_tried,
    priors_of_effect,
    screen,
    starts_of,
    widest,
)
from rhythmid.diagnose.effort.fitted import Fitted, kind_of
from rhythmid.diagnose.effort.kin import at_values_of, contained, kin, represented, shortlist
from rhythmid.diagnose.effort.reference import Mapped, reference_of
from rhythmid.diagnose.effort.scales import scales_at, scales_of
from rhythmid.diagnose.evidence import Blocks, predict
from rhythmid.diagnose.hypothesis import Hypothesis, Prediction
from rhythmid.diagnose.rejections import AT_END, SHAPES, Claim, keeps_shape, rejections_of
from rhythmid.diagnose.shape import shape_of
from rhythmid.elements.catalogue import Catalogue
from rhythmid.elements.element import Element
from rhythmid.identify.inverse_dynamics.balance import Balance
from rhythmid.identify.inverse_dynamics.estimate import (
    Alignment,
    fit_effort,
    linearise,
    priors_of,
    variation_of,
)
from rhythmid.model import Model
from rhythmid.progress import Tell
from rhythmid.record.record import Record
from rhythmid.simulation.transport import INPUT_DELAY
from rhythmid.value import Prior

Array = NDArray[np.float64]
MOST_EFFECTS = 4  # effects that are sought: on the recordings tried, a fifth effect was never real
GAP = 3  # rows between blocks: the length over which the effort filter mixes neighbours (impulse response about 1 / cut-off, 2.5 rows)


@dataclass(frozen=True, eq=False)
class EffortSearch:
    """The result of the search.

    Attributes
    ----------
    balance : rows and motions that all hypotheses share.
    nominal : the nominal model with its free values fitted.
    hypotheses : all fitted hypotheses, including the nominal one.
    ruled_out : fitted hypotheses that explain no motion.
    chosen, beyond : the hypothesis with which the search ended, and the same with free curves over the motion.
    not_tried : candidates that were not tried, by name, with the reason; including those that the budget cut off.
    candidates : number of effects that were tried.
    cut_short : whether the budget ended the search.
    """

    balance: Balance
    blocks: Blocks
    nominal: Fitted
    hypotheses: tuple[Fitted, ...]
    ruled_out: tuple[Fitted, ...]
    chosen: Fitted
    beyond: Mapped
    not_tried: Mapping[str, str]
    candidates: int
    cut_short: bool = False


@threadpool_limits.wrap(limits=1)  # many small matrices: threads would wait for each other
def search_effort(
    records: Sequence[Record],
    model: Model,
    catalogue: Catalogue,
    balance: Balance | None = None,
    most: int = MOST_EFFECTS,
    tell: Tell = lambda _: None,
    budget: Budget | None = None,
    promising: float | None = None,
) -> EffortSearch:
    """Search for what the model lacks to predict the recorded effort.

    With `promising`, an addition is fitted only if its score test predicts at least this gain of log likelihood; with many
    joints most of them lack nothing. Raises InputError where no effort was recorded or the motion is too small.
    """
    balance = balance or Balance.of(records, model)
    names = balance.estimated(model)
    _, jacobian = linearise(balance, model, names, 0.0)
    priors = priors_of(balance, model, names, jacobian[:, 1:])
    with without_deadline():  # the reference for all comparisons
        nominal = Fitted.of((), "nominal", fit_effort(balance, model, names, priors), priors, balance)
    blocks = Blocks.of(balance.record, GAP)
    search = _Search(
        balance, catalogue, blocks, nominal, reference_of(balance, nominal, blocks), [nominal], promising,
        recorded_efforts(records, model),
    )  # fmt: skip
    chosen, budget = nominal, budget or Budget()
    for number in range(most):
        if budget.spent:
            search.cut.update(search.cut_off(chosen))
            break
        tell(f"looking for effect {number + 1} in the effort")
        better = search.further(chosen)
        if better is None:
            break
        chosen = better
    for beside in search.at_end:  # after the steps, of which each fits only what is not known
        search.in_parts(*beside)
    made = search.predicted(search.found)
    best = search.found[max(range(len(made)), key=lambda index: made[index].score)]
    for one in (chosen, best) if best is not chosen else (chosen,):
        search.reduce(one)
    untried = not_tried(catalogue, model, scales_of(balance, model), balance) | search.cut
    return EffortSearch(
        balance, blocks, nominal, tuple(search.found), search.set_aside, chosen, reference_of(balance, chosen, blocks),
        untried, len(search.tried), bool(search.cut),
    )  # fmt: skip


@dataclass(eq=False)
class _Search:
    """The state of a search; `found` holds all hypotheses fitted so far."""

    balance: Balance
    catalogue: Catalogue
    blocks: Blocks
    nominal: Fitted
    reference: Mapped  # the nominal model with a free map beside it
    found: list[Fitted]
    promising: float | None = None
    recorded: Array | None = None  # at their own stamps
    tried: set[str] = field(default_factory=set)
    ruled_out: list[Fitted] = field(default_factory=list)
    at_end: list[tuple[Fitted, Element]] = field(default_factory=list)  # with what such a law was added to
    cut: dict[str, str] = field(default_factory=dict)  # not tried for lack of time

    @property
    def set_aside(self) -> tuple[Fitted, ...]:
        """Hypotheses that were ruled out, one of each structure, unless another fit of that structure was kept."""
        kept = {one.key: one for one in self.ruled_out if not self._known(one)}
        return tuple(kept.values())

    def predicted(self, hypotheses: Sequence[Fitted | Mapped]) -> list[Prediction]:
        """Predictions of these hypotheses, or of free maps, on the same rows."""
        return predict([one.linearised for one in hypotheses], self.blocks, self.balance.record)

    def cut_off(self, parent: Fitted) -> dict[str, str]:
        """What is not tried after the budget is spent: all candidates, or further effects beside those of the parent."""
        if parent.elements:
            return {f"further effects beside {' and '.join(parent.elements)}": SPENT}
        return {one.name: SPENT for one in self._starts(parent.fit.model)}

    def _starts(self, model: Model) -> list[Start]:
        """First guesses of all additions to a model, by the scales of the records."""
        return starts_of(self.catalogue, model, scales_of(self.balance, model), self.balance)

    def further(self, parent: Fitted) -> Fitted | None:
        """The best model with one more effect, or with a related law in place of one; None where a rule rejects it."""
        sizes = scales_at(self.balance, parent.fit)
        starts = starts_of(self.catalogue, parent.fit.model, sizes, self.balance)
        screened = screen(self.balance, parent.fit, starts)
        self.tried.update(one.start.name for one in screened)
        tried = len(screened)
        new: list[Fitted] = []
        for one in self._promising(shortlist(screened), parent):
            if time_is_up():
                self.cut[one.start.name] = SPENT
                continue
            for base in self._bases(parent, one.start):
                fitted = self.fitted(base, one)
                if fitted is None or self._known(fitted):
                    continue
                (new if keeps_shape(fitted.shape) else self.ruled_out).append(fitted)
                if one.start.element is not None and fitted.shape[AT_END] < SHAPES[AT_END]:
                    self.at_end.append((base, one.start.element))
        if not new:
            return None
        new = self._nearer(new)
        self.found.extend(new)
        *others, before, start, free = self.predicted([*new, parent, self.nominal, self.reference])
        order = sorted(range(len(new)), key=lambda index: -others[index].score)
        claimed = [one.claimed(prediction) for one, prediction in zip(new, others)]

        def claim(index: int, without: Hypothesis, simpler: Hypothesis | None = None) -> Claim:
            return Claim(
                claimed[index], without, self.nominal.claimed(start), free.mean_square, tried, variation_of(self.balance),
                PRACTICAL_EFFORT, simpler,
            )  # fmt: skip

        best = represented(claimed, order, claim)
        return None if rejections_of(claim(best, parent.claimed(before))) else new[best]

    def _nearer(self, new: Sequence[Fitted]) -> list[Fitted]:
        """Refit simpler laws contained in the best hypothesis from its values, and keep the better prediction of the two.

        A simpler law may have ended in another minimum that fits as well but predicts worse.
        """
        scores = [one.score for one in self.predicted(new)]
        best = new[max(range(len(new)), key=scores.__getitem__)]
        found = list(new)
        for place, plain in enumerate(new):
            model = at_values_of(best, plain)
            if model is not None and not time_is_up():
                aligned = self._aligned(plain.elements)
                made = self._fit(plain.elements, model, plain.priors, aligned, best.fit.alignment)
                again = self.predicted([*new, made])[-1]
                found[place] = made if again.score > scores[place] else plain
        return found

    def _promising(self, shortlist: Sequence[Screened], parent: Fitted) -> list[Screened]:
        """The additions that are worth a fit. A longer delay is if the effort precedes the motion by more than the uncertainty of the stamps."""
        if self.promising is None:
            return list(shortlist)
        least = self.promising * parent.fit.correlation
        late = parent.fit.alignment > Alignment.of(self.balance).std
        return [one for one in shortlist if (late if one.start.kind == "delay" else one.gain > least)]

    def _bases(self, parent: Fitted, start: Start) -> list[Fitted]:
        """Base models for an addition.

        The parent, or where it holds related laws: the parent without them, and the parent that keeps those of them that do not
        contain the addition. A machine may have both a constant friction and one that grows with the load. A law that the addition
        needs stays, as the spring whose gap it is.
        """
        law = start.element
        if law is None:
            return [] if start.name in parent.elements else [parent]
        model = parent.fit.model
        terms = {label: term for label in parent.elements if (term := model.term(label)) is not None}
        near = [label for label, term in terms.items() if kin(term.element, law)]
        related = [label for label in near if model.pruned(label).lacking(law) is None]
        base = beside = parent
        for label in related:
            base = self.without(base, label)
            if contained(terms[label].element, law):
                beside = self.without(beside, label)
        return [base] if beside.elements == base.elements else [base, beside]

    def without(self, fitted: Fitted, label: str) -> Fitted:
        """The hypothesis without one of its additions, refitted; an existing fit of that structure is reused."""
        model = fitted.fit.model
        if model.term(label) is not None:
            model = model.pruned(label)
        elif label in model.parameters:  # a freed value becomes fixed again
            model = model.with_parameters({label: self.nominal.fit.model.parameters[label]})
        gone = {term.label for term in fitted.fit.model.terms} - {term.label for term in model.terms}
        rest = tuple(one for one in fitted.elements if one != label and one not in gone)
        known = next((f for f in self.found if set(f.elements) == set(rest)), None)
        if known is not None:
            return known
        priors = {
            name: prior
            for name, prior in fitted.priors.items()
            if name != label and not name.startswith(f"{label}.")
        }
        return self._fit(rest, model, priors, self._aligned(rest), fitted.fit.alignment)

    def reduce(self, fitted: Fitted) -> None:
        """Backward elimination: fit a hypothesis without each of its effects, and with simpler laws in their place.

        Beside effects that were found later the simpler law may suffice.
        """
        for label in fitted.elements if len(fitted.elements) > 1 else ():
            if time_is_up():
                self.cut["backward elimination"] = SPENT
                break
            base = self.without(fitted, label)
            self._keep(base)
            term = fitted.fit.model.term(label)
            if term is not None:
                self._simplify(base, term.element)

    def in_parts(self, base: Fitted, law: Element) -> None:
        """Fit the base with the effects that together are a law at the end of its range."""
        made: Fitted | None = base
        for name in law.beyond:
            if made is not None and all(name != t.element.name for t in made.fit.model.terms):
                starts = [one for one in self._starts(made.fit.model) if one.name == name]
                screened = screen(self.balance, made.fit, starts)
                made = self.fitted(made, screened[0]) if screened else None
        self._keep(made or base)

    def _keep(self, fitted: Fitted) -> None:
        if not self._known(fitted):
            (self.found if keeps_shape(fitted.shape) else self.ruled_out).append(fitted)

    def _simplify(self, base: Fitted, element: Element) -> None:
        """Fit the base with each simpler law that the element contains."""
        simpler = [
            start
            for start in self._starts(base.fit.model)
            if start.element is not None and element.name in start.element.special_case_of
        ]
        for one in screen(self.balance, base.fit, simpler):
            made = self.fitted(base, one)
            if made is not None:
                self._keep(made)

    def fitted(self, base: Fitted, one: Screened) -> Fitted | None:
        """The base with an addition, all parameters refitted from its first guess."""
        start, balance = one.start, self.balance
        alignment, aligned = base.fit.alignment, self._aligned(base.elements)
        model, label = extended(base.fit.model, start, one.factor)
        priors = dict(base.priors)
        if start.kind == "delay":
            aligned, alignment = late_start(balance, base.fit)
        elif start.element is None:
            _, columns = linearise(balance, base.fit.model, [start.name], alignment)
            priors[start.name] = Prior(base.fit.model.value(start.name), widest(balance, columns[:, 1]))
        else:
            priors |= priors_of_effect(balance, model, label, alignment)
        if any(not math.isfinite(prior.std) or prior.std <= 0.0 for prior in priors.values()):
            return None
        return self._fit((*base.elements, label), model, priors, aligned, alignment)

    def _shape(self, model: Model, elements: Sequence[str]) -> dict[str, float]:
        """Statistics of a fitted model's effects by the name of the rule that uses them."""
        sizes = scales_of(self.balance, model)
        shape = shape_of(model, elements, sizes)
        laws = [one for one in elements if (term := model.term(one)) and term.element.slot == "actuator"]
        if not laws:
            return shape
        shape["moves_the_machine"] = min(self._left(model, label) for label in laws)
        if self.recorded is not None:
            required = np.concatenate(self.balance.required(model))
            gains = (beyond_gain(model, label, sizes, self.recorded, required) for label in laws)
            shape["more_than_gain"] = min(gains)
        return shape

    def _left(self, model: Model, label: str) -> float:
        """Share of the effort that an actuator's effect leaves to move the machine: that which a fitted model requires without it, of
        that which the nominal one does."""
        left, before = (
            float(np.linalg.norm(self.balance.predicted(one, 0.0)))
            for one in (model.pruned(label), self.nominal.fit.model)
        )
        return left / before if before > 0.0 else math.inf

    def _fit(
        self, elements: tuple[str, ...], model: Model, priors: dict[str, Prior], aligned: Alignment, at: float
    ) -> Fitted:
        fit = fit_effort(self.balance, model, [n for n in model.free if n in priors], priors, aligned, at)
        made = Fitted.of(elements, kind_of(elements, model), fit, priors, self.balance)
        return replace(made, shape=self._shape(fit.model, elements))

    def _aligned(self, elements: Sequence[str]) -> Alignment:
        if INPUT_DELAY not in elements:
            return Alignment.of(self.balance)
        return late_start(self.balance, self.nominal.fit)[0]

    def _known(self, fitted: Fitted) -> bool:
        return any(one.key == fitted.key for one in self.found)
