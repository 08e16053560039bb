"""Draw the README's figure: how estimates of the two delays scatter with the measurement noise.

    python docs/delay_noise.py [--runs 8]

The paper's experiment, delays of 40 and 50 ms: rhythmid's joint maximum likelihood, its Cramér-Rao bound, and the paper's
method (from G_-1 alone), whose scatter is shown about the true values as root mean square, bias included.
"""

import argparse
from importlib.resources import as_file, files
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from rhythmid.experiment import Experiment
from rhythmid.identify.bound import cramer_rao, planned_record
from rhythmid.identify.harmonic_likelihood import INPUT_DELAY, MEASUREMENT_DELAY
from rhythmid.identify.identify import forced_by, paper_hopper
from rhythmid.identify.joint import fit_from
from rhythmid.identify.monte_carlo import noisy
from rhythmid.identify.paper import paper_method
from rhythmid.parallel import fork_map
from rhythmid.report.figures import save_figure
from rhythmid.table1 import EXPERIMENT

PATH = Path(__file__).with_name("delay_noise.png")
DELAYS = (0.04, 0.05)
NOISE = (2e-6, 5e-6, 1e-5, 2e-5)
NAMES = (INPUT_DELAY, MEASUREMENT_DELAY)
Errors = tuple[tuple[float, float], tuple[float, float]]


def errors(runs: int) -> dict[float, np.ndarray]:
    """By noise [m]: errors [s] of shape (runs, method, delay), methods joint and paper."""
    with as_file(files("rhythmid") / "models") as folder:
        text = EXPERIMENT.format(input=DELAYS[0], measurement=DELAYS[1])
        quiet = planned_record(Experiment.from_text(text, folder))
    machine = paper_hopper().with_values(dict(zip(NAMES, DELAYS)))
    plain, pumping = forced_by(paper_hopper(), quiet)

    def one(case: tuple[float, int]) -> Errors:
        record = noisy(quiet, *case)
        fit = fit_from(machine.with_values({INPUT_DELAY: 0.042, MEASUREMENT_DELAY: 0.051}), record)
        paper = paper_method(record, plain, pumping).delays[-1]
        assert paper.input is not None and paper.measurement is not None
        return (
            (fit.model.value(INPUT_DELAY) - DELAYS[0], fit.model.value(MEASUREMENT_DELAY) - DELAYS[1]),
            (paper.input - DELAYS[0], paper.measurement - DELAYS[1]),
        )

    cases = [(noise, runs * place + seed) for place, noise in enumerate(NOISE) for seed in range(runs)]
    found: dict[float, list[Errors]] = {noise: [] for noise in NOISE}
    for index, result in fork_map(one, cases):
        if isinstance(result, Exception):
            raise result
        found[cases[index][0]].append(result)
    return {noise: np.array(each) for noise, each in found.items()}


def bounds() -> dict[float, tuple[float, float]]:
    """By noise [m]: smallest standard deviations [s] of the two delays."""
    with as_file(files("rhythmid") / "models") as folder:
        text = EXPERIMENT.format(input=DELAYS[0], measurement=DELAYS[1])
        quiet = planned_record(Experiment.from_text(text, folder))
    machine = paper_hopper().with_values(dict(zip(NAMES, DELAYS)))
    unit = cramer_rao(machine, quiet, NOISE[0]).std  # the bound is proportional to the noise
    return {noise: (unit[NAMES[0]] * noise / NOISE[0], unit[NAMES[1]] * noise / NOISE[0]) for noise in NOISE}


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--runs", type=int, default=8, help="records of each noise")
    runs = parser.parse_args().runs
    found, bound = errors(runs), bounds()
    scatter = np.array([np.sqrt(np.mean(found[noise] ** 2, axis=0)) for noise in NOISE])
    figure = Figure(figsize=(8.0, 3.2), layout="constrained")
    microns = 1e6 * np.array(NOISE)
    for place, axis in enumerate(figure.subplots(1, 2, sharey=True)):
        axis.loglog(
            microns, 1e3 * scatter[:, 1, place], "o-", color="tab:orange", label="the paper's method (G₋₁)"
        )
        axis.loglog(
            microns, 1e3 * scatter[:, 0, place], "o", color="tab:blue", label="joint maximum likelihood"
        )
        axis.loglog(
            microns,
            [1e3 * bound[noise][place] for noise in NOISE],
            "k--",
            linewidth=1,
            label="Cramér-Rao bound",
        )
        axis.set_title(("input delay", "measurement delay")[place])
        axis.set_xlabel("noise of a sample [µm]")
        axis.set_xticks(microns, [f"{value:g}" for value in microns])
        axis.minorticks_off()
        axis.grid(alpha=0.3)
        for noise, row in zip(NOISE, scatter):
            print(f"{1e6 * noise:g} µm, {NAMES[place]}: joint {1e3 * row[0, place]:.4f} ms, bound {1e3 * bound[noise][place]:.4f} ms, "
                  f"paper {1e3 * row[1, place]:.2f} ms")  # fmt: skip
    left, right = figure.axes
    left.set_ylabel(f"rms error of {runs} records [ms]")
    right.legend(loc="center left", fontsize=8)
    save_figure(figure, PATH)


if __name__ == "__main__":
    main()
