"""How often the comparison of runs and rigs alarms on simulated sets: python benchmarks/batch_false_alarms.py [SETS]

The stated standard deviations are lognormal, a factor of two apart; scatter from run to run is added in units of their median. With none, each share
should be 0.05 within its standard error; with some, run to run should alarm and the others should not.
"""

from __future__ import annotations

import sys

import numpy as np

from rhythmid.batch.scatter import groups_agree, homogeneous, trend

SPREAD = 0.7  # standard deviation of the logarithm of the stated standard deviations
LEVEL = 0.05
DESIGNS = ((4, 2), (8, 2), (12, 3), (30, 3))  # runs, rigs
SCATTER = (0.0, 0.7, 3.0)


def p_values(rng: np.random.Generator, runs: int, rigs: int, scatter: float) -> tuple[float, float, float]:
    """Of one set: run to run, rig to rig, trend."""
    stds, names = np.exp(rng.normal(0.0, SPREAD, runs)), [str(run * rigs // runs) for run in range(runs)]
    values = 5.0 + stds * rng.normal(size=runs) + scatter * rng.normal(size=runs)
    repeated, slope = (
        homogeneous(values, stds, names),
        trend(values, stds, names, rng.uniform(0.0, 10.0, runs)),
    )
    groups = groups_agree(values, stds, names)
    assert repeated is not None and slope is not None and groups is not None
    return repeated[1], groups, slope.p_value


def main() -> None:
    sets, rng = int(sys.argv[1]) if len(sys.argv) > 1 else 2000, np.random.default_rng(0)
    error = (LEVEL * (1.0 - LEVEL) / sets) ** 0.5
    print(f"share of {sets} sets below {LEVEL:g} (standard error {error:.4f})")
    print("runs  rigs  scatter  run to run  rig to rig  trend")
    for scatter in SCATTER:
        for runs, rigs in DESIGNS:
            found = np.array([p_values(rng, runs, rigs, scatter) for _ in range(sets)])
            share = np.mean(found < LEVEL, axis=0)
            print(
                f"{runs:4d}  {rigs:4d}  {scatter:7.1f}  {share[0]:10.3f}  {share[1]:10.3f}  {share[2]:5.3f}",
                flush=True,
            )


if __name__ == "__main__":
    main()
