"""Jitter of commands: single commands act earlier or later than their mean delay. A lightly damped machine stores
the effect.

A command that is late by ε gives the machine the impulse −ε ΔF, where ΔF is the step of the command. The effect in
the record has the spectrum of the machine's own response. In a record of a few decay times it cannot be
distinguished from other residuals, because the fit has absorbed most of it into the parameters. It can be
simulated, however. Runs with jittered commands give the spectrum; the size of the many innovations gives the
standard deviation of the jitter. Jitter shows in innovations that are larger where the command's steps were larger.
They must not follow from the command itself, as the effect of a missing element would.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PPoly

from rhythmid.identify.free_run import FreeRun, with_series
from rhythmid.identify.noise import NoiseModel, burg, runs
from rhythmid.identify.output_error import Fit, minimise
from rhythmid.identify.series import Series
from rhythmid.simulation.signal import is_held

Array = NDArray[np.float64]
RUNS = 16  # least number of simulations with jitter, over all series together
# standard deviation of the simulated jitter, in sample periods: small enough for a linear effect
TRIED = 0.05
WHITE = (
    0.0,
    0.05,
    0.1,
    0.2,
    0.4,
    0.8,
)  # white measurement noise beside the jitter, as a share of one innovation of the whole residual
# gain in log likelihood over the residuals' own noise spectrum: five standard deviations
LEAST_LIKELIHOOD_GAIN = 12.5
LEAST_GROWING_SHARE = 0.5  # least share of the innovations' power that grows with the command's steps
SHOWN = 5.0  # standard deviations by which this growth must differ from zero
# largest share of the innovations that may follow from the command; beyond it the model lacks an effect
FOLLOWED = 0.5
LAGS = 8  # delays of the command, in blocks, from which the innovations may follow
# least number of commands and of blocks in a series; with fewer, half of it gives no noise spectrum
LEAST_COMMANDS = 500
SEED = 20  # of the simulated jitter, so that results are reproducible


@dataclass(frozen=True)
class CommandJitter:
    """Jitter of commands: standard deviation `std` [s], its uncertainty [s], and the model of the noise that jitter
    and measurement cause together. `std` lies between two limits: all innovations are due to jitter, or only the
    share that grows with the command's steps is."""

    std: float
    uncertainty: float
    noise: NoiseModel

    @property
    def words(self) -> str:
        """One sentence that describes the jitter."""
        return (
            f"single commands act earlier or later than the input delay says, by {1e3 * self.std:.3g} ± {1e3 * self.uncertainty:.1g} ms "
            "(standard deviation); the motion that this excites is modelled as coloured noise"
        )


def command_jitter(fit: Fit) -> CommandJitter | None:
    """Jitter of held commands, estimated from the residuals of a fit; None where no jitter is detected."""
    if not all(_held(one) for one in fit.run.series):
        return None
    left = [r[part] for r, one in zip(fit.residuals, fit.run.series) for part in runs(one.used)]
    whole = sum(len(r) for r in left)
    usual = burg(left)
    if whole == 0 or _growing_share(fit, usual) < LEAST_GROWING_SHARE:  # checked before any simulation is run
        return None
    std = TRIED * fit.run.series[0].period
    simulated = _simulated(fit, std)
    if not simulated:
        return None
    scale = usual.std / max(burg(simulated).std, 1e-300)
    rng = np.random.default_rng(SEED)
    best, likelihood = None, -math.inf
    for share in WHITE:
        noise = burg([scale * one + share * usual.std * rng.standard_normal(len(one)) for one in simulated])
        square = _square(noise, left)
        value = -0.5 * whole * math.log(square) - whole * math.log(noise.std)
        if value > likelihood:
            best, likelihood = (noise, math.sqrt(square)), value
    assert best is not None
    own = -0.5 * whole * math.log(_square(fit.noise, left)) - whole * math.log(fit.noise.std)
    noise, size = best
    known = replace(noise, std=noise.std * size)
    share = _growing_share(fit, known)
    if likelihood < own + LEAST_LIKELIHOOD_GAIN or share < LEAST_GROWING_SHARE:
        return None
    most = std * scale * size
    least = most * math.sqrt(share)
    return CommandJitter(
        0.5 * (most + least), math.hypot(0.5 * (most - least), most / math.sqrt(2.0 * whole)), known
    )


def weighed(fit: Fit, jitter: CommandJitter) -> Fit:
    """The fit with the effect of command jitter as its noise model."""
    series = [replace(one, colour=jitter.noise) for one in fit.run.series]
    run = replace(fit.run, series=tuple(series))
    return minimise(fit.model, run, fit.names, jitter.noise, fit.starts)


def _held(one: Series) -> bool:
    if not one.commanded or one.kind != "force" or one.ignored is not None or one.spread is not None:
        return False
    assert one.command is not None
    return is_held(one.command) and len(one.command.x) > LEAST_COMMANDS and one.blocks > LEAST_COMMANDS


def _simulated(fit: Fit, std: float) -> list[Array]:
    """Change of the outputs by jitter of this standard deviation [s], stretch by stretch. Only the second half of
    each series is returned: in the first half the machine still gains more energy from the jitter than it loses."""
    rng, found = np.random.default_rng(SEED), []
    base = _stopping(fit.run, fit.run.series).outputs(fit.model, fit.starts)
    for _ in range(max(1, RUNS // len(fit.run.series))):
        series = [replace(one, command=_jittered(one.command, std, rng)) for one in fit.run.series]
        made = _stopping(fit.run, series).outputs(fit.model, fit.starts)
        if base is None or made is None:
            return []
        found += [(a - b)[len(a) // 2 :] for a, b in zip(made, base)]
    return found


def _stopping(run: FreeRun, series: Sequence[Series]) -> FreeRun:
    """The run over these series with steps that end at the commands' knots: the integration error is then far below
    the effect of jitter."""
    for index, one in enumerate(series):
        run = with_series(run, index, one)
    return run


def _jittered(command: PPoly | None, std: float, rng: np.random.Generator) -> PPoly | None:
    """A held command whose steps come earlier or later by a uniform random time of standard deviation `std` [s]."""
    if command is None:
        return None
    knots = command.x.copy()
    knots[1:-1] += std * rng.uniform(-math.sqrt(3.0), math.sqrt(3.0), len(knots) - 2)
    return PPoly(command.c, knots, extrapolate=command.extrapolate)


def _square(noise: NoiseModel, left: Sequence[Array]) -> float:
    """Mean square of the innovations of the residuals."""
    return float(np.mean(np.concatenate([noise.whiten(one) for one in left]) ** 2))


def _growing_share(fit: Fit, noise: NoiseModel) -> float:
    """Share of the innovations' power that grows with the squares of the command's steps. It is 0 where no such
    growth is significant, or where the innovations follow from the command itself."""
    innovations, squares, commands = [], [], []
    for residual, one in zip(fit.residuals, fit.run.series):
        assert one.command is not None
        knots, steps = one.command.x[1:-1], np.diff(one.command.c[-1])
        half = 0.5 * one.period * one.block
        # a step affects its own block and the next: sum over both
        ends = np.concatenate([one.centres[:1] - 3.0 * half, one.centres + half])
        summed = np.concatenate([[0.0], np.cumsum(steps**2)])[np.searchsorted(knots, ends)]
        square = np.diff(summed)
        square[1:] += square[:-1].copy()
        held = one.command(one.centres)
        lagged = np.stack([np.roll(held, lag) for lag in range(LAGS)], axis=1)
        for part in runs(one.used):
            innovations.append(noise.whiten(residual[part])[LAGS:])
            squares.append(square[part][LAGS:])
            commands.append(lagged[part][LAGS:])
    white, size, past = np.concatenate(innovations), np.concatenate(squares), np.concatenate(commands)
    follows = past @ np.linalg.lstsq(past, white, rcond=1e-10)[0]
    if float(follows @ follows) > FOLLOWED * float(white @ white):
        return 0.0
    growth = size / max(float(size.mean()), 1e-300) - 1.0
    power = white**2 / max(float(np.mean(white**2)), 1e-300) - 1.0
    slope = float(growth @ power) / max(float(growth @ growth), 1e-300)
    return min(slope, 1.0) if slope * math.sqrt(float(growth @ growth) / 2.0) > SHOWN else 0.0
