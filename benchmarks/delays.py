"""Delay estimators side by side on the same records: error, spread and CPU seconds.

    python benchmarks/delays.py [--runs 5] [--grey-box 15]

The record is the paper's experiment (nine chirps of 30 s behind a warm-up, delays of 40 and 50 ms), without noise and with noise
of 5 and 20 µm. Contenders:

- joint: rhythmid's default, joint maximum likelihood, from wrong initial values;
- paper: the paper's two steps, delays from G_-1 only;
- correlation: scipy.signal.correlate of the measured response with that of the true machine without delays, its peak
  interpolated by a parabola; it is given the true stiffness and damping, and gives only the sum of the delays;
- phase slope: a straight line through the phase of the cross-spectrum of the same two; the sum only;
- grey box: scipy.optimize.least_squares on scipy.integrate.solve_ivp, all parameters, delays and the initial state free, from
  initial values with errors of 5 % in stiffness and damping and 10 ms in the delays. It is slow, so it uses only `--grey-box` seconds,
  and each noise once; 0 leaves it out.
"""

import argparse
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib.resources import as_file, files

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.optimize import least_squares
from scipy.signal import correlate

from rhythmid.experiment import Experiment
from rhythmid.identify.bound import planned_record
from rhythmid.identify.harmonic_likelihood import INPUT_DELAY, MEASUREMENT_DELAY
from rhythmid.identify.identify import forced_by, paper_hopper
from rhythmid.identify.joint import joint_likelihood
from rhythmid.identify.monte_carlo import noisy
from rhythmid.identify.paper import paper_method
from rhythmid.record.record import Record
from rhythmid.table1 import EXPERIMENT

Array = NDArray[np.float64]
DELAYS = (0.04, 0.05)
NOISE = (0.0, 5e-6, 2e-5)
BAND = (0.5, 5.0)  # Hz, of the phase slope
COARSE = 0.08  # s, a guess of the sum that avoids phase wrapping
Estimator = Callable[
    [Record], tuple[float, float, float]
]  # input delay, measurement delay (NaN if not estimated), sum [s]


def record_of(delays: tuple[float, float]) -> Record:
    """The paper's experiment without noise."""
    with as_file(files("rhythmid") / "models") as folder:
        text = EXPERIMENT.format(input=delays[0], measurement=delays[1])
        return planned_record(Experiment.from_text(text, folder))


def joint(record: Record) -> tuple[float, float, float]:
    """rhythmid's default."""
    off = paper_hopper().with_values({"linear_spring.stiffness": 190.0, "switched_damper.stance": 2.2})
    model = joint_likelihood(record, off).model
    pair = model.value(INPUT_DELAY), model.value(MEASUREMENT_DELAY)
    return (*pair, sum(pair))


def paper(record: Record) -> tuple[float, float, float]:
    """The paper's method, from G_-1."""
    machine, pumping = forced_by(paper_hopper(), record)
    found = paper_method(record, machine, pumping).delays[-1]
    assert found.input is not None and found.measurement is not None
    return found.input, found.measurement, found.sum


@dataclass(frozen=True, eq=False)
class Response:
    """What the command causes: samples (n,) from the time `begin` [s] on, the limit cycle taken out."""

    begin: float
    value: Array


def response(record: Record) -> Response:
    """The output over whole periods, without its limit cycle."""
    period = round(1.0 / record.output.period)
    first = len(record.output) % period
    folded = record.output.value[first:].reshape(-1, period)
    return Response(float(record.output.time[first]), (folded - folded.mean(axis=0)).ravel())


def correlation(reference: Response) -> Estimator:
    """Lag of the peak of the cross-correlation with the response of the same machine without delays."""

    def estimate(record: Record) -> tuple[float, float, float]:
        measured = response(record)
        whole = correlate(measured.value, reference.value, method="fft")
        at = int(np.argmax(whole))
        before, peak, after = whole[at - 1 : at + 2]
        lag = at - (len(reference.value) - 1) + 0.5 * (before - after) / (before - 2 * peak + after)
        return np.nan, np.nan, float(lag * record.output.period) + measured.begin - reference.begin

    return estimate


def phase_slope(reference: Response) -> Estimator:
    """Slope of the phase of the cross-spectrum, weighted by its magnitude, within the excited band."""

    def estimate(record: Record) -> tuple[float, float, float]:
        measured = response(record)
        frequency = np.fft.rfftfreq(len(reference.value), record.output.period)
        cross = np.fft.rfft(measured.value) * np.fft.rfft(reference.value).conj()
        inside = (frequency > BAND[0]) & (frequency < BAND[1])
        omega, cross = 2 * np.pi * frequency[inside], cross[inside]
        late = measured.begin - reference.begin
        turned = cross * np.exp(1j * omega * (COARSE - late))
        weight = np.abs(cross)
        slope = float(np.sum(weight * omega * np.angle(turned)) / np.sum(weight * omega**2))
        return np.nan, np.nan, COARSE - slope

    return estimate


def grey_box(seconds: float) -> Estimator:
    """A generic grey-box fit by scipy on a stretch of the record that holds the resonance."""

    def estimate(record: Record) -> tuple[float, float, float]:
        assert record.input is not None
        begin = 32.0
        inside = (record.output.time >= begin) & (record.output.time < begin + seconds)
        stamps, measured = record.output.time[inside][::5], record.output.value[inside][::5]
        command_time, command = record.input.time, record.input.value
        first = begin - 0.5

        def left(theta: Array) -> Array:
            k, c, rest, input_delay, measurement_delay, x0, v0 = theta

            def rates(t: float, state: Array) -> tuple[float, float]:
                x, v = state
                u = np.interp(t - input_delay - 0.0005, command_time, command)
                return v, np.cos(2 * np.pi * t) + u - k * (x - rest) - (c * v if v > 0 else 0.0) - 9.81

            found = solve_ivp(rates, (first, stamps[-1]), (x0, v0), t_eval=stamps - measurement_delay, rtol=1e-6, atol=1e-9,
                              max_step=0.05)  # fmt: skip
            return 1e3 * (found.y[0] - measured)

        start = np.array([190.0, 2.1, 0.2, 0.03, 0.06, measured[0], 0.0])
        scale = np.array([10.0, 0.1, 0.01, 0.01, 0.01, 0.01, 0.1])
        theta = least_squares(left, start, x_scale=scale, diff_step=1e-4, xtol=1e-9, ftol=1e-9, max_nfev=25).x
        return float(theta[3]), float(theta[4]), float(theta[3] + theta[4])

    return estimate


@dataclass(frozen=True)
class Outcome:
    """Estimates (runs, 3) [s] of input delay, measurement delay and sum, and CPU seconds a run."""

    estimates: Array
    seconds: float


def measure(estimator: Estimator, records: Sequence[Record]) -> Outcome:
    begin = time.process_time()
    found = np.array([estimator(record) for record in records])
    return Outcome(found, (time.process_time() - begin) / len(records))


def _cell(values: Array, truth: float) -> str:
    """Mean error and spread [ms]."""
    if np.isnan(values).any():
        return "—"
    spread = f" ± {1e3 * values.std(ddof=1):.4f}" if len(values) > 1 else ""
    return f"{1e3 * (values.mean() - truth):+.4f}{spread}"


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--runs", type=int, default=5, help="records of each noise")
    parser.add_argument(
        "--grey-box", type=float, default=15.0, help="seconds that the grey box sees; 0 leaves it out"
    )
    given = parser.parse_args()
    quiet = record_of(DELAYS)
    undelayed = response(record_of((0.0, 0.0)))
    contenders: list[tuple[str, Estimator, int]] = [
        ("joint", joint, given.runs),
        ("paper", paper, given.runs),
        ("correlation", correlation(undelayed), given.runs),
        ("phase slope", phase_slope(undelayed), given.runs),
    ]
    if given.grey_box > 0.0:
        contenders.append((f"grey box, {given.grey_box:g} s", grey_box(given.grey_box), 1))
    joint(quiet)  # compiles
    for noise in NOISE:
        print(
            f"\nnoise {1e6 * noise:g} µm: mean error ± spread [ms] of input delay, measurement delay, sum; CPU seconds"
        )
        for name, estimator, runs in contenders:
            records = [noisy(quiet, noise, seed) for seed in range(runs)] if noise else [quiet]
            found = measure(estimator, records)
            cells = [_cell(found.estimates[:, i], truth) for i, truth in enumerate((*DELAYS, sum(DELAYS)))]
            print(
                f"{name:18}" + "".join(f"{cell:>22}" for cell in cells) + f"{found.seconds:9.2f} s",
                flush=True,
            )


if __name__ == "__main__":
    main()
