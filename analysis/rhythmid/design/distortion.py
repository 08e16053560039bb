"""Nonlinear part of the response to the command, and the resulting bias of a fit of the linearised machine.

With y(A) the output under a command of peak A, the even part of the response is (y(A) + y(−A))/2 − y(0). The nonlinear part of the
odd response follows from runs at A and A/2, assuming that its leading term is of third order. The joint fit simulates the nonlinear
machine, so that neither part biases it. Both parts bias results that are read off transfer functions.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhythmid.design.rehearsal import Rehearsal
from rhythmid.identify.output_error import Fit
from rhythmid.identify.sensitivity import Problem

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Distortion:
    """`even` and `odd` nonlinear parts of the response, as ratios of rms to the linear part; `signal` (n,) is their sum [m]."""

    even: float
    odd: float
    signal: Array

    @property
    def total(self) -> float:
        return float(np.hypot(self.even, self.odd))


def distortion(rehearsal: Rehearsal, amplitude: float, settled: int) -> Distortion:
    """Distortion at a peak effort of `amplitude` [N], over the samples from number `settled` on."""
    still = rehearsal.output(0.0)

    def odd_part(size: float) -> Array:
        return 0.5 * (rehearsal.output(size) - rehearsal.output(-size))

    whole = odd_part(amplitude)
    odd = (whole - 2.0 * odd_part(0.5 * amplitude)) * 4.0 / 3.0
    even = 0.5 * (rehearsal.output(amplitude) + rehearsal.output(-amplitude)) - still
    linear = float(np.sqrt(np.mean((whole - odd)[settled:] ** 2)))

    def share(part: Array) -> float:
        return float(np.sqrt(np.mean(part[settled:] ** 2))) / linear if linear > 0.0 else np.inf

    return Distortion(share(even), share(odd), even + odd)


def linearised_bias(fit: Fit, signal: Array) -> Mapping[str, float]:
    """Bias of each parameter, in its standard deviations, of a fit whose model lacks the distortion `signal` (n,) [m].

    To first order (JᵀJ)⁻¹ Jᵀ d with J the whitened sensitivities and d the whitened distortion.
    """
    problem = Problem(fit.run, fit.names, fit.noise, None)
    white = problem.whitened(0, fit.run.series[0].average(signal))
    basis = fit.linearisation.bases[0]
    left = white - basis @ (basis.T @ white)
    shift = fit.covariance @ (fit.linearisation.jacobian.T @ left)
    return {name: float(moved / fit.std[name]) for name, moved in zip(fit.names, shift)}
