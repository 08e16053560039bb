"""Estimated zeros of records whose output is measured from different zeros."""

import math

import numpy as np

from rhythmid.identify.least_squares import column_norms
from rhythmid.identify.output_error import Fit
from rhythmid.identify.record_zero import zero_place
from rhythmid.identify.sensitivity import Problem, span
from rhythmid.identify.series import record_of


def zeros_of(fit: Fit) -> dict[str, tuple[float, float]]:
    """The zero of each record that has its own, and its standard deviation together with all parameters and starts,
    [output's unit].

    For a record that is cut into stretches, the zero of the first. Empty for a model without such zeros.
    """
    place = zero_place(fit.run.compiled.layout.states)
    own = [i for i, one in enumerate(fit.run.series) if one.zero is not None]
    if place is None or not own:
        return {}
    problem = Problem(fit.run, fit.names, fit.noise, None)
    problem.learn_hidden(fit.model, fit.starts)
    steps, state_steps = fit.differences
    _, states, _, _ = problem.linearise(fit.model, fit.starts, fit.residuals, steps, state_steps)
    p, parts = len(fit.names), []
    for index, (_, slope, sensitivity) in enumerate(states):
        basis = span(np.delete(sensitivity, place, axis=1))
        columns = np.zeros((len(slope), p + len(own)))
        columns[:, :p] = slope
        if index in own:
            columns[:, p + own.index(index)] = sensitivity[:, place] / state_steps[place]
        parts.append(columns - basis @ (basis.T @ columns))
    joint = np.concatenate(parts)
    norms = column_norms(joint)
    scaled = joint / norms
    variances = np.diag(np.linalg.pinv(scaled.T @ scaled, rcond=1e-12)) / norms**2
    found: dict[str, tuple[float, float]] = {}
    for index, variance in zip(own, variances[p:], strict=True):
        one = fit.run.series[index]
        value = (one.zero or 0.0) + float(fit.starts[index][place])
        found.setdefault(record_of(one), (value, math.sqrt(max(float(variance), 0.0))))
    return found


def zeros_told(fit: Fit) -> tuple[str, ...]:
    """One sentence on the zeros; empty where all records have the same."""
    found = zeros_of(fit)
    if not found:
        return ()
    unit = fit.model.units.position
    told = ", ".join(f"{name} {value:+.3g} ± {std:.2g} {unit}" for name, (value, std) in found.items())
    first = next(record_of(one) for one in fit.run.series if one.zero is None)
    return (
        f"The output's zero differs from record to record: {told}, from that of {first}. It is free in all hypotheses.",
    )
