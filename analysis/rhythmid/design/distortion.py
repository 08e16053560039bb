"""How far the response departs from being linear in the command, and what that does to a fit of the linearised machine.

With y(A) the output under a command of peak A, the even part of the response is (y(A) + y(−A))/2 − y(0), and that of the
odd part which is not linear follows from runs at A and A/2, its leading term being of third order. The joint fit
simulates the nonlinear machine, and neither biases it; whatever is read off transfer functions, both do.
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
    """`even` and `odd` nonlinear parts of the response, rms as shares of its linear part's; `signal` (n,) their sum [m]."""

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
