"""Output-error estimation in the time domain: a fit of the free run to the records, with its sensitivities and covariance."""

import math
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rhythmid.deadline import without_deadline
from rhythmid.errors import InputError
from rhythmid.identify.covariance import covariance_of, on_the_edge
from rhythmid.identify.descent import WHITE, Descent, descend, first_guess
from rhythmid.identify.free_run import FreeRun, halved, integrable, prepare_run, sufficient
from rhythmid.identify.ill_conditioned import ill_conditioned, with_ill_conditioned_directions
from rhythmid.identify.joint_covariance import JointCovariance
from rhythmid.identify.noise import NoiseModel, estimate_noise, runs
from rhythmid.identify.sensitivity import Linearisation, Problem
from rhythmid.identify.series import Series
from rhythmid.model import Model
from rhythmid.progress import Tell

Array = NDArray[np.float64]
LOST = 0.3  # error as a share of the motion above which the model no longer follows the machine
# largest ratio of the error of the whitened fit to that of ordinary least squares. With a noise residual the
# whitened fit costs almost nothing; motion that the model misses would be whitened away and traded for a smaller
# innovation
MISLED = 1.25
# increase of chi2 up to which a parameter is fixed at a bound that it cannot be distinguished from
FALSE_EDGE = 25.0
# largest integration error as a share of the residual: it must not affect the comparison of models
INTEGRATION = 0.02


@dataclass(frozen=True)
class Fit:
    """A fitted model.

    `values` (p,) of the parameters `names` have `covariance` (p, p). `starts` holds the state of each series at its
    first block, `residuals` simulated minus measured block averages. `chi2` is the whitened sum of squares over the
    `samples` averages that were used. `converged` is False where the search stopped for another reason, given in
    `message`.
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
        """Standard deviation of each free parameter; infinite where it is not identifiable."""
        return {
            name: float(math.sqrt(v)) if v >= 0 else math.inf
            for name, v in zip(self.names, np.diag(self.covariance))
        }

    @property
    def differences(self) -> tuple[Array, Array]:
        """Finite-difference steps of parameters (p,) and initial states (q,) for the sensitivities."""
        return np.abs(self.linearisation.steps), self.linearisation.state_steps

    @property
    def sum_of_squares(self) -> float:
        """Sum of the squared residuals, not whitened."""
        return sum(float(r @ r) for r in self.residuals)

    @property
    def white(self) -> NoiseModel:
        """White noise of the size of the residuals."""
        left = np.concatenate([r[one.used] for r, one in zip(self.residuals, self.run.series, strict=True)])
        return NoiseModel(np.empty(0), math.sqrt(float(np.mean(left**2))))

    @property
    def joint_covariance(self) -> JointCovariance:
        """Covariance of the parameters, with their units."""
        units = [self.model.parameters[name].unit for name in self.names]
        return JointCovariance.of(self.names, units, self.covariance)

    def nrmse(self, hidden: bool = False) -> float:
        """rms(simulated − measured) / std(measured) over the averages used, or over the hidden ones."""
        return normalised_error(self.residuals, self.run.series, hidden)


def normalised_error(residuals: Sequence[Array], series: Sequence[Series], hidden: bool = False) -> float:
    """rms(simulated − measured) / std(measured) over the averages used, or over the hidden ones; nan without any."""
    error, spread = 0.0, 0.0
    for one, residual in zip(series, residuals):
        mask = one.counted(hidden)
        if not mask.any():
            continue
        error += float(np.sum(residual[mask] ** 2))
        spread += one.power(mask)
    return math.sqrt(error / spread) if spread > 0 else math.nan


def minimise(
    model: Model,
    run: FreeRun,
    names: Sequence[str],
    noise: NoiseModel = WHITE,
    starts: Sequence[Array] | None = None,
    iterations: int = 30,
    pool: ThreadPoolExecutor | None = None,
    tolerance: float = 1e-3,
    differences: tuple[Array, Array] | None = None,
    reach: float = math.inf,
) -> Fit:
    """The fit that `descend` leads to, with its sensitivities and covariance.

    A parameter that cannot be distinguished from its bound is fixed there: another value would shift other
    parameters as well.
    """
    fit = _fit(
        descend(model, run, names, noise, starts, iterations, pool, tolerance, differences, reach),
        run,
        names,
        noise,
        pool,
        model,
    )
    edge = on_the_edge(fit.model, names, fit.covariance)
    if edge:
        put = fit.model.with_values(edge)
        every = zip((*names, *run.compiled.layout.states), np.concatenate(fit.differences).tolist())
        try:
            end = descend(
                put,
                run,
                names,
                noise,
                fit.starts,
                max(iterations, 3),
                pool,
                tolerance,
                reach=fit.chi2 + FALSE_EDGE,
                similar={name: step for name, step in every if name not in edge},
            )
        except InputError:
            # e.g. without inertia: a value far from its bound, but undetermined together with others
            return fit
        if end.chi2 < fit.chi2 + FALSE_EDGE:
            return _fit(end, run, names, noise, pool, model)
    return fit


def _fit(
    end: Descent,
    run: FreeRun,
    names: Sequence[str],
    noise: NoiseModel,
    pool: ThreadPoolExecutor | None,
    began: Model,
) -> Fit:
    linearisation = end.linearisation
    if linearisation is None or ill_conditioned(linearisation.jacobian):
        problem = Problem(run, names, noise, pool)
        problem.learn_hidden(end.model, end.starts)
        if linearisation is None:
            linearisation, *_ = problem.linearise(end.model, end.starts, end.residuals, *end.differences)
        linearisation = with_ill_conditioned_directions(linearisation, problem, end.model, end.starts)
    model = end.model.unwound(began)
    return Fit(
        model=model,
        names=tuple(names),
        values=np.array([model.value(name) for name in names]),
        covariance=covariance_of(
            linearisation.jacobian, [end.model.parameters[name].prior for name in names]
        ),
        starts=end.starts,
        run=run,
        residuals=end.residuals,
        noise=noise,
        chi2=end.chi2,
        samples=end.samples,
        converged=end.converged,
        message=end.message,
        linearisation=linearisation,
        at_bound=end.at_bound,
    )


def noise_of(residuals: Sequence[Array], series: Sequence[Series], floor: float = 0.0) -> NoiseModel:
    """Noise model of residuals over the averages that were used; its spectrum is that stored in the series where
    they have one."""
    return coloured(_stretches(residuals, series), series, floor)


def _stretches(residuals: Sequence[Array], series: Sequence[Series]) -> list[Array]:
    """Residuals of each contiguous run of used averages before whitening: without ignored components, and levelled."""
    stretches = []
    for residual, one in zip(residuals, series):
        if one.ignored is not None:
            columns = one.ignored[one.used]
            residual = residual - one.ignored @ np.linalg.lstsq(columns, residual[one.used], rcond=1e-12)[0]
        stretches += [one.levelled(residual[s], s) for s in runs(one.used)]
    return stretches


def coloured(stretches: Sequence[Array], series: Sequence[Series], floor: float) -> NoiseModel:
    """Noise model of the residuals in stretches of these series."""
    colour = series[0].colour
    if colour is None:
        return estimate_noise(stretches, floor=floor)
    size = float(np.sqrt(np.mean(np.concatenate([colour.whiten(one) for one in stretches]) ** 2)))
    return replace(colour, std=max(size * colour.std, floor, 1e-300))


def estimate(
    model: Model,
    series: Sequence[Series],
    names: Sequence[str] | None = None,
    starts: Sequence[Array] | None = None,
    noise: NoiseModel | None = None,
    pool: ThreadPoolExecutor | None = None,
    max_step: float | None = None,
    iterations: int = 30,
    progress: Tell | None = None,
) -> Fit:
    """Maximum-likelihood estimate of the model's free parameters (or of `names`) from all series.

    Ordinary least squares is first. With `noise` None, the noise model is then estimated from the residuals and the
    fit is repeated with whitening, which makes it efficient and its covariance valid. Raises InputError when the
    model diverges.
    """
    chosen = tuple(model.free if names is None else names)
    run = prepare_run(model, series, max_step)
    guess = list(starts) if starts is not None else first_guess(model, run)
    if max_step is None:
        run = integrable(run, model, guess)
    if noise is not None:
        return minimise(model, run, chosen, noise, guess, iterations, pool)
    spread = max(float(np.std(one.averaged)) for one in series)
    scaled = NoiseModel(np.empty(0), spread * 1e-2)
    # the residual of a distant start is not noise; weights from it would hide the error where it is large
    alike = replace(run, series=tuple(replace(one, spread=None) for one in run.series))
    end = descend(model, alike, chosen, scaled, guess, iterations, pool)
    if normalised_error(end.residuals, series) > LOST:
        # the residual is not noise: whitening it would lead to arbitrary parameters
        left = np.concatenate(_stretches(end.residuals, run.series))
        white = NoiseModel(np.empty(0), math.sqrt(float(np.mean(left**2))))
        lost = minimise(end.model, run, chosen, white, end.starts, iterations, pool)
        if lost.nrmse() > LOST:
            return lost
        return estimate(lost.model, series, chosen, lost.starts, None, pool, max_step, iterations, progress)
    while max_step is None:
        rms = math.sqrt(end.chi2 / max(end.samples, 1)) * scaled.std
        coarsest = sufficient(run, end.model, end.starts, max(INTEGRATION * rms, 1e-7 * spread))
        if coarsest is run:
            break
        run = halved(coarsest)  # the smaller residual may need finer steps
        end = descend(
            end.model, run, chosen, scaled, end.starts, iterations, pool, differences=end.differences
        )
    noise = noise_of(end.residuals, series, floor=1e-9 * spread)
    if progress is not None:
        progress(f"residual {noise.variance**0.5:.3g}, colour of order {noise.order}")
    plain = end
    end = descend(end.model, run, chosen, noise, end.starts, iterations, pool, differences=end.differences)
    if normalised_error(end.residuals, series) > MISLED * normalised_error(plain.residuals, series):
        rms = math.sqrt(plain.chi2 / max(plain.samples, 1)) * scaled.std
        return minimise(
            plain.model, run, chosen, NoiseModel(np.empty(0), rms), plain.starts, iterations, pool
        )
    noise = noise_of(end.residuals, series, floor=1e-9 * spread)
    return minimise(end.model, run, chosen, noise, end.starts, iterations, pool, differences=end.differences)


def rerun(model: Model, series: Sequence[Series], noise: NoiseModel, step: float) -> Fit | None:
    """`start_only`; None without any series, and where the model diverges."""
    try:
        return start_only(model, series, noise, step) if series else None
    except InputError:
        return None


def start_only(model: Model, series: Sequence[Series], noise: NoiseModel, max_step: float) -> Fit:
    """Free run over held-out records: only their initial states are estimated, without a time limit."""
    run = prepare_run(model, series, max_step)
    with without_deadline():
        return minimise(model, run, (), noise)


def with_bounds(model: Model, bounds: Mapping[str, tuple[float, float]]) -> Model:
    """A copy of the model with other bounds for some parameters."""
    current = model.parameters
    return model.with_parameters({name: replace(current[name], bounds=b) for name, b in bounds.items()})
