"""The paper's nine experiments, simulated, recorded to bags, and each identified from its bag alone: its Table 1."""

from collections.abc import Sequence
from dataclasses import dataclass
from importlib.resources import as_file, files
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from threadpoolctl import threadpool_limits

from rhythmid.errors import InputError
from rhythmid.experiment import Experiment
from rhythmid.identify.identification import Identification
from rhythmid.identify.identify import identify, paper_hopper
from rhythmid.ltp.htf import theoretical_htf
from rhythmid.offline_run import perform
from rhythmid.parallel import fork_map
from rhythmid.progress import Tell, counted, silent
from rhythmid.record.bag_writer import write_bag
from rhythmid.record.read import read_record
from rhythmid.report.figures import Curve, magnitude_figure, phase_figure, save_figure
from rhythmid.report.quantity import rounded
from rhythmid.report.terminal_table import print_table

# Paper, equation (14): nine chirps of 30 s that start at nine phases of the period T = 1 s. One more comes first, so that
# the response to the nine is periodic when they are analysed.
EXPERIMENT = """
model: paper_hopper.yaml
excitation:
  {{type: chirp, amplitude: 0.004, band: [0, 7], sweep: 30.0, repetitions: 9, warm_up: 1, shift: {{period: 1.0, count: 9}}}}
forcing: {{amplitude: 1.0, frequency: 1.0}}
delays: {{input: {input}, measurement: {measurement}}}
"""
DRAWN = 5  # experiment whose HTFs are drawn, as in the paper's Figures 2 and 3
HIGHEST_FREQUENCY_DRAWN = 7.0  # [Hz] drawn


@dataclass(frozen=True)
class Case:
    """One row of the paper's Table 1: actual delays, and the paper's estimates from G_0, G_−1 and G_1; seconds."""

    number: int
    input: float
    measurement: float
    sum: float
    minus: tuple[float, float]
    plus: tuple[float, float]


def _case(
    number: int,
    actual: tuple[float, float],
    total: float,
    minus: tuple[float, float],
    plus: tuple[float, float],
) -> Case:
    def seconds(pair: tuple[float, float]) -> tuple[float, float]:
        return pair[0] / 1000.0, pair[1] / 1000.0

    return Case(number, *seconds(actual), total / 1000.0, seconds(minus), seconds(plus))


CASES = (  # Paper, Table 1; milliseconds
    _case(1, (0, 0), 0, (0, 1.6), (0, 0)),
    _case(2, (0, 50), 49.9, (0, 51.6), (0, 47.5)),
    _case(3, (0, 100), 99.9, (0, 101.6), (0, 97.5)),
    _case(4, (40, 0), 40.0, (41.1, 0), (38, 0)),
    _case(5, (40, 50), 90.1, (41.7, 49.7), (41.2, 47.6)),
    _case(6, (40, 100), 140.1, (41.9, 99.5), (41.2, 95.1)),
    _case(7, (80, 0), 80.1, (81.7, 0.5), (76.7, 2.9)),
    _case(8, (80, 50), 130.1, (81.8, 50.4), (76.8, 52.4)),
    _case(9, (80, 100), 180.1, (82.1, 100.2), (76.9, 102.7)),
)


@dataclass(frozen=True, eq=False)
class Row:
    """Result of one experiment: `result` is the dictionary of `identify --json` with the actual delays added, `fitted` the
    parameters that the paper's method found; `magnitude` and `phase` are the curves of the two figures by harmonic, None
    if they are not drawn."""

    case: Case
    result: dict[str, Any]
    fitted: dict[str, float]
    magnitude: dict[int, list[Curve]] | None = None
    phase: dict[int, list[Curve]] | None = None


def record_case(case: Case, path: Path) -> None:
    """Perform one experiment and write its bag with what a user of the robot sees, without the true values."""
    with as_file(files("rhythmid") / "models") as folder:
        experiment = Experiment.from_text(
            EXPERIMENT.format(input=case.input, measurement=case.measurement), folder
        )
    messages = perform(experiment)
    wanted = [topic for topic in experiment.record.topics if topic in messages]
    write_bag(
        path, {f"{experiment.namespace}/{topic}": messages[topic] for topic in wanted},
        run=experiment.description(), joint=experiment.joint, namespace=experiment.namespace,
    )  # fmt: skip


def curves(found: Identification) -> tuple[dict[int, list[Curve]], dict[int, list[Curve]]]:
    """Curves of Figures 2 and 3: theory, estimate, parametric fit; the estimate compensated by the estimated delays."""
    paper = found.paper[0]
    htf = paper.estimate.htf
    theory = theoretical_htf(paper_hopper(), paper.pumping, htf.harmonics, htf.frequency, delays=False)
    fit = paper.fit.linearised.htf(htf.harmonics, htf.frequency)
    undone = htf
    if found.delays.input.value is not None and found.delays.measurement.value is not None:
        undone = htf.delayed(
            -found.delays.input.value, -found.delays.measurement.value, paper.pumping.frequency
        )
    magnitude, phase = {}, {}
    for m in (0, -1, 1):
        row = htf.row(m)
        seen = paper.estimate.reached[row] & (htf.frequency <= HIGHEST_FREQUENCY_DRAWN)
        at = htf.frequency[seen]
        estimate = Curve("estimate", at, htf.value[row, seen])
        fitted = Curve("parametric fit", at, fit[row, seen])
        magnitude[m] = [Curve("theory", at, theory.value[row, seen]), estimate, fitted]
        phase[m] = [fitted, estimate, Curve("compensated", at, undone.value[row, seen])]
    return magnitude, phase


def run_case(case: Case, folder: Path) -> Row:
    """Simulate, record to `folder`, and identify from the bag alone."""
    path = folder / f"experiment_{case.number}"
    record_case(case, path)
    with threadpool_limits(1):  # one experiment per core
        found = identify(read_record(path))
    result = found.to_dict() | {"actual": {"input": case.input, "measurement": case.measurement}}
    fit = found.paper[0].fit
    fitted = {name: float(value) for name, value in zip(fit.names, fit.values)}
    return Row(case, result, fitted, *(curves(found) if case.number == DRAWN else (None, None)))


def table1(
    folder: Path,
    cases: Sequence[Case] = CASES,
    workers: int | None = None,
    tell: Tell = silent,
) -> list[Row]:
    """All experiments, on all cores; bags and figures go to `folder`. Raises InputError when one of them fails."""
    folder.mkdir(parents=True, exist_ok=True)
    rows: dict[int, Row] = {}
    tell("simulating and identifying")
    done = fork_map(lambda case: run_case(case, folder), cases, workers)
    for index, row in counted(done, len(cases), "experiments", tell):
        if isinstance(row, Exception):
            raise InputError(f"experiment {cases[index].number}: {row}")
        rows[index] = row
        if row.magnitude is not None and row.phase is not None:
            save_figure(magnitude_figure(row.magnitude), folder / "figure2_magnitude.png")
            save_figure(phase_figure(row.phase), folder / "figure3_phase.png")
    return [rows[index] for index in sorted(rows)]


def _pair(ours: float, paper: float) -> str:
    return f"{1e3 * ours:.2f} ({1e3 * paper:.1f})"


def show(rows: Sequence[Row], console: Console) -> None:
    """Print both tables: the paper's method (our values and the paper's), and joint maximum likelihood."""
    _show_paper(rows, console)
    _show_joint(rows, console)


def _case_cells(case: Case) -> tuple[str, str, str]:
    return f"#{case.number}", f"{1e3 * case.input:.0f}", f"{1e3 * case.measurement:.0f}"


def _show_paper(rows: Sequence[Row], console: Console) -> None:
    body = []
    for row in rows:
        case, found = row.case, row.result["methods"]["paper"]
        body.append(
            (
                *_case_cells(case), _pair(found["G0"]["sum"], case.sum),
                _pair(found["G-1"]["input"], case.minus[0]), _pair(found["G-1"]["measurement"], case.minus[1]),
                _pair(found["G+1"]["input"], case.plus[0]), _pair(found["G+1"]["measurement"], case.plus[1]),
                f"{row.fitted['linear_spring.stiffness']:.3f}", f"{row.fitted['switched_damper.stance']:.4f}",
            )
        )  # fmt: skip
    heads = ("case", "τu", "τy", "G0 τu+τy", "G-1 τu", "G-1 τy", "G+1 τu", "G+1 τy", "k", "c")
    title = "The paper's method: delays [ms], ours and in brackets the paper's; k [N/m], c [N s/m] (the paper: 200 and 2.12)"
    print_table(console, title, heads, body, right=heads[1:])
    worst = f"ours {1e3 * worst_error(rows):.2f} ms, the paper's {1e3 * _paper_worst(rows):.2f} ms"
    console.print(f"largest error of a delay: {worst}", highlight=False)


def _show_joint(rows: Sequence[Row], console: Console) -> None:
    body = []
    for row in rows:
        delays, values = row.result["delays"], row.result["parameters"]
        cells = _case_cells(row.case)
        for estimate, scale in (
            (delays["input"], 1e3), (delays["measurement"], 1e3),
            (values["linear_spring.stiffness"], 1.0), (values["switched_damper.stance"], 1.0),
        ):  # fmt: skip
            cells += (
                rounded(scale * estimate["value"], scale * estimate["std"]),
                f"{scale * estimate['std']:.0e}",
            )
        body.append(cells)
    heads = (
        "case",
        "τu",
        "τy",
        "joint τu",
        "bound",
        "joint τy",
        "bound",
        "joint k",
        "bound",
        "joint c",
        "bound",
    )
    title = "Joint maximum likelihood: delays [ms], k, c, and the bound for the noise that each record shows"
    print_table(console, title, heads, body, right=heads[1:])


def worst_error(rows: Sequence[Row]) -> float:
    """Largest error [s] of all delay estimates by the paper's method."""
    return max(
        abs(value - actual)
        for row in rows
        for estimates in row.result["methods"]["paper"].values()
        for name, value in estimates.items()
        for actual in [_actual(row.case, name)]
    )


def _actual(case: Case, name: str) -> float:
    return {"sum": case.input + case.measurement, "input": case.input, "measurement": case.measurement}[name]


def _paper_worst(rows: Sequence[Row]) -> float:
    errors = []
    for case in (row.case for row in rows):
        errors.append(abs(case.sum - case.input - case.measurement))
        for pair in (case.minus, case.plus):
            errors += [abs(pair[0] - case.input), abs(pair[1] - case.measurement)]
    return float(np.max(errors))
