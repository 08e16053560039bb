"""The next experiment: the one from a menu of feasible experiments that discriminates best between the rivals.

T-optimality (A. C. Atkinson, V. V. Fedorov, Biometrika 62 (1975) 57): maximise the expected chi-squared between the
outputs that two fitted rival models predict. Amplitudes are scaled to those in the records.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rhythmid.diagnose.constants import FALSE_ALARM
from rhythmid.diagnose.search.forward import Search
from rhythmid.diagnose.search.refit import fine_enough
from rhythmid.diagnose.search.trial import Trial
from rhythmid.elements.element import Scales
from rhythmid.excitation.excitation import Excitation
from rhythmid.excitation.sequence import build
from rhythmid.identify.descent import first_guess
from rhythmid.identify.free_run import prepare_run, start_of
from rhythmid.identify.record_scales import scales
from rhythmid.identify.series import Series, dominant_frequency
from rhythmid.model import Model
from rhythmid.simulation.signal import spline, zero_order_hold

Array = NDArray[np.float64]
HIGHEST = 0.4  # of the sample rate
LENGTH = 30.0  # periods of the dominant motion
NONE_NEEDED = (
    "none needed for these records; a larger and more varied excitation would exclude smaller effects"
)
MORE = "repeat the records with a larger and more varied excitation"
NONE_NEEDED_FREE = (
    "none needed for these records; releases from larger and smaller amplitudes would exclude smaller effects"
)
MORE_FREE = "repeat the records with releases from larger and smaller amplitudes"
# of the largest amplitude in the records: laws of position and of speed differ most far from the recorded amplitudes
RELEASES = (0.3, 3.0)
# chi-squared that an experiment has to be expected to show: half of it is the gain in log density, which has to reach the odds at which
# one hypothesis replaces a simpler one
SEPARATES = -2.0 * math.log(FALSE_ALARM)


@dataclass(frozen=True)
class Proposal:
    """An experiment of the menu, with the chi-squared by which it is expected to separate the two best rivals.

    `apart` is the rms difference of their outputs, in standard deviations of the noise.
    """

    words: str
    chi2: float
    apart: float


def _menu(
    size: float, unit: str, frequency: float, length: float, highest: float
) -> list[tuple[str, dict, float]]:
    """(words, excitation, factor on the forcing) for an input of this rms [unit], up to the frequency `highest` [Hz]."""
    top, above = min(7.0 * frequency, highest), min(21.0 * frequency, highest)
    found: list[tuple[str, dict, float]] = []
    for factor in (0.3, 1.0, 3.0):
        amplitude = factor * size
        told = f"{amplitude:.3g} {unit} ({'' if factor == 1.0 else f'{factor:g} times '}the rms of the recorded input)"
        found.append((f"a chirp of {told} from 0 to {top:.3g} Hz over {length:.3g} s",
                      {"type": "chirp", "amplitude": amplitude, "band": [0.0, top], "sweep": length}, 1.0))  # fmt: skip
        found.append((f"a step of the input to {told}, held for {length / 2:.3g} s and released",
                      {"type": "profile", "points": [[0.0, amplitude], [length / 2, 0.0]], "length": length}, 1.0))  # fmt: skip
    found.append((f"an odd multisine of {size:.3g} {unit} rms up to {above:.3g} Hz",
                  {"type": "multisine", "rms": size, "period": length / 3, "periods": 3, "band": [frequency / 5, above]},
                  1.0))  # fmt: skip
    for scale in (0.3, 3.0):
        words = f"the cycle alone with the forcing scaled by {scale:g}"
        found.append((words, {"type": "silence", "length": length}, scale))
    return found


def _of_the_input(series: Series, model: Model, sizes: Scales) -> tuple[float, str]:
    """Usual size of the input and its unit: a force, a motor's signal, a reference or the motion of the base."""
    fed = next(
        (t.element.takes for t in model.terms if t.element.slot == "actuator" and t.element.takes), None
    )
    position = model.units.position
    if series.kind == "force":
        unit = fed or model.units.force
    else:
        unit = f"{position}/s^2" if series.kind == "base_acceleration" else position
    own = float(np.std(series.drive))
    return (sizes.effort if own == 0.0 or (series.kind == "force" and fed is None) else own), unit


@dataclass(frozen=True)
class _Experiment:
    """A planned record: its inputs in `series`, and for a release from rest the position `released` [its unit]."""

    words: str
    series: Series
    released: float | None = None


def _predicted(trial: Trial, experiment: _Experiment, variance: float, step: float) -> Array | None:
    model = trial.model
    run = prepare_run(model, [experiment.series], step)
    if experiment.released is None:
        starts = first_guess(model, run)
    else:
        starts = [start_of(model, run, 0, experiment.released, 0.0)]
    outputs = fine_enough(run, model, starts, variance**0.5).outputs(model, starts)
    return None if outputs is None else outputs[0]


def _releases(sizes: Scales, model: Model, longest: Series) -> list[_Experiment]:
    """Releases from rest for an undriven machine, from a smaller and a larger amplitude than in the records.

    An angle is turned by half a turn at most: from there a pendulum falls the longest way.
    """
    largest = 0.5 * (sizes.high - sizes.low)
    unit = model.units.position
    n = len(longest.time)
    time = np.arange(n, dtype=float) * longest.period
    series = replace(
        longest, name="imagined", time=time, command=None, forcing=None, used=np.ones(longest.blocks, bool),
        ignored=None, hidden=None,
    )  # fmt: skip
    found = []
    for factor in RELEASES:
        amplitude = factor * largest
        if model.units.position == "rad" and amplitude > math.pi:
            continue
        words = f"a release at rest from {amplitude:.3g} {unit} beside the middle of the motion, {factor:g} times its amplitude"
        found.append(_Experiment(words, series, sizes.centre + amplitude))
    return found


def _played_menu(sizes: Scales, model: Model, longest: Series, frequency: float) -> list[_Experiment]:
    """Experiments that a driven machine can play."""
    size, unit = _of_the_input(longest, model, sizes)
    length = min(LENGTH / frequency, longest.time[-1] - longest.time[0])
    found = []
    for words, spec, factor in _menu(size, unit, frequency, length, HIGHEST / longest.period):
        if factor != 1.0 and longest.forcing is None:
            continue
        found.append(_Experiment(words, _imagined(longest, build(spec), factor)))
    return found


def _imagined(series: Series, excitation: Excitation, factor: float) -> Series:
    """The series with another command and its forcing scaled by `factor`, in free run, for the channels recorded."""
    time = np.arange(int(excitation.duration / series.period), dtype=float) * series.period
    forcing = series.forcing
    if forcing is not None:
        first, last = forcing.x[0], forcing.x[-1]
        if last - first < time[-1]:
            time = np.arange(0.0, last - first, series.period, dtype=np.float64)
        forcing = spline(time, factor * np.asarray(forcing(first + time)))
    return replace(
        series, name="imagined", time=time, value=np.resize(series.value, len(time)), forcing=forcing,
        command=zero_order_hold(time, excitation(time)), used=np.ones(len(time) // series.block, bool), ignored=None,
    )  # fmt: skip


def separation(a: Trial, b: Trial, series: Sequence[Series], variance: float, step: float) -> list[Proposal]:
    """Feasible experiments with the chi-squared that they are expected to show between two models, best first.

    A machine that nothing drives can be released.
    """
    sizes = scales(series, a.model)
    longest = max(series, key=lambda s: s.time[-1] - s.time[0])
    menu = (
        _releases(sizes, a.model, longest)
        if sizes.idle
        else _played_menu(sizes, a.model, longest, dominant_frequency(longest))
    )
    found: list[Proposal] = []
    for one in menu:
        first, second = _predicted(a, one, variance, step), _predicted(b, one, variance, step)
        if first is None or second is None:
            continue
        # the transient of an unknown initial state has decayed after a fifth; that of a release is known
        begin = len(first) // 5 if one.released is None else 0
        difference = first[begin:] - second[begin:]
        difference = difference - difference.mean()
        chi2 = float(difference @ difference) / max(variance, 1e-300)
        if math.isfinite(chi2):
            found.append(Proposal(one.words, chi2, math.sqrt(chi2 / len(difference))))
    return sorted(found, key=lambda p: -p.chi2)


def next_experiment(found: Search, rivals: Sequence[Trial], series: Sequence[Series], needed: bool) -> str:
    """One sentence: what to record next, and which question that decides.

    `rivals` are the models that the records do not tell from the best one. `needed` says whether a question is open.
    """
    best = found.best
    none, more = (NONE_NEEDED_FREE, MORE_FREE) if scales(series, best.model).idle else (NONE_NEEDED, MORE)
    if not needed:
        return none
    others = [t for t in rivals if t.key != best.key]
    menu = separation(best, others[0], series, found.noise.variance, found.fit.run.max_step) if others else []
    if not menu:
        return more
    top = menu[0]
    versus = " + ".join(others[0].added) or "the nominal model"
    mine = " + ".join(best.added) or "the nominal model"
    if top.chi2 < SEPARATES:
        return (
            f"none of the experiments that were compared would separate {mine} from {versus}: their outputs would differ by "
            f"{top.apart:.2g} standard deviations of the noise (rms) at most"
        )
    return (
        f"{top.words}: expected to separate {mine} from {versus}, whose outputs would then differ by "
        f"{top.apart:.2g} standard deviations of the noise (rms)"
    )
