"""Monte Carlo of the joint estimator on the paper's experiment: scatter relative to the bound, coverage of intervals, and distant
initial values.

    python benchmarks/delays_monte_carlo.py                    # everything, on two chirps: a few minutes
    python benchmarks/delays_monte_carlo.py --chirps 9 --only scatter     # the paper's nine chirps
    python benchmarks/delays_monte_carlo.py --only scatter --case 1 --runs 1000     # of the four, the second
    python benchmarks/delays_monte_carlo.py --only starts --runs 200

One record is simulated. Every run adds its own white noise and fits from slightly wrong initial values. Each run with distant
initial values has its own delays, and therefore its own record.
"""

import argparse
import time
from dataclasses import dataclass
from importlib.resources import as_file, files
from itertools import product

import numpy as np
from numpy.typing import NDArray

from rhythmid.errors import InputError
from rhythmid.experiment import Experiment
from rhythmid.identify.bound import cramer_rao, planned_record
from rhythmid.identify.harmonic_likelihood import INPUT_DELAY, MEASUREMENT_DELAY
from rhythmid.identify.identify import paper_hopper
from rhythmid.identify.joint import fit_from, joint_likelihood
from rhythmid.identify.monte_carlo import Drawn, noisy, scatter
from rhythmid.model import Model
from rhythmid.parallel import fork_map
from rhythmid.record.record import Record

EXPERIMENT = """
model: paper_hopper.yaml
excitation:
  {{type: chirp, amplitude: 0.004, band: [0, 7], sweep: 30.0, repetitions: {chirps}, warm_up: 1,
   shift: {{period: 1.0, count: {chirps}}}}}
forcing: {{amplitude: 1.0, frequency: 1.0}}
delays: {{input: {delays[0]}, measurement: {delays[1]}}}
"""
DELAYS = (0.04, 0.05)
CASES = tuple(product((5e-6, 2e-5), (True, False)))  # noise [m], whether the limit cycle is used
STIFFNESS, DAMPING = "linear_spring.stiffness", "switched_damper.stance"
NAMES = (INPUT_DELAY, MEASUREMENT_DELAY, STIFFNESS, DAMPING)


def record_of(chirps: int, delays: tuple[float, float] = DELAYS) -> Record:
    """The paper's experiment without noise, with so many chirps after the warm-up."""
    with as_file(files("rhythmid") / "models") as folder:
        return planned_record(Experiment.from_text(EXPERIMENT.format(chirps=chirps, delays=delays), folder))


def machine_of(delays: tuple[float, float] = DELAYS) -> Model:
    """The machine that made the record."""
    values = {STIFFNESS: 200.0, DAMPING: 2.0, INPUT_DELAY: delays[0], MEASUREMENT_DELAY: delays[1]}
    return paper_hopper().with_values(values)


def print_scatter(seeds: range, record: Record, noise: float, cycle: bool, workers: int | None) -> None:
    """Scatter over bound, and coverage, of each parameter."""
    machine = machine_of()
    bound = cramer_rao(machine, record, noise, cycle=cycle)
    moved = (0.003, 0.001, 1.0, 0.05)
    off = machine.with_values({name: machine.value(name) + by for name, by in zip(NAMES, moved)})

    def one(seed: int) -> Drawn:
        return Drawn.of(fit_from(off, noisy(record, noise, seed), cycle=cycle), NAMES)

    drawn, lost = [], []
    for _, found in fork_map(one, seeds, workers):
        if isinstance(found, Exception):
            lost.append(found)
        else:
            drawn.append(found)
    print(
        f"\nnoise {1e6 * noise:g} µm, {'with' if cycle else 'without'} the limit cycle: {len(seeds)} runs, {len(lost)} without an answer"
    )
    if lost:
        print(f"the first of them: {lost[0]}")
    print(f"{'parameter':28}{'bound':>11}{'std':>11}{'std/bound':>11}{'bias/std':>10}{'95 % covers':>13}")
    for name in NAMES:
        found = scatter(drawn, name, machine.value(name))
        print(
            f"{name:28}{bound.std[name]:11.3g}{found.std:11.3g}{found.std / bound.std[name]:11.3f}"
            f"{found.bias / found.std:+10.3f}{found.coverage:13.1%}",
            flush=True,
        )


@dataclass(frozen=True)
class Start:
    """True delays [s], and where the search begins: factors on k and c, assumed delays [s]."""

    actual: tuple[float, float]
    factor: NDArray[np.float64]
    guess: NDArray[np.float64]


def print_starts(runs: int, chirps: int, workers: int | None) -> None:
    """How many random starts reach the true values (within five standard deviations of each parameter)."""
    rng = np.random.default_rng(1)
    cases = [
        Start(tuple(rng.uniform(0.0, 0.3, 2).round(5)), rng.uniform(0.5, 1.5, 2), rng.uniform(0.0, 0.3, 2))
        for _ in range(runs)
    ]

    def one(case: Start) -> tuple[str, float]:
        record = noisy(record_of(chirps, case.actual), 5e-6, 1)
        right = machine_of(case.actual)
        values = (*case.guess, *(case.factor * (200.0, 2.0)))
        begin = time.process_time()
        try:
            fit = joint_likelihood(record, right.with_values(dict(zip(NAMES, values)))).fit
        except InputError:
            return "reported as stuck", time.process_time() - begin
        worst = max(abs(fit.model.value(n) - right.value(n)) / fit.std[n] for n in NAMES)
        return "reached" if worst < 5.0 else "wrong", time.process_time() - begin

    results = [found for _, found in fork_map(one, cases, workers) if not isinstance(found, Exception)]
    seconds = np.array([spent for _, spent in results])
    told = ", ".join(
        f"{sum(kind == k for kind, _ in results)} {k}" for k in ("reached", "reported as stuck", "wrong")
    )
    print(
        f"\n{runs} starts, {chirps} chirps: {told}; {np.median(seconds):.2f} s of CPU time each (largest {seconds.max():.2f})"
    )


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--runs", type=int, help="runs of each case (300), and starts (200)")
    parser.add_argument("--chirps", type=int, default=2, help="chirps of 30 s after the warm-up")
    parser.add_argument("--only", choices=("scatter", "starts"))
    parser.add_argument(
        "--case", type=int, choices=range(len(CASES)), help="one of the cases of --only scatter alone"
    )
    parser.add_argument("--workers", type=int, help="processes; as many as there are processors if not told")
    given = parser.parse_args()
    if given.chirps < 1 or (given.runs is not None and given.runs < 2):
        parser.error("at least one chirp and two runs are needed")
    if given.only != "starts":
        record, runs = record_of(given.chirps), given.runs or 300
        for case, (noise, cycle) in enumerate(CASES):
            if given.case not in (None, case):
                continue
            print_scatter(range(case * runs, (case + 1) * runs), record, noise, cycle, given.workers)
    if given.only != "scatter":
        print_starts(given.runs or 200, given.chirps, given.workers)


if __name__ == "__main__":
    main()
