"""Coverage of the 95 % bands of non-parametric harmonic transfer functions: noisy records against the theoretical functions.

    python benchmarks/htf_coverage.py [--runs 200] [--noise 5e-6 2e-5]

One record of the paper's hopper is simulated for each excitation, and every run adds its own noise. A point counts as
covered if the theoretical function, with delays, is within the disk of the estimate. How often too many
harmonics are found is counted on records of G_0 and noise only.
"""

import argparse
from dataclasses import dataclass, replace
from importlib.resources import as_file, files

import numpy as np
from numpy.typing import NDArray

from rhythmid.design.interleaved_multisine import closest_lines, thinned
from rhythmid.experiment import Experiment
from rhythmid.identify.bound import planned_record
from rhythmid.identify.identify import paper_hopper
from rhythmid.identify.monte_carlo import noisy
from rhythmid.ltp.htf import linearised
from rhythmid.ltp.nonparametric import harmonic_transfer_functions
from rhythmid.ltp.number_of_harmonics import TOO_LARGE
from rhythmid.ltp.pumping import pumping_of
from rhythmid.ltp.spectra import spectra
from rhythmid.parallel import fork_map
from rhythmid.record.record import Record

DELAYS = (0.04, 0.05)
EXPERIMENT = """
model: paper_hopper.yaml
excitation: {excitation}
forcing: {{amplitude: 1.0, frequency: 1.0}}
delays: {{input: 0.04, measurement: 0.05}}
"""
SPACED = closest_lines(8, 1050, 150, 6, range(2, 400, 2))
assert SPACED is not None
LINES = thinned(SPACED, seed=1)
EXCITATIONS = {
    "nine shifted chirps, 4 mN": "{type: chirp, amplitude: 0.004, band: [0, 7], sweep: 30.0, repetitions: 9, warm_up: 1, "
    "shift: {period: 1.0, count: 9}}",
    "interleaved multisine, 2.8 mN rms": f"{{type: multisine, rms: 0.0028, period: 150.0, periods: 3, lines: {LINES.tolist()}}}",
    "all lines of 150 s, 2.8 mN rms": "{type: multisine, rms: 0.0028, period: 150.0, periods: 2, band: [0.05, 7], select: all}",
    "one chirp of 290 s, 1 mN": "{type: chirp, amplitude: 0.001, band: [0, 7], sweep: 290.0}",
}


@dataclass(frozen=True)
class Found:
    """One run: method, number of harmonics, and points and covered points by harmonic."""

    method: str
    highest: int
    points: dict[int, int]
    covered: dict[int, int]


def record_of(excitation: str) -> Record:
    """The machine's record without noise."""
    with as_file(files("rhythmid") / "models") as folder:
        return planned_record(Experiment.from_text(EXPERIMENT.format(excitation=excitation), folder))


def coverage(name: str, noise: float, seeds: range, workers: int | None) -> None:
    """Print how many points of each harmonic are covered."""
    record = record_of(EXCITATIONS[name])
    pumping = pumping_of(record)
    assert pumping is not None
    machine = linearised(paper_hopper(), pumping)
    ring_down = machine.cycle.ring_down

    def one(seed: int) -> Found:
        found = harmonic_transfer_functions(
            spectra(noisy(record, noise, seed), pumping, ring_down), ring_down
        )
        points, covered = {}, {}
        for each in found.functions:
            omega = 2 * np.pi * each.frequency
            turn = (omega - each.m * pumping.omega) * DELAYS[0] + omega * DELAYS[1]
            theory = machine.htf(np.array([each.m]), each.frequency)[0] * np.exp(-1j * turn)
            points[each.m] = len(theory)
            covered[each.m] = int(np.sum(np.abs(each.value - theory) < each.radius))
        return Found(found.method, max(found.harmonics), points, covered)

    runs = [found for _, found in fork_map(one, seeds, workers) if not isinstance(found, Exception)]
    harmonics = sorted({m for run in runs for m in run.points}, key=lambda m: (abs(m), m))
    by_harmonic = []
    for m in harmonics:
        points = sum(run.points.get(m, 0) for run in runs)
        by_harmonic.append(f"G{m:+d} {sum(run.covered.get(m, 0) for run in runs) / max(points, 1):.3f}")
    total = sum(sum(run.points.values()) for run in runs)
    share = sum(sum(run.covered.values()) for run in runs) / total
    highest = np.bincount([run.highest for run in runs])
    print(f"\n{name}, noise {1e6 * noise:g} µm: {len(runs)} records, {runs[0].method.replace('_', ' ')}")
    print(
        f"  95 % bands cover {share:.1%} of {total} points; M: "
        + ", ".join(f"{m} in {n}" for m, n in enumerate(highest) if n)
    )
    print("  " + "  ".join(by_harmonic), flush=True)


def false_alarms(runs: int) -> None:
    """Print how often absent harmonics are found."""
    record = record_of(EXCITATIONS["nine shifted chirps, 4 mN"])
    pumping = pumping_of(record)
    assert pumping is not None
    machine = linearised(paper_hopper(), pumping)
    made = spectra(record, pumping, machine.cycle.ring_down)
    plain: NDArray[np.complex128] = machine.htf(np.array([0]), made.frequency)[0] * made.input
    rng = np.random.default_rng(0)
    wrong = 0
    for _ in range(runs):
        real, imaginary = 2e-6 * rng.standard_normal((2, len(plain)))
        found = harmonic_transfer_functions(
            replace(made, output=plain + real + 1j * imaginary), machine.cycle.ring_down
        )
        wrong += max(found.harmonics) > 0
    print(
        f"\nrecords of G_0 and noise: harmonics found in {wrong} of {runs}, promised {TOO_LARGE:.0%} at most"
    )


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--runs", type=int, default=200)
    parser.add_argument(
        "--noise", type=float, nargs="+", default=[5e-6, 2e-5], help="standard deviations [m]"
    )
    parser.add_argument("--workers", type=int, help="processes; as many as there are processors if not told")
    given = parser.parse_args()
    for name in EXCITATIONS:
        for noise in given.noise:
            coverage(name, noise, range(given.runs), given.workers)
    false_alarms(5 * given.runs)


if __name__ == "__main__":
    main()
