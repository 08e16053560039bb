"""Monte Carlo of the joint estimator on the paper's experiment: scatter against the bound, and coverage of intervals.

    python benchmarks/delays_monte_carlo.py --runs 300 --noise 5e-6            # with the limit cycle as data
    python benchmarks/delays_monte_carlo.py --runs 300 --noise 2e-5 --no-cycle
    python benchmarks/delays_monte_carlo.py --starts 200                       # random starts, k and c off by up to 50 %

The record is simulated once; every run adds its own white noise to it and fits from values that are a little off.
"""

import argparse
import math
import time

import numpy as np

from rhythmid.errors import InputError
from rhythmid.experiment import Experiment
from rhythmid.identify.bound import cramer_rao, planned_record
from rhythmid.identify.harmonic_likelihood import INPUT_DELAY, MEASUREMENT_DELAY
from rhythmid.identify.identify import paper_hopper
from rhythmid.identify.joint import fit_from, joint_likelihood
from rhythmid.identify.monte_carlo import noisy, scatter
from rhythmid.model import Model
from rhythmid.parallel import fork_map
from rhythmid.record.record import Record
from rhythmid.table1 import EXPERIMENT

DELAYS = (0.04, 0.05)
TRUTH = {"linear_spring.stiffness": 200.0, "switched_damper.stance": 2.0}


def record_of(delays: tuple[float, float]) -> Record:
    """The paper's experiment without noise."""
    from importlib.resources import as_file, files

    with as_file(files("rhythmid") / "models") as folder:
        text = EXPERIMENT.format(input=delays[0], measurement=delays[1])
        return planned_record(Experiment.from_text(text, folder))


def truth(delays: tuple[float, float]) -> Model:
    """The machine that made the record."""
    return paper_hopper().with_values({**TRUTH, INPUT_DELAY: delays[0], MEASUREMENT_DELAY: delays[1]})


def monte_carlo(runs: int, noise: float, cycle: bool, workers: int | None) -> None:
    """Print scatter over bound and coverage of each parameter."""
    record, machine = record_of(DELAYS), truth(DELAYS)
    bound = cramer_rao(machine, record, noise, cycle=cycle)
    off = machine.with_values({"linear_spring.stiffness": 201.0, "switched_damper.stance": 2.05,
                               INPUT_DELAY: 0.043, MEASUREMENT_DELAY: 0.051})  # fmt: skip

    def one(seed: int):
        return fit_from(off, noisy(record, noise, seed), cycle=cycle)

    fits = [result for _, result in fork_map(one, range(runs), workers) if not isinstance(result, Exception)]
    print(f"{len(fits)} of {runs} runs, noise {1e6 * noise:g} µm, {'with' if cycle else 'without'} the limit cycle")
    print(f"{'parameter':28}{'bound':>11}{'std':>11}{'std/bound':>11}{'bias/std':>10}{'95 % covers':>13}")
    for name in (*TRUTH, INPUT_DELAY, MEASUREMENT_DELAY):
        found = scatter(fits, name, machine.value(name))
        print(
            f"{name:28}{bound.std[name]:11.3g}{found.std:11.3g}{found.std / bound.std[name]:11.3f}"
            f"{found.bias / found.std:+10.3f}{found.coverage:13.1%}"
        )


def starts(runs: int, workers: int | None) -> None:
    """Print how many random starts reach the truth within five standard deviations."""
    rng = np.random.default_rng(1)
    cases = [(rng.uniform(0.0, 0.3, 2), rng.uniform(0.5, 1.5, 2), rng.uniform(0.0, 0.3, 2)) for _ in range(runs)]

    def one(case) -> tuple[str, float]:
        actual, factor, guess = case
        record = noisy(record_of(tuple(actual.round(5))), 5e-6, 1)
        model = paper_hopper().with_values({
            "linear_spring.stiffness": 200.0 * factor[0], "switched_damper.stance": 2.0 * factor[1],
            INPUT_DELAY: guess[0], MEASUREMENT_DELAY: guess[1],
        })  # fmt: skip
        begin = time.process_time()
        try:
            fit = joint_likelihood(record, model).fit
        except InputError:
            return "reported", time.process_time() - begin
        right = truth(tuple(actual.round(5)))
        worst = max(abs(fit.model.value(n) - right.value(n)) / fit.std[n] for n in (*TRUTH, INPUT_DELAY, MEASUREMENT_DELAY))
        return "reached" if worst < 5.0 else "wrong", time.process_time() - begin

    results = [r for _, r in fork_map(one, cases, workers) if not isinstance(r, Exception)]
    counts = {kind: sum(r[0] == kind for r in results) for kind in ("reached", "reported", "wrong")}
    seconds = np.array([r[1] for r in results])
    print(f"{runs} starts: {counts}; CPU seconds: median {np.median(seconds):.2f}, largest {seconds.max():.2f}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=300)
    parser.add_argument("--noise", type=float, default=5e-6, help="standard deviation [m]")
    parser.add_argument("--no-cycle", action="store_true", help="do not use the limit cycle as data")
    parser.add_argument("--starts", type=int, default=0, help="try so many random starts instead")
    parser.add_argument("--workers", type=int, default=None)
    given = parser.parse_args()
    if given.starts:
        starts(given.starts, given.workers)
    elif given.runs < 2 or not math.isfinite(given.noise):
        parser.error("at least two runs are needed")
    else:
        monte_carlo(given.runs, given.noise, not given.no_cycle, given.workers)


if __name__ == "__main__":
    main()
