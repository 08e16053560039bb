"""Naming what a model lacks: comparison of rhythmid with sparse regression (PySINDy) and a Gaussian process on the same bags.

    python benchmarks/naming.py [--full] [--json FILE]         (needs pysindy and scikit-learn: `make benchmark-naming`)

One effect, or none, is concealed in a hopper with known mass and wrong stiffness, damping and delays. Three bags of 10 s are for training, one is held out. All
methods know the mass and the same candidate terms. The other methods have these advantages: the recorded position is smoothed by a Savitzky-Golay filter, and their
threshold and the filter's window are chosen by the error on the held-out bag; in a second row they know both delays exactly. rhythmid knows
neither, and uses the held-out bag only for evaluation. `--full` gives rhythmid its whole catalogue instead of these terms and three lags.

Printed for each: whether the name is right, the free-run error on the held-out bag relative to the motion (in the same block averages), seconds of
processor time.
"""

import argparse
import json
import resource
import tempfile
import warnings
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path

import numpy as np
import pysindy as ps  # type: ignore[import-not-found]
from numba import njit
from numpy.typing import NDArray
from scipy.signal import savgol_filter
from sklearn.gaussian_process import GaussianProcessRegressor  # type: ignore[import-not-found]
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel  # type: ignore[import-not-found]

from rhythmid.diagnose.diagnosis import diagnose
from rhythmid.elements.catalogue import load_catalogue
from rhythmid.excitation.sequence import build
from rhythmid.experiment import Delay, Experiment, Forcing, Noise, TimeMode
from rhythmid.identify.identify import paper_hopper
from rhythmid.model import Model
from rhythmid.offline_run import perform
from rhythmid.record.bag_writer import write_bag
from rhythmid.record.read import load_records
from rhythmid.record.record import Record

Array = NDArray[np.float64]
INPUT_DELAY, MEASUREMENT_DELAY, NOISE = 0.0203, 0.0151, 1e-4
REST = 0.2  # [m] about which the stiffness terms are taken, given to all
TURN = 0.002  # [m/s] range in which friction changes sign, given to the others
KNOWN = 4  # terms that belong to the nominal model: offset, spring, stance damper, force
TERMS = ("quadratic_stiffness", "cubic_stiffness", "coulomb_friction", "quadratic_drag")
LAGS = (
    "command_lag",
    "actuator_lag",
    "sensor_lag",
)  # not functions of the present state: only rhythmid can express them
CASES: dict[str, dict[str, float]] = {
    "cubic_stiffness": {"coefficient": 1000.0},
    "quadratic_stiffness": {"coefficient": 150.0},
    "coulomb_friction": {"force": 0.02, "transition": TURN},
    "quadratic_drag": {"coefficient": 0.5},
    "command_lag": {"time_constant": 0.01},
    "sensor_lag": {"time_constant": 0.01},
    "nothing": {},
}
RUNS = (
    ({"type": "chirp", "amplitude": 0.3, "sweep": 10.0, "band": [0.0, 7.0]}, 1.0),
    ({"type": "chirp", "amplitude": 1.2, "sweep": 10.0, "band": [7.0, 0.0]}, 1.0),
    ({"type": "silence", "length": 10.0}, 3.0),
    ({"type": "multisine", "rms": 0.5, "period": 5.0, "periods": 2, "band": [0.1, 7.0]}, 2.0),  # held out
)
WINDOWS = (41, 81)  # [samples] of the smoothing filter
THRESHOLDS = np.geomspace(1e-3, 0.3, 8)  # of the sparse regression, relative to the acceleration
WORDS = {True: "right", False: "wrong", None: "—"}
POINTS = 300  # training points of the Gaussian process


@dataclass(frozen=True)
class Row:
    """One method on one case; `named` are the candidate terms that it uses."""

    case: str
    method: str
    named: tuple[str, ...]
    right: bool | None  # None for a method that names nothing
    heldout_nrmse: float
    seconds: float


@dataclass(frozen=True, eq=False)
class Smooth:
    """A record at its stamps: time, measured and smoothed position, velocity, acceleration, and the total force."""

    time: Array
    measured: Array
    x: Array
    v: Array
    a: Array
    f: Array


def processor_time() -> float:
    """Seconds of processor time of this process and its finished workers, independent of the load of the computer."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(one.ru_utime + one.ru_stime for one in used)


def bags(case: str, folder: Path) -> list[Record]:
    """The four records of a case, by way of bags."""
    machine = paper_hopper()
    if CASES[case]:
        machine = machine.with_element(load_catalogue()[case], CASES[case])
    paths = []
    for index, (spec, forcing) in enumerate(RUNS):
        made = build(spec)
        experiment = Experiment(
            machine, Path("none"), made, spec, Forcing(forcing), Delay(INPUT_DELAY), Delay(MEASUREMENT_DELAY),
            Noise(NOISE), TimeMode(), made.duration, 100 + index,
        )  # fmt: skip
        messages = perform(experiment)
        path = folder / f"{case}{index}"
        write_bag(path, {topic: messages[topic] for topic in ("excitation", "forcing", "joint_states")})
        paths.append(path)
    return load_records(paths)


def smooth(record: Record, window: int, delays: tuple[float, float]) -> Smooth:
    """The smoothed record, with its channels shifted by the `delays` (input, measurement) [s]."""
    assert record.input is not None and record.forcing is not None
    y, step = record.output.value, record.output.period
    time = record.output.time - delays[1]
    x, v, a = (np.asarray(savgol_filter(y, window, 4, deriv=d, delta=step)) for d in range(3))
    sent = np.searchsorted(record.input.time, time - delays[0] + 1e-9, side="right") - 1
    command = np.where(sent >= 0, record.input.value[np.maximum(sent, 0)], 0.0)
    return Smooth(time, y, x, v, a, command + np.interp(time, record.forcing.time, record.forcing.value))


def columns(x: Array, v: Array, f: Array) -> list[Array]:
    """The terms of an acceleration: those of the nominal model, then the candidates."""
    e = x - REST
    return [np.ones_like(x), e, v * (v > 0), f, e * e, e**3, np.tanh(v / TURN), v * np.abs(v)]


@njit(cache=True)
def _acceleration(x, v, f, c, alpha, points, scale):  # pragma: no cover
    e = x - 0.2
    total = c[0] + c[1] * e + c[2] * max(v, 0.0) + c[3] * f + c[4] * e * e + c[5] * e * e * e
    total += c[6] * np.tanh(v / 0.002) + c[7] * v * abs(v)
    for i in range(len(alpha)):
        d = (
            ((x - points[i, 0]) / scale[0]) ** 2
            + ((v - points[i, 1]) / scale[1]) ** 2
            + ((f - points[i, 2]) / scale[2]) ** 2
        )
        total += alpha[i] * np.exp(-0.5 * d)
    return total


@njit(cache=True)
def _run(start, f, step, c, alpha, points, scale):  # pragma: no cover
    """Free run (n,) by Runge-Kutta with the force straight between its samples."""
    out = np.empty(len(f))
    x, v = start[0], start[1]
    for i in range(len(f)):
        out[i] = x
        if not abs(x) < 1e3 or i + 1 == len(f):
            out[i:] = x
            break
        middle = 0.5 * (f[i] + f[i + 1])
        a1 = _acceleration(x, v, f[i], c, alpha, points, scale)
        a2 = _acceleration(x + 0.5 * step * v, v + 0.5 * step * a1, middle, c, alpha, points, scale)
        a3 = _acceleration(
            x + 0.5 * step * (v + 0.5 * step * a1), v + 0.5 * step * a2, middle, c, alpha, points, scale
        )
        a4 = _acceleration(x + step * (v + 0.5 * step * a2), v + step * a3, f[i + 1], c, alpha, points, scale)
        x += step * v + step * step / 6.0 * (a1 + a2 + a3)
        v += step / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4)
    return out


@dataclass(frozen=True, eq=False)
class Law:
    """An acceleration: coefficients of the terms, and the weights and points of a Gaussian process added to it."""

    coefficients: Array
    alpha: Array = field(default_factory=lambda: np.empty(0))
    points: Array = field(default_factory=lambda: np.empty((0, 3)))
    scale: Array = field(default_factory=lambda: np.ones(3))

    def error(self, held: Smooth, block: int) -> float:
        """Free-run error on a record in block averages, its initial state fitted; infinite where it diverges."""
        step = float(held.time[1] - held.time[0])

        def left(start: Array) -> Array:
            out = _run(start, held.f, step, self.coefficients, self.alpha, self.points, self.scale)
            return _average(out - held.measured, block)

        start: Array = np.array([held.x[0], held.v[0]])
        measured = _average(held.measured, block)
        with np.errstate(all="ignore"):
            for _ in range(3):
                base = left(start)
                if not np.isfinite(base).all():
                    return float("inf")
                sizes = np.array([1e-5, 1e-4])
                slope = np.column_stack([(left(start + d) - base) / d.sum() for d in np.diag(sizes)])
                if not np.isfinite(slope).all():
                    return float("inf")
                start = start - np.linalg.lstsq(slope, base, rcond=None)[0].astype(np.float64)
            error = float(np.sqrt(np.mean(left(start) ** 2)) / np.std(measured))
        return error if np.isfinite(error) else float("inf")


def _average(samples: Array, block: int) -> Array:
    count = len(samples) // block
    return samples[: count * block].reshape(count, block).mean(axis=1)


def _library(scales: Array) -> ps.CustomLibrary:
    """The terms, each scaled to a size of one, over the variables x, v, f."""

    def term(index: int) -> Callable[[Array, Array, Array], Array]:
        return lambda x, v, f: columns(np.asarray(x), np.asarray(v), np.asarray(f))[index] / scales[index]

    count = len(scales)
    names = [lambda *_, i=i: f"term{i}" for i in range(count)]
    return ps.CustomLibrary([term(i) for i in range(count)], names, interaction_only=True, include_bias=False)


@dataclass(frozen=True, eq=False)
class Regression:
    """Terms (n, 8), scaled by `scales`, and the accelerations (n, 1) that they are to explain, pointwise or in weak form."""

    terms: Array
    target: Array
    scales: Array
    weak: bool

    @classmethod
    def of(cls, learn: Sequence[Smooth], weak: bool) -> "Regression":
        scales = np.array(
            [np.sqrt(np.mean(np.concatenate(c) ** 2)) for c in zip(*(columns(s.x, s.v, s.f) for s in learn))]
        )
        terms, target = [], []
        for one in learn:
            thin = 4 if weak else 20  # neighbouring samples are similar after the filter
            states = ps.AxesArray(
                np.column_stack([one.x, one.v, one.f])[::thin], {"ax_time": 0, "ax_coord": 1}
            )
            library = _library(scales)
            if weak:
                np.random.seed(0)  # noqa: NPY002  (PySINDy places its windows by the global generator)
                times = (one.time - one.time[0])[::thin]
                library = ps.WeakPDELibrary(
                    library, spatiotemporal_grid=times, is_uniform=True, K=100, H_xt=[0.15]
                )
            library.fit([states])
            terms.append(np.asarray(library.transform([states])[0]))
            rates = (
                library.convert_u_dot_integral(states)[:, 1]
                if isinstance(library, ps.WeakPDELibrary)
                else one.a[::thin]
            )
            target.append(np.asarray(rates)[:, None])
        return cls(np.vstack(terms), np.vstack(target), scales, weak)

    def coefficients(self, threshold: float) -> Array:
        """Coefficients (8,) by sequentially thresholded least squares, for pointwise accelerations as an ensemble of 20."""
        size = float(np.std(self.target)) / float(np.median(np.std(self.terms, axis=0)))
        optimizer = ps.STLSQ(threshold=threshold * size, alpha=1e-9)
        if not self.weak:
            np.random.seed(0)  # noqa: NPY002
            optimizer = ps.EnsembleOptimizer(optimizer, bagging=True, n_models=20)
        optimizer.fit(self.terms, self.target)
        return np.asarray(optimizer.coef_)[0] / self.scales


def gaussian_process(learn: Sequence[Smooth]) -> Law:
    """Nominal terms by least squares, and a Gaussian process over (x, v, f) on the residual."""
    design = np.vstack([np.column_stack(columns(s.x, s.v, s.f)[:KNOWN]) for s in learn])
    target = np.concatenate([s.a for s in learn])
    known = np.linalg.lstsq(design, target, rcond=None)[0].astype(np.float64)
    inputs = np.vstack([np.column_stack([s.x, s.v, s.f]) for s in learn])
    picked = np.random.default_rng(0).choice(len(target), POINTS, replace=False)
    left, spread = target - design @ known, inputs.std(axis=0)
    size = float(left.std())
    kernel = ConstantKernel(1.0, (1e-4, 1e3)) * RBF(np.ones(3), (0.1, 100.0)) + WhiteKernel(0.1, (1e-6, 10.0))
    process = GaussianProcessRegressor(kernel, random_state=0).fit(
        inputs[picked] / spread, left[picked] / size
    )
    product = process.kernel_.k1
    coefficients = np.concatenate([known, np.zeros(len(TERMS))])
    alpha = size * product.k1.constant_value * np.ravel(process.alpha_)
    return Law(coefficients, alpha, inputs[picked], spread * product.k2.length_scale)


def others(case: str, records: Sequence[Record], block: int) -> list[Row]:
    """The other methods on a case, each with the clocks as recorded and with the delays known."""
    found = []
    for label, delays in (("", (0.0, 0.0)), (", delays given", (INPUT_DELAY, MEASUREMENT_DELAY))):
        sets = {w: [smooth(record, w, delays) for record in records] for w in WINDOWS}
        for method, weak in (("SINDy, weak", True), ("SINDy, ensemble", False)):
            begin = processor_time()
            tried = []
            for data in sets.values():
                regression, held = Regression.of(data[:-1], weak), data[-1]
                for threshold in THRESHOLDS:
                    law = Law(regression.coefficients(float(threshold)))
                    used = tuple(name for name, c in zip(TERMS, law.coefficients[KNOWN:]) if c != 0.0)
                    tried.append((law.error(held, block), used))
            best = min(error for error, _ in tried)
            error, used = min(
                (t for t in tried if t[0] <= 1.05 * best or t[0] == best), key=lambda t: len(t[1])
            )
            seconds = processor_time() - begin
            found.append(Row(case, method + label, used, used == _truth(case), error, seconds))
        begin = processor_time()
        errors = [gaussian_process(data[:-1]).error(data[-1], block) for data in sets.values()]
        found.append(Row(case, f"Gaussian process{label}", (), None, min(errors), processor_time() - begin))
    return found


def _truth(case: str) -> tuple[str, ...]:
    return () if case == "nothing" else (case,)


def ours(case: str, records: Sequence[Record], nominal: Model, full: bool) -> tuple[list[Row], int]:
    """rhythmid on a case, the refitted nominal model's error as a row of its own, and the length of the block averages."""
    catalogue = load_catalogue()
    if not full:
        kept = (*TERMS, *LAGS)
        catalogue = catalogue.without(*[n for n, e in catalogue.items() if e.candidate and n not in kept])
    begin = processor_time()
    answer = diagnose(records[:-1], nominal, records[-1:], catalogue)
    seconds = processor_time() - begin
    result = answer.diagnosis
    named = tuple(effect.element for effect in result.missing)
    right = named == _truth(case) and result.verdict == ("missing_physics" if named else "consistent")
    plain, after = result.refitted_nominal.heldout_nrmse, result.augmented.heldout_nrmse
    assert plain is not None and after is not None
    rows = [
        Row(case, "nominal model, refitted", (), None, plain, 0.0),
        Row(case, "rhythmid", named, right, after, seconds),
    ]
    return rows, answer.block


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--full", action="store_true", help="rhythmid searches its whole catalogue")
    parser.add_argument("--json", type=Path, help="write the rows")
    chosen = parser.parse_args()
    warnings.simplefilter("ignore")
    nominal = paper_hopper().with_values({"linear_spring.stiffness": 215.0, "switched_damper.stance": 1.7})
    nominal = nominal.with_parameters(
        {
            n: replace(v, fixed=v.fixed and n != "linear_spring.rest_length")
            for n, v in nominal.parameters.items()
        }
    )
    rows: list[Row] = []
    for case in CASES:
        with tempfile.TemporaryDirectory() as folder:
            records = bags(case, Path(folder))
        mine, block = ours(case, records, nominal, chosen.full)
        rows += [*mine, *others(case, records, block)]
        print(f"\n{case}")
        for row in (r for r in rows if r.case == case):
            name = "" if row.right is None else ", ".join(row.named) or "nothing"
            print(
                f"  {row.method:32s} {WORDS[row.right]:6s} {100 * row.heldout_nrmse:8.2f} %  {row.seconds:6.1f} s  {name}",
                flush=True,
            )
    print("\nover all cases: right names, median error, mean processor seconds")
    for method in dict.fromkeys(row.method for row in rows):
        own = [row for row in rows if row.method == method]
        median = 100 * float(np.median([row.heldout_nrmse for row in own]))
        names = "—" if own[0].right is None else f"{sum(bool(row.right) for row in own)} of {len(own)}"
        print(f"  {method:32s} {names:8s} {median:8.2f} %  {np.mean([row.seconds for row in own]):6.1f} s")
    if chosen.json is not None:
        chosen.json.write_text(json.dumps([asdict(row) for row in rows], indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
