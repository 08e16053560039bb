"""Output-error estimation in the time domain: parameters and initial states that make the free run fit the records.

The initial state of every series is a nuisance: it is eliminated from each Levenberg-Marquardt step by projection
(variable projection, G. H. Golub, V. Pereyra, SIAM J. Numer. Anal. 10 (1973) 413, in the form of L. Kaufman, BIT 15 (1975) 49),
so the normal equations stay as small as the number of parameters however many series there are.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rhythmid.errors import InputError
from rhythmid.identify.free_run import FreeRun, accurate, prepare_run
from rhythmid.identify.noise import NoiseModel, estimate_noise, runs
from rhythmid.identify.series import Series, dominant_frequency
from rhythmid.model import Model
from rhythmid.simulate import start_states

Array = NDArray[np.float64]
WHITE = NoiseModel(np.empty(0), 1.0)
Progress = Callable[[str], None]


@dataclass(frozen=True)
class Linearisation:
    """Whitened residual (n,) and its sensitivities to parameters (n, p), both with the initial states projected out;
    `bases` (one (n_s, q) orthonormal basis a series) span what initial states can do; `steps` are the differences used."""

    residual: Array
    jacobian: Array
    bases: tuple[Array, ...]
    pieces: tuple[slice, ...]
    steps: Array


@dataclass(frozen=True)
class Fit:
    """A fitted model.

    `values` (p,) of the parameters `names` with `covariance` (p, p); `starts` the state of each series at its first
    block; `residuals` simulated less measured block averages; `chi2` the whitened sum of squares over `samples`
    averages that were used. `converged` is False where the search stopped for another reason, told by `message`.
    """

    model: Model
    names: tuple[str, ...]
    values: Array
    covariance: Array
    starts: tuple[Array, ...]
    run: FreeRun
    residuals: tuple[Array, ...]
    noise: NoiseModel
    chi2: float
    samples: int
    converged: bool
    message: str
    linearisation: Linearisation
    at_bound: tuple[str, ...] = ()

    @property
    def std(self) -> dict[str, float]:
        """Standard deviation of each free parameter; infinite where the records do not determine it."""
        return {
            name: float(math.sqrt(v)) if v >= 0 else math.inf
            for name, v in zip(self.names, np.diag(self.covariance))
        }

    def nrmse(self, unused: bool = False) -> float:
        """rms(simulated − measured) / std(measured) over the averages used, or over the unused ones."""
        error, spread = 0.0, 0.0
        for one, residual in zip(self.run.series, self.residuals):
            mask = ~one.used if unused else one.used
            if not mask.any():
                continue
            measured = one.averaged
            error += float(np.sum(residual[mask] ** 2))
            spread += float(np.sum((measured[mask] - measured.mean()) ** 2))
        return math.sqrt(error / spread) if spread > 0 else math.nan


def first_guess(model: Model, run: FreeRun) -> list[Array]:
    """State at the first block of each series: position and slope of a straight line through its first samples."""
    found: list[Array] = []
    for one in run.series:
        span = 0.05 / max(dominant_frequency(one), 1e-9)
        n = int(np.clip(round(span / one.period), 3, len(one.time) // 4))
        slope, level = np.polyfit(one.time[:n] - one.time[0], one.value[:n], 1)
        found.append(start_states(model, run.compiled, float(level), float(slope)))
    return found


class _Problem:
    """One structure, its series and a noise model: residuals and their sensitivities."""

    def __init__(
        self, run: FreeRun, names: Sequence[str], noise: NoiseModel, pool: ThreadPoolExecutor | None
    ) -> None:
        self.run, self.names, self.noise, self.pool = run, tuple(names), noise, pool
        self.hidden: list[tuple[Array, Array]] = []  # mean and scatter of each series' element states
        self.spread = max(float(np.std(one.averaged)) for one in run.series) or 1.0
        self.stretches = [
            [s for s in runs(one.used) if s.stop - s.start > noise.order + 1] for one in run.series
        ]

    def whitened(self, index: int, samples: Array) -> Array:
        """Used stretches of series `index`, whitened and joined; (n,) or (n, q)."""
        parts = [self.noise.whiten(samples[s]) for s in self.stretches[index]]
        return np.concatenate(parts) if parts else samples[:0]

    def residuals(self, model: Model, starts: Sequence[Array]) -> list[Array] | None:
        outputs = self.run.outputs(model, starts)
        if outputs is None:
            return None
        return [output - one.averaged for output, one in zip(outputs, self.run.series)]

    def learn_hidden(self, model: Model, starts: Sequence[Array]) -> None:
        """Take the usual values of the elements' own states from a run.

        A hidden state hardly differs from a kick to the velocity when its element is fast; knowing its usual range keeps
        it from wandering off.
        """
        self.hidden = []
        for index, start in enumerate(starts):
            rows = self.run.rows(model, index, start)
            states = (
                rows[len(rows) // 4 :, 2 : self.run.states]
                if rows is not None
                else np.zeros((1, self.run.states - 2))
            )
            self.hidden.append((states.mean(axis=0), 3.0 * states.std(axis=0) + 1e-12))

    def departure(self, index: int, start: Array) -> Array:
        """Element states of a start, as multiples of their usual scatter from their usual mean."""
        mean, scatter = self.hidden[index]
        return (start[2:] - mean) / scatter

    def cost(self, model: Model, residuals: Sequence[Array] | None, starts: Sequence[Array]) -> float:
        if residuals is None:
            return math.inf
        total = sum(float(np.sum(self.whitened(i, r) ** 2)) for i, r in enumerate(residuals))
        total += sum(float(np.sum(self.departure(i, start) ** 2)) for i, start in enumerate(starts))
        for name in self.names:
            value = model.parameters[name]
            if value.prior is not None:
                total += ((value.value - value.prior.mean) / value.prior.std) ** 2
        return total if math.isfinite(total) else math.inf

    def _perturbed(
        self, model: Model, starts: Sequence[Array], signed: Array, state_steps: Array, columns: Sequence[int]
    ) -> list[list[Array] | None]:
        """Outputs with parameter or (from p on) initial state of each of the `columns` moved by its step."""
        cases: list[tuple[Model, Sequence[Array]]] = []
        for c in columns:
            if c < len(self.names):
                name = self.names[c]
                cases.append((model.with_values({name: model.value(name) + signed[c]}), starts))
            else:
                shift = np.zeros(self.run.states)
                shift[c - len(self.names)] = state_steps[c - len(self.names)]
                cases.append((model, [start + shift for start in starts]))
        return self.run.many(cases, self.pool)

    def settle_steps(
        self,
        model: Model,
        starts: Sequence[Array],
        residuals: Sequence[Array],
        steps: Array,
        state_steps: Array,
    ) -> tuple[Array, Array]:
        """Difference steps under which every parameter and state moves the outputs by about the same small amount.

        Their natural sizes span many powers of ten (a stiffness, a delay, a hidden state of an actuator).
        """
        base = [residual + one.averaged for residual, one in zip(residuals, self.run.series)]
        joint = np.concatenate([steps, state_steps])
        p = len(self.names)
        todo = list(range(len(joint)))
        for _ in range(4):
            signed = self._signed(model, joint[:p])
            outputs = self._perturbed(model, starts, signed, joint[p:], todo)
            again = []
            for c, case in zip(todo, outputs):
                if case is None:
                    joint[c] *= 1e-2
                    again.append(c)
                    continue
                moved = max(float(np.sqrt(np.mean((new - old) ** 2))) for new, old in zip(case, base))
                ratio = float(np.clip(1e-4 * self.spread / max(moved, 1e-30), 1e-4, 1e4))
                joint[c] *= ratio
                if not 0.1 < ratio < 10.0:
                    again.append(c)
            todo = again
            if not todo:
                break
        return joint[:p], joint[p:]

    def _signed(self, model: Model, steps: Array) -> Array:
        """Steps that stay within the parameters' bounds."""
        signed = steps.copy()
        for i, name in enumerate(self.names):
            value = model.parameters[name]
            low, high = value.bounds
            signed[i] = min(signed[i], 0.1 * (high - low))
            if value.value + signed[i] > high:
                signed[i] = -signed[i]
        return signed

    def linearise(
        self,
        model: Model,
        starts: Sequence[Array],
        residuals: Sequence[Array],
        steps: Array,
        state_steps: Array,
    ) -> tuple[Linearisation, list[tuple[Array, Array, Array]], Array, Array]:
        """Sensitivities by forward differences whose steps settle at a ten-thousandth of the motion.

        Returns the linearisation, each series' whitened residual and sensitivities to parameters and initial state, and the
        next steps.
        """
        signed = self._signed(model, steps)
        outputs = self._perturbed(
            model, starts, signed, state_steps, range(len(self.names) + self.run.states)
        )
        base = [residual + one.averaged for residual, one in zip(residuals, self.run.series)]
        p, q = len(self.names), self.run.states
        rows, columns, bases, states, places = [], [], [], [], []
        place = 0
        moved = np.zeros(p + q)
        for index, at in enumerate(base):
            change = np.zeros((len(at), p + q))
            for c, case in enumerate(outputs):
                if case is not None:
                    change[:, c] = case[index] - at
            moved = np.maximum(moved, np.sqrt(np.mean(change**2, axis=0)))
            change[:, :p] /= signed
            white = self.whitened(index, np.column_stack([residuals[index], change]))
            known = np.zeros((q - 2, 1 + p + q))
            known[:, 0] = self.departure(index, starts[index])
            known[:, 1 + p + 2 :] = np.diag(state_steps[2:] / self.hidden[index][1])
            joined = np.vstack([white, known])
            basis = _basis(joined[:, 1 + p :])
            projected = joined[:, : 1 + p] - basis @ (basis.T @ joined[:, : 1 + p])
            rows.append(projected[: len(white), 0])
            columns.append(projected[: len(white), 1:])
            bases.append(basis[: len(white)])
            states.append((joined[:, 0], joined[:, 1 : 1 + p], joined[:, 1 + p :]))
            places.append(slice(place, place + len(white)))
            place += len(white)
        target = 1e-4 * self.spread
        ratio = np.clip(target / np.maximum(moved, 1e-30), 1e-3, 1e3)
        linearisation = Linearisation(
            np.concatenate(rows), np.concatenate(columns), tuple(bases), tuple(places), signed
        )
        return linearisation, states, steps * ratio[:p], state_steps * ratio[p:]


def _state_update(sensitivity: Array, target: Array) -> Array:
    """Least-squares change of a series' initial state (in units of its difference steps)."""
    norms = np.linalg.norm(sensitivity, axis=0)
    live = norms > 1e-9 * max(norms.max(initial=0.0), 1e-300)
    change = np.zeros(sensitivity.shape[1])
    if live.any():
        change[live] = (
            np.linalg.lstsq(sensitivity[:, live] / norms[live], -target, rcond=1e-7)[0] / norms[live]
        )
    return change


def _basis(columns: Array) -> Array:
    """Orthonormal basis of the columns' span; dependent ones are dropped."""
    norms = np.linalg.norm(columns, axis=0)
    live = norms > 1e-9 * max(norms.max(initial=0.0), 1e-300)
    if not live.any():
        return np.zeros((len(columns), 0))
    left, singular, _ = np.linalg.svd(columns[:, live] / norms[live], full_matrices=False)
    return left[:, singular > 1e-7 * singular[0]]


def _first_steps(model: Model, names: Sequence[str], run: FreeRun) -> Array:
    steps = []
    for name in names:
        value = model.parameters[name]
        low, high = value.bounds
        size = abs(value.value)
        if size == 0.0:
            size = min(run.series[0].period, 1.0) if value.unit == "s" else 1e-2
            if math.isfinite(high) and math.isfinite(low):
                size = 0.1 * (high - low)
        steps.append(1e-4 * size)
    return np.array(steps)


def _step(jacobian: Array, residual: Array, damping: float, blocked: NDArray[np.bool_]) -> Array:
    """Levenberg-Marquardt step in the parameters that are not blocked at a bound."""
    free = ~blocked
    step = np.zeros(jacobian.shape[1])
    if not free.any():
        return step
    j = jacobian[:, free]
    norms = np.linalg.norm(j, axis=0)
    norms[norms == 0.0] = 1.0
    scaled = j / norms
    hessian = scaled.T @ scaled
    step[free] = -np.linalg.lstsq(
        hessian + damping * np.eye(len(hessian)), scaled.T @ residual, rcond=1e-13
    )[0] / norms  # fmt: skip
    return step


def minimise(
    model: Model,
    run: FreeRun,
    names: Sequence[str],
    noise: NoiseModel = WHITE,
    starts: Sequence[Array] | None = None,
    iterations: int = 30,
    pool: ThreadPoolExecutor | None = None,
    tolerance: float = 1e-3,
) -> Fit:
    """Levenberg-Marquardt from the model's own values.

    Stops when a further step would lower chi2 by less than `tolerance` (or by less than 1e-7 of itself). Raises
    InputError when the model diverges at its initial values.
    """
    problem = _Problem(run, names, noise, pool)
    current = [np.array(s) for s in (starts if starts is not None else first_guess(model, run))]
    problem.learn_hidden(model, current)
    residuals = problem.residuals(model, current)
    cost = problem.cost(model, residuals, current)
    if residuals is None or not math.isfinite(cost):
        raise InputError(
            "the model diverges when simulated over the records with its initial values; check its parameters and units"
        )
    steps = _first_steps(model, names, run)
    velocity = 2 * np.pi * max(dominant_frequency(one) for one in run.series) * problem.spread
    state_steps = 1e-4 * np.array([problem.spread, velocity, *([problem.spread] * (run.states - 2))])
    steps, state_steps = problem.settle_steps(model, current, residuals, steps, state_steps)
    damping, converged, message = 1e-6, False, f"no convergence in {iterations} iterations"
    low = np.array([model.parameters[name].bounds[0] for name in names])
    high = np.array([model.parameters[name].bounds[1] for name in names])
    priors = [model.parameters[name].prior for name in names]
    linearisation: Linearisation | None = None
    blocked = np.zeros(len(names), bool)
    for _ in range(iterations):
        linearisation, states, steps, state_steps_next = problem.linearise(
            model, current, residuals, steps, state_steps
        )
        jacobian, residual = linearisation.jacobian, linearisation.residual
        values = np.array([model.value(name) for name in names])
        weight = [(i, prior) for i, prior in enumerate(priors) if prior is not None]
        if weight:
            extra = np.zeros((len(weight), len(names)))
            for row, (i, prior) in enumerate(weight):
                extra[row, i] = 1.0 / prior.std
            jacobian = np.vstack([jacobian, extra])
            residual = np.concatenate(
                [residual, [(values[i] - prior.mean) / prior.std for i, prior in weight]]
            )
        gradient = jacobian.T @ residual
        blocked = ((values <= low) & (gradient > 0)) | ((values >= high) & (gradient < 0))
        improved = False
        for _ in range(12):
            step = _step(jacobian, residual, damping, blocked)
            proposed = np.clip(values + step, low, high)
            step = proposed - values
            trial = model.with_values(dict(zip(names, proposed)))
            moved = []
            for start, (error, slope, state) in zip(current, states):
                moved.append(start + _state_update(state, error + slope @ step) * state_steps)
            trial_residuals = problem.residuals(trial, moved)
            trial_cost = problem.cost(trial, trial_residuals, moved)
            if trial_cost < cost:
                gain = cost - trial_cost
                model, current, cost = trial, moved, trial_cost
                residuals = trial_residuals
                damping = max(damping * 0.1, 1e-12)
                improved = True
                if gain < tolerance or gain < 1e-7 * cost:
                    converged, message = True, "converged"
                break
            damping = max(damping * 10.0, 1e-6)
            if damping > 1e8:
                break
        state_steps = state_steps_next
        assert residuals is not None
        if not improved:
            converged, message = True, "converged"  # no direction lowers the cost any more
            break
        if converged:
            break
    assert residuals is not None
    linearisation, *_ = problem.linearise(model, current, residuals, steps, state_steps)
    samples = len(linearisation.residual)
    white = float(np.sum([np.sum(problem.whitened(i, r) ** 2) for i, r in enumerate(residuals)]))
    return Fit(
        model=model,
        names=tuple(names),
        values=np.array([model.value(name) for name in names]),
        covariance=_covariance(linearisation.jacobian, priors),
        starts=tuple(current),
        run=run,
        residuals=tuple(residuals),
        noise=noise,
        chi2=white,
        samples=samples,
        converged=converged,
        message=message,
        linearisation=linearisation,
        at_bound=tuple(name for name, stuck in zip(names, blocked) if stuck),
    )


def _covariance(jacobian: Array, priors: Sequence) -> Array:
    """Inverse of the Fisher information; infinite variances in directions that the records do not determine."""
    p = jacobian.shape[1]
    if p == 0:
        return np.zeros((0, 0))
    norms = np.linalg.norm(jacobian, axis=0)
    norms[norms == 0.0] = 1e-150
    scaled = jacobian / norms
    information = scaled.T @ scaled
    for i, prior in enumerate(priors):
        if prior is not None:
            information[i, i] += 1.0 / (prior.std * norms[i]) ** 2
    eigenvalues, vectors = np.linalg.eigh(information)
    inverse = np.where(
        eigenvalues > 1e-11 * max(eigenvalues[-1], 1e-300), 1.0 / np.maximum(eigenvalues, 1e-300), 1e24
    )
    with np.errstate(over="ignore"):
        return (vectors * inverse) @ vectors.T / np.outer(norms, norms)


def noise_of(fit: Fit, floor: float = 0.0) -> NoiseModel:
    """Noise model of a fit's residuals over the averages that were used."""
    stretches = [r[s] for r, one in zip(fit.residuals, fit.run.series) for s in runs(one.used)]
    return estimate_noise(stretches, floor=floor)


def estimate(
    model: Model,
    series: Sequence[Series],
    names: Sequence[str] | None = None,
    starts: Sequence[Array] | None = None,
    noise: NoiseModel | None = None,
    pool: ThreadPoolExecutor | None = None,
    max_step: float | None = None,
    iterations: int = 30,
    progress: Progress | None = None,
) -> Fit:
    """Maximum-likelihood estimate of the model's free parameters (or of `names`) from all series.

    Least squares first; then, with `noise` None, the colour of the residuals is estimated and the fit repeated in
    whitened form, which makes it efficient and its covariance honest. Raises InputError when the model diverges.
    """
    chosen = tuple(model.free if names is None else names)
    run = prepare_run(model, series, max_step)
    guess = list(starts) if starts is not None else first_guess(model, run)
    if noise is not None:
        return minimise(model, run, chosen, noise, guess, iterations, pool)
    spread = max(float(np.std(one.averaged)) for one in series)
    scaled = NoiseModel(np.empty(0), spread * 1e-2)
    fit = minimise(model, run, chosen, scaled, guess, iterations, pool)
    rms = math.sqrt(fit.chi2 / max(fit.samples, 1)) * scaled.std
    if max_step is None:
        finer = accurate(run, fit.model, fit.starts, max(0.1 * rms, 1e-7 * spread))
        run = finer
    for _ in range(2):
        noise = noise_of(fit, floor=1e-9 * spread)
        if progress is not None:
            progress(f"residual {noise.variance**0.5:.3g}, colour of order {noise.order}")
        fit = minimise(fit.model, run, chosen, noise, fit.starts, iterations, pool)
    return fit


def start_only(model: Model, series: Sequence[Series], noise: NoiseModel, max_step: float) -> Fit:
    """Free run over records that the model has not seen: only their initial states are estimated."""
    run = prepare_run(model, series, max_step)
    return minimise(model, run, (), noise, None, 8)


def with_bounds(model: Model, bounds: Mapping[str, tuple[float, float]]) -> Model:
    """A copy of the model with other bounds for some parameters."""
    current = model.parameters
    return model.with_parameters({name: replace(current[name], bounds=b) for name, b in bounds.items()})
