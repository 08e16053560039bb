"""Locate a mismatch without naming it: which quantity does the missing force (or sensor error) depend on?

The missing force is written as an unknown smooth function of one quantity (position, velocity, both, actuator force, time,
phase of the cycle), a sum of B-splines whose effects on the free run are simulated, and fitted to the residual. What it
explains of records that were left out of that fit tells where the mismatch lives; a function of anything else explains
nothing. This illustrates, tests the final model for remainders, and stands in where the catalogue knows no name.
"""

import math
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline
from scipy.stats import f as f_distribution

from rhythmid.diagnose.search.score_tests import Trajectories, parameter_basis, whitened
from rhythmid.identify.output_error import Fit
from rhythmid.simulation.signal import first_order_hold

Array = NDArray[np.float64]
FOLDS = 5
DEALT = 20  # stretches a fold is made of


@dataclass(frozen=True)
class Dependence:
    """How much of the residual a function of `quantity` explains.

    `explained` is the share of the residual's sum of squares above the noise in blocks left out of the fit (at most 1, below 0
    where it only fits noise); `p_value` tests the function against nothing. `grid` and `force` draw a function of one
    quantity; the unit is the model's force, or its position for a sensor error.
    """

    quantity: str
    explained: float
    p_value: float
    gain: float
    grid: Array
    force: Array


def _splines(values: Sequence[Array], count: int) -> tuple[list[list[Array]], Array, list[BSpline]]:
    """Cubic B-splines over the middle 99.8 % of the values: basis functions of each series, a grid, the splines."""
    joined = np.concatenate(values)
    low, high = np.quantile(joined, [0.001, 0.999])
    if high <= low:
        return [], np.empty(0), []
    degree = 3
    inner = np.linspace(low, high, count - degree + 1)
    knots = np.concatenate([[low] * degree, inner, [high] * degree])
    splines = [BSpline.basis_element(knots[i : i + degree + 2], extrapolate=False) for i in range(count)]
    functions = [
        [np.nan_to_num(spline(np.clip(v, low, high - 1e-12 * (high - low)))) for v in values]
        for spline in splines
    ]
    return functions, np.linspace(low, high, 60), splines


def _simulated(
    known: Trajectories, functions: list[list[Array]], pool: ThreadPoolExecutor | None
) -> list[list[Array]]:
    """Outputs' changes when each function acts as a force; its size is chosen small and scaled back."""
    run, fit = known.disturbed, known.fit
    scale = (
        1e-3 * fit.model.mass.value * max(float(np.std(np.gradient(p.velocity, p.time))) for p in known.paths)
    )

    def one(function: list[Array]) -> list[Array]:
        changes = []
        for index, (one_series, path) in enumerate(zip(run.series, known.paths)):
            rows = run.rows(
                fit.model, index, fit.starts[index], first_order_hold(path.time, scale * function[index])
            )
            if rows is None:
                changes.append(np.zeros(one_series.blocks))
            else:
                changes.append(one_series.of_block(rows[:, run.states] - known.outputs[index]) / scale)
        return changes

    return list(pool.map(one, functions)) if pool else [one(function) for function in functions]


def _regress(
    fit: Fit, columns: list[list[Array]], penalty: float = 1e-6
) -> tuple[float, float, float, Array]:
    """Cross-validated share explained, p-value, chi2 gain, and coefficients of a linear combination of columns."""
    white_residual = whitened(fit, fit.residuals, fit.noise)
    per_column = [whitened(fit, column, fit.noise) for column in columns]
    blocks = [np.column_stack([column[i] for column in per_column]) for i in range(len(white_residual))]
    residual_parts, design_parts = [], []
    for residual, block, basis in zip(white_residual, blocks, fit.linearisation.bases):
        residual_parts.append(residual - basis @ (basis.T @ residual))
        design_parts.append(block - basis @ (basis.T @ block))
    residual, design = np.concatenate(residual_parts), np.vstack(design_parts)
    left = parameter_basis(fit)
    residual = residual - left @ (left.T @ residual)
    design = design - left @ (left.T @ design)
    norms = np.linalg.norm(design, axis=0)
    norms[norms == 0.0] = 1.0
    scaled = design / norms
    gram = scaled.T @ scaled
    ridge = penalty * np.eye(len(gram))
    coefficients = -np.linalg.solve(gram + ridge, scaled.T @ residual)
    total = float(residual @ residual)
    left_over = float(np.sum((residual + scaled @ coefficients) ** 2))
    n = len(scaled)
    rank = int(np.linalg.matrix_rank(gram, tol=1e-6 * len(gram)))
    gain = max(total - left_over, 0.0)
    statistic = (gain / max(rank, 1)) / max(left_over / max(n - rank, 1), 1e-300)
    p_value = float(f_distribution.sf(statistic, max(rank, 1), max(n - rank, 1)))
    edges = np.linspace(0, n, FOLDS * DEALT + 1).astype(int)
    predicted_error = 0.0
    for fold in range(FOLDS):  # stretches are dealt in turn, so that no amplitude is left out altogether
        test = np.zeros(n, bool)
        for part in range(fold, FOLDS * DEALT, FOLDS):
            test[edges[part] : edges[part + 1]] = True
        inner = scaled[~test].T @ scaled[~test] + ridge
        beta = -np.linalg.solve(inner, scaled[~test].T @ residual[~test])
        predicted_error += float(np.sum((residual[test] + scaled[test] @ beta) ** 2))
    floor = min(float(n), left_over)
    explained = (total - predicted_error) / max(total - floor, 1e-9 * total, 5.0 * math.sqrt(2.0 * n))
    return float(np.clip(explained, -1.0, 1.0)), p_value, gain, coefficients / norms


def dependences(
    known: Trajectories, pool: ThreadPoolExecutor | None = None, count: int = 8
) -> list[Dependence]:
    """Dependence of the residual on each quantity, the most explaining first."""
    fit = known.fit
    found: list[Dependence] = []
    quantities: dict[str, list[Array]] = {
        "position": [p.position for p in known.legs],
        "velocity": [p.velocity for p in known.legs],
        "time": [p.time - p.time[0] for p in known.paths],
    }
    if any(np.ptp(p.effort) > 0 for p in known.paths):
        quantities["actuator force"] = [p.effort for p in known.paths]
    for name, values in quantities.items():
        functions, grid, splines = _splines(values, count)
        if not functions:
            continue
        explained, p, gain, coefficients = _regress(fit, _simulated(known, functions, pool))
        drawn = sum(c * np.nan_to_num(s(grid)) for c, s in zip(coefficients, splines))
        found.append(Dependence(name, explained, p, gain, grid, np.asarray(drawn)))
    both_x, grid_x, _ = _splines(quantities["position"], 5)
    both_v, _, _ = _splines(quantities["velocity"], 5)
    if both_x and both_v:
        products = [[a * b for a, b in zip(x, v)] for x in both_x for v in both_v]
        explained, p, gain, _ = _regress(fit, _simulated(known, products, pool), 1e-4)
        found.append(Dependence("position and velocity", explained, p, gain, grid_x, np.empty(0)))
    functions, grid, splines = _splines(list(known.outputs), count)
    if functions:
        columns = [[s.of_block(f) for s, f in zip(fit.run.series, function)] for function in functions]
        explained, p, gain, coefficients = _regress(fit, columns)
        drawn = sum(c * np.nan_to_num(s(grid)) for c, s in zip(coefficients, splines))
        found.append(
            Dependence("measured position (sensor error)", explained, p, gain, grid, np.asarray(drawn))
        )
    return sorted(found, key=lambda d: -d.explained)
