"""Refit the model with candidate elements, everything free, and compare what they reach.

A comparison needs one noise model for all: it is estimated from what the best candidate leaves, because the effect
that is missing from the others must not be taken for coloured noise.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhythmid.elements.element import STEP, Element
from rhythmid.errors import InputError
from rhythmid.identify.free_run import FreeRun, prepare_run
from rhythmid.identify.noise import NoiseModel
from rhythmid.identify.output_error import Fit, minimise
from rhythmid.identify.series import Series
from rhythmid.model import Model
from rhythmid.parallel import fork_map
from rhythmid.simulate import start_states

Array = NDArray[np.float64]
BRIEF, THOROUGH = 6, 20  # iterations
PROMISING = 0.5  # share of the spread of chi2 within which a model is carried to convergence


@dataclass(frozen=True)
class Trial:
    """A candidate model, fitted: its structure, what was added to the nominal model, and how well it does."""

    added: tuple[str, ...]
    model: Model
    starts: tuple[Array, ...]
    chi2: float
    samples: int
    free: int
    converged: bool
    noise: NoiseModel  # under which chi2 was reached

    def bic(self, inflation: float = 1.0) -> float:
        """Bayesian information criterion (G. Schwarz, Ann. Stat. 6 (1978) 461); `inflation` >= 1 deflates chi2."""
        return self.chi2 / inflation + self.free * math.log(max(self.samples, 2))


@dataclass(frozen=True)
class _Outcome:
    """What a worker sends back of a fit: plain numbers."""

    values: dict[str, float]
    starts: tuple[Array, ...]
    chi2: float
    samples: int
    converged: bool


def _outcome(fit: Fit) -> _Outcome:
    values = {name: float(value) for name, value in zip(fit.names, fit.values)}
    return _Outcome(values, fit.starts, fit.chi2, fit.samples, fit.converged)


def _trial(added: tuple[str, ...], model: Model, done: _Outcome, noise: NoiseModel) -> Trial:
    fitted = model.with_values(done.values)
    return Trial(added, fitted, done.starts, done.chi2, done.samples, len(done.values), done.converged, noise)


@dataclass(frozen=True)
class Proposal:
    """A structure to try: the model with the elements in it, and several first guesses (values by parameter name)."""

    added: tuple[str, ...]
    model: Model
    guesses: tuple[dict[str, float], ...]


def propose(
    base: Model, element: Element, guesses: Sequence[dict[str, float]], added: tuple[str, ...]
) -> Proposal:
    """The base model with one more element; `guesses` are values of the element's own parameters."""
    extended = base.with_element(element, guesses[0])
    label = extended.terms[-1].label
    named = tuple({f"{label}.{name}": value for name, value in guess.items()} for guess in guesses)
    return Proposal((*added, label), extended, named)


def fine_enough(model: Model, step: float) -> float:
    """Integration step [s] for a model: shorter where an element asks for the step because it may be stiff."""
    stiff = any(source == STEP for term in model.terms for source, _ in term.element.borrows.values())
    return min(step, 1e-3 if stiff else step)


def _fit_proposal(
    proposal: Proposal,
    series: Sequence[Series],
    starts: Sequence[Array],
    known: Sequence[str],
    noise: NoiseModel,
    max_step: float,
    enough: float,
    iterations: int,
) -> _Outcome:
    """Fit a proposal from its guesses, starting in `starts` (whose states are `known` by name), stopping early once chi2 falls below `enough`.

    Raises InputError when the model diverges from every guess.
    """
    run = prepare_run(proposal.model, series, fine_enough(proposal.model, max_step))
    best: Fit | None = None
    failure: InputError | None = None
    for guess in proposal.guesses:
        model = proposal.model.with_values(guess)
        try:
            begin = [_extended(start, model, run, known) for start in starts]
            fit = minimise(model, run, tuple(model.free), noise, begin, iterations)
        except InputError as error:
            failure = error
            continue
        if best is None or fit.chi2 < best.chi2:
            best = fit
        if best.chi2 < enough:
            break
    if best is None:
        assert failure is not None
        raise failure
    return _outcome(best)


def _extended(start: Array, model: Model, run: FreeRun, known: Sequence[str]) -> Array:
    """A start for a structure with other states: those it shares are kept, new ones begin at rest."""
    fresh = start_states(model, run.compiled, float(start[0]), float(start[1]))
    for index, name in enumerate(run.compiled.layout.states):
        if name in known:
            fresh[index] = start[list(known).index(name)]
    return fresh


def run_trials(
    proposals: Sequence[Proposal],
    series: Sequence[Series],
    starts: Sequence[Array],
    known: Sequence[str],
    noise: NoiseModel,
    max_step: float,
    enough: Sequence[float] | None = None,
) -> tuple[list[Trial], list[tuple[tuple[str, ...], str]]]:
    """Fit all proposals in parallel. Returns the trials, best first, and those excluded with the reason.

    A few iterations from each guess first, until chi2 is `enough`; then the promising ones are carried to convergence.
    """
    goals = list(enough) if enough is not None else [-math.inf] * len(proposals)

    def one(case: tuple[Proposal, float]) -> _Outcome:
        return _fit_proposal(case[0], series, starts, known, noise, max_step, case[1], BRIEF)

    trials: list[Trial] = []
    excluded: list[tuple[tuple[str, ...], str]] = []
    for index, result in fork_map(one, list(zip(proposals, goals))):
        if isinstance(result, Exception):
            excluded.append((proposals[index].added, str(result)))
        else:
            trials.append(_trial(proposals[index].added, proposals[index].model, result, noise))
    if not trials:
        return [], excluded
    best = min(trial.chi2 for trial in trials)
    worst = max(trial.chi2 for trial in trials)
    open_ones = [
        t for t in trials if not t.converged and t.chi2 - best <= PROMISING * max(worst - best, t.samples)
    ]
    finished = under_noise(open_ones, series, noise, max_step, THOROUGH)
    done = {t.added for t in finished}
    return sorted([*finished, *(t for t in trials if t.added not in done)], key=lambda t: t.bic()), excluded


def whole_fit(
    trial: Trial,
    series: Sequence[Series],
    noise: NoiseModel,
    max_step: float,
    iterations: int = 15,
    pool=None,
) -> Fit:
    """The full fit of a trial under a noise model; one that has converged under it is only evaluated."""
    if trial.noise is noise and trial.converged:
        iterations = 1
    run = prepare_run(trial.model, series, fine_enough(trial.model, max_step))
    return minimise(trial.model, run, tuple(trial.model.free), noise, trial.starts, iterations, pool)


def under_noise(
    trials: Sequence[Trial],
    series: Sequence[Series],
    noise: NoiseModel,
    max_step: float,
    iterations: int = 15,
) -> list[Trial]:
    """The trials, best first, all under one noise model: those that were fitted under another are fitted again."""
    done = [trial for trial in trials if trial.noise is noise and trial.converged]
    others = [trial for trial in trials if not (trial.noise is noise and trial.converged)]

    def one(trial: Trial) -> _Outcome:
        return _outcome(whole_fit(trial, series, noise, max_step, iterations))

    again = [
        _trial(others[index].added, others[index].model, result, noise)
        for index, result in fork_map(one, others)
        if not isinstance(result, Exception)
    ]
    return sorted([*done, *again], key=lambda trial: trial.bic())
