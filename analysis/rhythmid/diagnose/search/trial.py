"""Trials: candidate models, proposals to fit, and results of fits."""

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from rhythmid.elements.element import Element
from rhythmid.identify.descent import Descent
from rhythmid.identify.free_run import FreeRun
from rhythmid.identify.noise import NoiseModel
from rhythmid.identify.start_cost import felt_starts, start_cost
from rhythmid.model import Model
from rhythmid.simulation.compiled import compile_model

Array = NDArray[np.float64]
RIVALS_COMPARED = 4  # models of each number of effects that are compared at the end of a search
FAINTER = (0.1, 0.01)  # shares of a guess that are tried where the guess itself does not help


@dataclass(frozen=True)
class Trial:
    """A fitted candidate model: its structure, the additions to the nominal model, and the quality of the fit."""

    added: tuple[str, ...]
    model: Model
    starts: tuple[Array, ...]
    chi2: float
    samples: int
    free: int
    converged: bool
    noise: NoiseModel  # noise model of chi2
    # difference steps of its sensitivities, for parameters and for states
    differences: tuple[Array, Array] | None = None
    start_cost: float = 0.0  # cost of the free initial states of its elements

    @property
    def key(self) -> tuple[str, ...]:
        """The added elements in alphabetical order, equal for equal structures."""
        return tuple(sorted(self.added))

    def bic(self) -> float:
        """Bayesian information criterion (G. Schwarz, Ann. Stat. 6 (1978) 461), plus the cost of free initial states."""
        return self.chi2 + self.free * math.log(max(self.samples, 2)) + self.start_cost

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the added elements; of a freed value its own."""
        terms = ((label, self.model.term(label)) for label in self.added)
        return tuple(label if term is None else term.element.name for label, term in terms)

    def element(self, label: str) -> Element:
        """The model's element with a label; KeyError if there is none."""
        term = self.model.term(label)
        if term is None:
            raise KeyError(label)
        return term.element

    def without(self, *labels: str) -> "Trial":
        """A start without these effects, and without those that need one of them; its other fields are still those of the whole fit."""
        model = self.model
        for label in labels:
            model = model.pruned(label)
        kept = (one for one in self.added if one not in labels and model.term(one) is not None)
        return replace(self, added=tuple(kept), model=model)


@dataclass(frozen=True)
class Origin:
    """A fitted model from which fits of other structures begin.

    Parameters
    ----------
    starts : initial state of each series, in the order of the state names.
    states : names of the states.
    steps : difference steps of its sensitivities, by name of parameter or state; other structures reuse them.
    """

    starts: tuple[Array, ...]
    states: tuple[str, ...]
    steps: Mapping[str, float] = field(default_factory=dict)

    @classmethod
    def of(cls, trial: Trial) -> "Origin":
        """The origin given by a trial."""
        states = compile_model(trial.model).layout.states
        steps = {} if trial.differences is None else steps_by_name(trial.model, states, trial.differences)
        return cls(trial.starts, states, steps)


def steps_by_name(
    model: Model, states: Sequence[str], differences: tuple[Array, Array], without: Collection[str] = ()
) -> dict[str, float]:
    """Difference steps of a model's free parameters and states by name, except for the names in `without`."""
    every = zip((*model.free, *states), np.concatenate(differences).tolist(), strict=True)
    return {name: step for name, step in every if name not in without}


@dataclass(frozen=True)
class Outcome:
    """The result of a fit in plain numbers, as returned by a worker.

    `values` holds all parameters, because guesses may differ in fixed ones, too.
    """

    values: dict[str, float]
    free: int
    starts: tuple[Array, ...]
    chi2: float
    samples: int
    converged: bool
    differences: tuple[Array, Array]
    start_cost: float


def outcome_of(end: Descent, run: FreeRun, noise: NoiseModel) -> Outcome:
    """The result of a descent of a structure over a run, under a noise model."""
    values = {name: value.value for name, value in end.model.parameters.items()}
    cost = start_cost(felt_starts(end.model, run, noise, end.starts, end.residuals, end.differences[1]))
    return Outcome(
        values, len(end.model.free), end.starts, end.chi2, end.samples, end.converged, end.differences, cost
    )


def trial_of(added: tuple[str, ...], model: Model, done: Outcome, noise: NoiseModel) -> Trial:
    """The trial of a structure with this result."""
    fitted = model.with_values(done.values)
    return Trial(
        added,
        fitted,
        done.starts,
        done.chi2,
        done.samples,
        done.free,
        done.converged,
        noise,
        done.differences,
        done.start_cost,
    )


@dataclass(frozen=True)
class Proposal:
    """A structure to try: the model with the added elements, and several first guesses (values by parameter name).

    `ceiling` is the chi2 of a model that it contains, if known. `faint` are guesses close to that model.
    """

    added: tuple[str, ...]
    model: Model
    guesses: tuple[dict[str, float], ...] = ({},)
    ceiling: float = math.inf
    faint: tuple[dict[str, float], ...] = ()

    @property
    def key(self) -> tuple[str, ...]:
        """The added elements in alphabetical order, equal for equal structures."""
        return tuple(sorted(self.added))


def propose(
    base: Model,
    element: Element,
    guesses: Sequence[dict[str, float]],
    added: tuple[str, ...],
    ceiling: float = math.inf,
    beside: Sequence[dict[str, float]] = (),
) -> Proposal:
    """The base model, whose chi2 is `ceiling`, with one more element.

    `guesses` are values of the element's parameters; `beside` are values of the model's own parameters for each guess.
    """
    extended = base.with_element(element, guesses[0])
    label = extended.terms[-1].label

    def named(guess: dict[str, float]) -> dict[str, float]:
        return {f"{label}.{name}": value for name, value in guess.items()}

    faint = [element.scaled(guesses[0], share) for share in FAINTER] if element.size else []
    own = [*beside, *({} for _ in guesses[len(beside) :])]
    begun = tuple(named(guess) | values for guess, values in zip(guesses, own, strict=True))
    return Proposal((*added, label), extended, begun, ceiling, tuple(map(named, faint)))


def contenders(trials: Mapping[tuple[str, ...], Trial], best: Trial) -> list[Trial]:
    """The models to compare at the end, against which each effect's contribution is judged.

    They are the nominal model, the best of each number of effects, and the chosen model with its effects left out.
    """
    ranked = sorted(trials.values(), key=lambda t: t.bic())
    kept = {t.key: t for t in [trials[()], best]}
    for count in {len(t.added) for t in ranked if t.added}:
        same = [t for t in ranked if len(t.added) == count][:RIVALS_COMPARED]
        kept = {t.key: t for t in same} | kept
    parts = {key: t for key, t in trials.items() if set(key) < set(best.added)}
    return list((parts | kept).values())
