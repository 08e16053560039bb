"""Monte Carlo of designs: the scatter of the estimates of `rhythmid identify` divided by the prediction of `rhythmid design`.

    python benchmarks/design_prediction.py --runs 200                      # the paper's hopper, 270 s, both kinds
    python benchmarks/design_prediction.py --runs 200 --duration 60 --rate 500 --noise 2e-5 --max-effort 0.05

Each design is written to a folder, and its experiment is simulated once from there. Every run adds its own noise and
identifies with the joint likelihood, from wrong initial values.
"""

import argparse
import tempfile
import time
from pathlib import Path

import numpy as np

from rhythmid.design.design_folder import EXPERIMENT, save_design
from rhythmid.design.designer import design
from rhythmid.design.requirements import KINDS, Kind, Requirements
from rhythmid.experiment import Experiment
from rhythmid.identify.bound import planned_record
from rhythmid.identify.harmonic_likelihood import INPUT_DELAY, MEASUREMENT_DELAY
from rhythmid.identify.identify import paper_hopper
from rhythmid.identify.joint import joint_likelihood
from rhythmid.identify.monte_carlo import Drawn, noisy, scatter
from rhythmid.parallel import fork_map

DELAYS = (0.0403, 0.0551)
OFF = {
    "linear_spring.stiffness": 190.0,
    "switched_damper.stance": 2.3,
    INPUT_DELAY: 0.02,
    MEASUREMENT_DELAY: 0.03,
}


def compare(wanted: Requirements, runs: int, workers: int | None) -> None:
    """Print predicted standard deviation, scatter and their ratio for every free parameter."""
    machine = paper_hopper()
    begin = time.process_time()
    made = design(machine, wanted)
    seconds = time.process_time() - begin
    with tempfile.TemporaryDirectory() as folder:
        save_design(made, machine.to_yaml(), Path(folder) / "design")
        record = planned_record(Experiment.load(Path(folder) / "design" / EXPERIMENT))
    truth = made.prediction.fit.model
    start = truth.with_values(OFF)

    def one(seed: int) -> Drawn:
        return Drawn.of(joint_likelihood(noisy(record, wanted.noise_std, seed), start).fit, truth.free)

    results = [result for _, result in fork_map(one, range(runs), workers)]
    found = [result for result in results if isinstance(result, Drawn)]
    print(
        f"{wanted.kind}, {wanted.duration:g} s at {wanted.rate} Hz, peak {made.command.peak:.4g} N, crest factor "
        f"{made.command.crest_factor:.3f}, noise {1e6 * wanted.noise_std:g} µm: designed in {seconds:.1f} s of CPU time, "
        f"{len(found)} of {runs} runs identified"
    )
    print(f"{'parameter':28}{'predicted':>11}{'scatter':>11}{'ratio':>8}{'bias/std':>10}{'95 % covers':>13}")
    for name in truth.free:
        predicted = made.prediction.fit.std[name]
        seen = scatter(found, name, truth.value(name))
        print(
            f"{name:28}{predicted:11.3g}{seen.std:11.3g}{seen.std / predicted:8.3f}{seen.bias / predicted:+10.3f}"
            f"{seen.coverage:13.1%}"
        )


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--runs", type=int, default=200)
    parser.add_argument("--kind", choices=KINDS, default=None, help="both by default")
    parser.add_argument("--duration", type=float, default=270.0, help="[s]")
    parser.add_argument("--band", type=float, nargs=2, default=(0.0, 7.0), help="[Hz]")
    parser.add_argument("--max-effort", type=float, default=0.01, help="[N]")
    parser.add_argument("--noise", type=float, default=5e-6, help="standard deviation [m]")
    parser.add_argument("--rate", type=int, default=1000, help="[Hz]")
    parser.add_argument("--harmonics", type=int, default=3)
    parser.add_argument("--workers", type=int, default=None)
    given = parser.parse_args()
    if given.runs < 2:
        parser.error("at least two runs are needed")
    kinds: tuple[Kind, ...] = KINDS if given.kind is None else (given.kind,)
    low, high = given.band
    for kind in kinds:
        wanted = Requirements(
            given.duration, (low, high), given.max_effort, (-np.inf, np.inf), given.noise, kind, given.rate,
            given.harmonics, input_delay=DELAYS[0], measurement_delay=DELAYS[1],
        )  # fmt: skip
        compare(wanted, given.runs, given.workers)


if __name__ == "__main__":
    main()
