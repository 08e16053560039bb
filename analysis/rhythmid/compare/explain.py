"""Explain the difference of two aligned motions without a model: which change of one makes it equal to the other?

Effects on the input and output channels are applied to the simulated motion, whatever their size (`corrections`). Forces are unknown
smooth functions of position, velocity, phase or time. Their effect on the motion is computed by an oscillator fitted to the
simulation (`forces`), and judged on stretches left out of their fit. Of explanations that are almost equally good the simplest is
taken. The search then continues with the remainder.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from rhythmid.compare.channel_corrections import ALIKE, CORRECTIONS, Correction, predicted
from rhythmid.compare.forces import force_functions, foreign_line
from rhythmid.compare.pair import Pair

Array = NDArray[np.float64]
FOLDS, DEALT = 5, 20  # folds of a cross-validation, stretches in each
LEAST_SHARE = 0.02  # share of the remainder that an explanation must remove
# share of the whole difference that it must remove where the oscillator limits the accuracy
LEAST_OF_WHOLE = 0.004
LEAST_OF_WHOLE_CHANNEL = 0.001  # the same among channel corrections, which are applied exactly
LEAST_OF_WHOLE_ROUGH = 0.05  # the same where limit cycle and response had to be shifted separately
SIMPLER = 0.03  # share by which a simpler explanation may be worse
MOST_EXPLANATIONS = 4
EQUIVALENT = {
    "command_lag": "input_delay", "input_delay": "command_lag", "sensor_lag": "measurement_delay", "measurement_delay": "sensor_lag",
}  # fmt: skip
UNITS = {"time": "s", "lag": "s", "gain": "", "skew": ""}


@dataclass(frozen=True)
class Explanation:
    """An explanation that removes the share `explained` of the difference left before it.

    `name` is an element of the catalogue, or the quantity that a free function depends on. `slot` is its place in the signal path.
    `also` lists observationally equivalent changes. `values` maps names to (value, unit).
    """

    name: str
    slot: str | None
    explained: float
    values: Mapping[str, tuple[float, str]] = field(default_factory=dict)
    also: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Trial:
    """A tried explanation.

    `square` is the sum of squares that it leaves, `rank` its complexity (0 is the simplest). It needs either the values of all
    channel corrections or the columns of a function.
    """

    square: float
    rank: int
    what: Explanation
    values: dict[str, float] | None = None
    columns: Array | None = None


class Difference:
    """The remaining difference of a pair, with a free initial state and the forces found so far projected out."""

    def __init__(self, pair: Pair) -> None:
        self.pair = pair
        self.values: dict[str, float] = {}
        self.force: Array | None = None
        self._settle()

    def take(self, trial: Trial) -> None:
        """Accept an explanation."""
        if trial.values is not None:
            self.values = trial.values
        else:
            self.force = trial.columns
        self._settle()

    def without_force(self) -> None:
        """Remove the force, so that it can be sought again beside the channel corrections."""
        self.force = None
        self._settle()

    def _settle(self) -> None:
        free = self.pair.oscillator.free(self.pair.time)
        self.columns = free if self.force is None else np.hstack([free, self.force])
        used = self.columns[self.pair.used]
        norms = np.linalg.norm(used, axis=0)
        left, size, _ = np.linalg.svd(used / np.where(norms > 0.0, norms, 1.0), full_matrices=False)
        self.basis = left[:, size > 1e-8 * size[0]]
        self.residual = self._left(self.values)
        self.square = float(self.residual @ self.residual)

    def _left(self, values: Mapping[str, float]) -> Array:
        raw = (self.pair.recording - predicted(self.pair, values))[self.pair.used]
        return raw - self.basis @ (self.basis.T @ raw)

    def whole(self) -> Array:
        """The remainder (n,) at all times."""
        raw = self.pair.recording - predicted(self.pair, self.values)
        return (
            raw
            - self.columns
            @ np.linalg.lstsq(self.columns[self.pair.used], raw[self.pair.used], rcond=1e-10)[0]
        )

    def share(self, square: float) -> float:
        """Share of the remainder beyond noise that is removed if the sum of squares `square` is left."""
        floor = len(self.residual) * self.pair.noise**2
        beyond = self.square - floor if self.square > 1.5 * floor else self.square
        return (self.square - square) / max(beyond, 1e-300)

    def fitted(
        self, names: list[str], correction: Correction | None = None
    ) -> tuple[float, dict[str, float]]:
        """Fit these corrections together; of the last one, `correction`, several starts are tried. Sum of squares and values."""
        pair = self.pair
        span, size, length = (
            1.0 / pair.frequency,
            float(np.std(pair.recording)),
            float(pair.time[-1] - pair.time[0]),
        )
        scale = {
            "time": 0.05 * span,
            "lag": 0.05 * span,
            "gain": 0.1,
            "length": size,
            "rate": size / length,
            "skew": 0.1 * span / length,
        }
        kinds = {one.name: one for one in CORRECTIONS}
        sizes = np.array([scale[kinds[name].kind] for name in names])
        begin = np.array([self.values.get(name, kinds[name].neutral) for name in names])

        def left(scaled: Array) -> Array:
            return self._left(dict(zip(names, scaled * sizes)))

        if correction is not None:
            first = {
                "time": np.linspace(-0.5, 0.5, 25) * span, "lag": np.geomspace(2e-3, 0.5, 7) * span,
                "gain": np.array([0.7, 1.0, 1.4]), "skew": np.linspace(-0.4, 0.4, 9) * span / length,
            }.get(correction.kind, np.array([correction.neutral]))  # fmt: skip
            tried = [float(np.sum(left(np.array([*begin[:-1], start]) / sizes) ** 2)) for start in first]
            begin[-1] = first[int(np.argmin(tried))]
        low = np.array([0.0 if kinds[name].kind == "lag" else -np.inf for name in names])
        found = least_squares(left, np.maximum(begin / sizes, low + 1e-9), bounds=(low, np.inf), max_nfev=40)
        return 2.0 * float(found.cost), {name: float(v) for name, v in zip(names, found.x * sizes)}

    def left_out(self, columns: Array) -> float:
        """Sum of squares on stretches left out of the fit of these columns."""
        part = columns[self.pair.used]
        part = part - self.basis @ (self.basis.T @ part)
        norms = np.linalg.norm(part, axis=0)
        kept = norms > 1e-9 * max(float(norms.max()), 1e-300)
        part = part[:, kept] / norms[kept]
        ridge = 1e-6 * np.eye(part.shape[1])
        edges = np.linspace(0, len(part), FOLDS * DEALT + 1).astype(int)
        total = 0.0
        for fold in range(FOLDS):
            test = np.zeros(len(part), bool)
            for index in range(fold, FOLDS * DEALT, FOLDS):
                test[edges[index] : edges[index + 1]] = True
            seen = part[~test]
            solution = np.linalg.solve(seen.T @ seen + ridge, seen.T @ self.residual[~test])
            total += float(np.sum((self.residual[test] - part[test] @ solution) ** 2))
        return total

    def corrections(self, blind: bool) -> list[Trial]:
        """Every channel correction, fitted with those already found; `blind` where the motions themselves were aligned."""
        found = []
        for correction in CORRECTIONS:
            if correction.name in self.values or (blind and correction.name == "measurement_delay"):
                continue
            if (self.pair.cycle is None and correction.slot == "command") or (
                self.pair.effort is None and correction.slot == "actuator"
            ):
                continue
            square, values = self.fitted([*self.values, correction.name], correction)
            extra = (
                ("input_delay",) if correction.name == "measurement_delay" and self.pair.cycle is None else ()
            )
            what = Explanation(
                correction.name, correction.slot, 0.0, also=(*extra, *ALIKE.get(correction.name, ()))
            )
            found.append(Trial(square, 0, what, values=values))
        return found

    def forces(self) -> list[Trial]:
        """Every possible missing force: a spectral line that is no harmonic of the forcing, and free functions."""
        found = []
        line = foreign_line(self.pair, self.whole())
        if line is not None:
            what = Explanation("periodic_disturbance", "force", 0.0, {"frequency": (line[0], "Hz")})
            found.append(Trial(self.left_out(line[1]), 3, what, columns=line[1]))
        late = self.values.get("measurement_delay", 0.0)
        for name, slot, rank, functions in force_functions(self.pair, late):
            columns = self.pair.oscillator.response(functions, self.pair.step)
            found.append(Trial(self.left_out(columns), rank, Explanation(name, slot, 0.0), columns=columns))
        return found

    def simplest(self, trials: list[Trial]) -> Trial:
        """The best of the simplest trials among those almost as good as the best of all."""
        top = self.share(min(trial.square for trial in trials))
        near = [trial for trial in trials if self.share(trial.square) >= (1.0 - SIMPLER) * top]
        return min(near, key=lambda trial: (trial.rank, trial.square))

    def told(self, trial: Trial) -> Explanation:
        """The trial's explanation with the share of the remainder that it removes."""
        return replace(trial.what, explained=float(np.clip(self.share(trial.square), 0.0, 1.0)))


def explain(
    pair: Pair, unit: str, blind: bool = False, rough: bool = False
) -> tuple[list[Explanation], Array]:
    """Explain the difference of a pair whose motions are in `unit`, step by step; also returns the remainder (n,).

    `blind`: the motions themselves were aligned, which hides a constant delay. `rough`: the pair is not exact.
    """
    known = Difference(pair)
    raw = (pair.recording - pair.simulation)[pair.used]
    whole = float(raw @ raw)
    found: list[Explanation] = []
    if known.square < 0.5 * whole:
        found.append(Explanation("another start", None, 1.0 - known.square / whole))
        rough = True
    floor = max(1.05 * len(known.residual) * pair.noise**2, 1e-12 * float(np.sum(pair.recording**2)))
    for _ in range(MOST_EXPLANATIONS):
        if known.square <= floor:
            break
        if known.force is not None and pair.effort is None:
            break
        trials = known.corrections(blind) + (known.forces() if known.force is None else [])
        chosen = known.simplest(trials)
        gain = known.square - chosen.square
        faint = (
            LEAST_OF_WHOLE_ROUGH
            if rough
            else LEAST_OF_WHOLE_CHANNEL
            if known.force is None and chosen.values is not None
            else LEAST_OF_WHOLE
        )
        if gain < LEAST_SHARE * known.square or gain < faint * whole:
            break
        found.append(known.told(chosen))
        known.take(chosen)
    found = _pruned(known, found, whole)
    if known.force is not None and known.values:
        found = _force_anew(known, found)
    found = _swapped(known, found)
    return [_valued(one, known.values, unit) for one in found], known.whole()


def _pruned(known: Difference, found: list[Explanation], whole: float) -> list[Explanation]:
    """The explanations without those that later ones have made unnecessary."""
    for one in found[:-1]:
        rest = [name for name in known.values if name != one.name]
        if one.name not in known.values or not rest:
            continue
        square, values = known.fitted(rest)
        if (
            square - known.square
            < (LEAST_OF_WHOLE_CHANNEL if known.force is None else LEAST_OF_WHOLE) * whole
        ):
            known.take(Trial(square, 0, one, values=values))
            found = [other for other in found if other is not one]
    return found


def _force_anew(known: Difference, found: list[Explanation]) -> list[Explanation]:
    """Seek the force again with the channel corrections known: it may be simpler than it appeared without them."""
    before = next(one for one in found if one.slot is not None and one.name not in known.values)
    known.without_force()
    chosen = known.simplest(known.forces())
    again = known.told(chosen)
    known.take(chosen)
    if known.values:
        square, values = known.fitted(list(known.values))
        known.take(Trial(square, 0, again, values=values))
    return [replace(again, explained=max(again.explained, 0.0)) if one is before else one for one in found]


def _swapped(known: Difference, found: list[Explanation]) -> list[Explanation]:
    """The explanations with a lag instead of a delay, or the reverse, where that fits better beside all the others."""
    for one in list(found):
        other = EQUIVALENT.get(one.name)
        if other is None or one.name not in known.values or other in known.values:
            continue
        correction = next(w for w in CORRECTIONS if w.name == other)
        square, values = known.fitted(
            [*(name for name in known.values if name != one.name), other], correction
        )
        if square < known.square:
            known.take(Trial(square, 0, one, values=values))
            named = replace(one, name=other, slot=correction.slot, also=ALIKE.get(other, ()))
            found = [named if old is one else old for old in found]
    return found


def _valued(one: Explanation, values: Mapping[str, float], unit: str) -> Explanation:
    """The explanation with the value from the fit of all of them together."""
    correction = next((w for w in CORRECTIONS if w.name == one.name), None)
    if correction is None or one.name not in values:
        return one
    named = {"length": unit, "rate": f"{unit}/s"}.get(correction.kind) or UNITS.get(correction.kind, "")
    return replace(one, values={correction.parameter: (values[one.name], named)})
