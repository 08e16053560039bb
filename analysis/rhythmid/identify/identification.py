"""What is found in records: parameters, delays, HTFs, each with its uncertainty, and on which assumptions.

`Identification.to_dict` is the contract of `rhythmid identify --json`.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rhythmid.identify.caution import Caution
from rhythmid.identify.joint import JointFit
from rhythmid.identify.paper import PaperResult
from rhythmid.ltp.harmonic_estimate import HarmonicEstimate, HarmonicEstimates
from rhythmid.model import Model
from rhythmid.record.record import Record

Array = NDArray[np.float64]
POINTS = 600  # of an HTF that are written out at most


@dataclass(frozen=True)
class Estimate:
    """A value with its standard deviation; `value` None where the question has no answer."""

    value: float | None
    std: float | None
    unit: str

    def to_dict(self) -> dict[str, Any]:
        return {"value": self.value, "std": self.std, "unit": self.unit}


@dataclass(frozen=True)
class Observables:
    """What the records show of the delays [s]: the limit cycle's `phase` A = τ_y + δ_f, the `slope` B = τ_u + τ_y, the
    sidebands' `offset` C = τ_u − δ_f, and `z`, the closure A + C − B in its standard deviations."""

    phase: Estimate
    slope: Estimate
    offset: Estimate
    z: float

    def to_dict(self) -> dict[str, Any]:
        return {"A": self.phase.to_dict(), "B": self.slope.to_dict(), "C": self.offset.to_dict()}


@dataclass(frozen=True)
class InnerDelay:
    """A dead time inside the machine [s]. Where it is not `separable` it has no value, `reason` says why, and `sums` are those
    with other delays that are determined, by their elements' labels."""

    delay: Estimate
    separable: bool = True
    reason: str = ""
    sums: Mapping[str, Estimate] = field(default_factory=dict)

    def to_dict(self) -> dict[str, Any]:
        return self.delay.to_dict() | {
            "separable": self.separable,
            "reason": self.reason,
            "sums": {label: total.to_dict() for label, total in self.sums.items()},
        }


@dataclass(frozen=True)
class Delays:
    """Input delay τ_u, measurement delay τ_y and their sum [s].

    `separable` tells whether the two can be told apart; if not they have no value. `assumption` is what the split rests
    on. `closure` is (limit-cycle phase + sideband offset − slope of G_0) in its standard deviations, which a right model
    keeps near zero; None where one of the three cannot be had. `aliases` are further pairs that fit as well.
    `intervals` (95 %) are what can be said of delays that cannot be told apart; `undetermined` says in words which
    changes of parameters the records do not notice. `inner` are dead times inside the machine, by their elements' labels.
    """

    input: Estimate
    measurement: Estimate
    sum: Estimate
    separable: bool
    assumption: str
    closure: float | None = None
    aliases: tuple[tuple[float, float], ...] = ()
    intervals: Mapping[str, tuple[float, float]] | None = None
    observables: Observables | None = None
    undetermined: tuple[str, ...] = ()
    inner: Mapping[str, InnerDelay] = field(default_factory=dict)

    def to_dict(self) -> dict[str, Any]:
        return {
            "input": self.input.to_dict(),
            "measurement": self.measurement.to_dict(),
            "sum": self.sum.to_dict(),
            "separable": self.separable,
            "assumption": self.assumption,
            "closure": {"z": self.closure},
            "aliases": [list(pair) for pair in self.aliases],
            "intervals": None
            if self.intervals is None
            else {n: list(pair) for n, pair in self.intervals.items()},
            "observables": None if self.observables is None else self.observables.to_dict(),
            "undetermined": list(self.undetermined),
            "inner": {label: one.to_dict() for label, one in self.inner.items()},
        }


@dataclass(frozen=True, eq=False)
class Shown:
    """What is shown of transfer functions: the `functions` Ĥ_m found in the first record without a model, whether the `paper`'s
    method is, and for each what is missing where it is not."""

    functions: HarmonicEstimates | None
    paper: bool
    missing: str | None = None
    paper_missing: str | None = None


@dataclass(frozen=True, eq=False)
class Identification:
    """The answer to `rhythmid identify`.

    Attributes
    ----------
    model : the model with all estimates in it, delays included.
    parameters : estimates by "element.parameter".
    delays : of the command and measurement paths.
    shown : transfer functions, as far as their conditions hold.
    paper : the paper's method, record by record; empty where it finds nothing.
    quality : rate [Hz], gaps, jitter_std [s], nrmse and what else tells how far to trust the rest.
    joint : the joint fit; None where another method was asked for.
    notes : what the user should know, one line each.
    cautions : what should keep a user from believing the estimates.
    """

    model: Model
    records: tuple[Record, ...]
    parameters: Mapping[str, Estimate]
    delays: Delays
    shown: Shown
    paper: tuple[PaperResult, ...]
    quality: Mapping[str, Any]
    notes: tuple[str, ...] = field(default_factory=tuple)
    joint: JointFit | None = None
    cautions: tuple[Caution, ...] = ()

    @property
    def usable(self) -> bool:
        """Whether the fit explains enough of the records to be called an identification."""
        return not any(caution.name == "not_identified" for caution in self.cautions)

    def to_dict(self) -> dict[str, Any]:
        """The JSON of `identify --json`; plain numbers, lists and strings."""
        functions = self.shown.functions
        paper = self.paper[0].delays if self.shown.paper else {}
        return {
            "usable": self.usable,
            "warnings": [caution.to_dict() for caution in self.cautions],
            "parameters": {name: estimate.to_dict() for name, estimate in self.parameters.items()},
            "delays": self.delays.to_dict(),
            "harmonics": [] if functions is None else [_harmonic(one) for one in functions.functions],
            "transfer_functions": {
                "method": None if functions is None else functions.method,
                "missing": self.shown.missing,
                "false_alarm": 0.0 if functions is None else functions.false_alarm,
                "tested": [
                    {"m": t.m, "p_value": t.p_value, "visible": t.visible}
                    for t in (() if functions is None else functions.tested)
                ],
            },
            "methods": {
                "paper": {harmonic_name(m): d.to_dict() for m, d in paper.items()},
                "paper_missing": self.shown.paper_missing,
            },
            "quality": dict(self.quality),
            "notes": list(self.notes),
        }


def _harmonic(one: HarmonicEstimate) -> dict[str, Any]:
    """One transfer function as lists, thinned to what a figure needs."""
    thin = slice(None, None, max(1, -(-len(one.value) // POINTS)))
    value = one.value[thin]
    return {
        "m": one.m,
        "frequency": one.frequency[thin].tolist(),
        "magnitude": np.abs(value).tolist(),
        "phase": np.angle(value).tolist(),
        "std": one.std[thin].tolist(),
        "radius": one.radius[thin].tolist(),
        "noise": one.noise[thin].tolist(),
        "even_distortion": one.even[thin].tolist(),
        "odd_distortion": one.odd[thin].tolist(),
        "aliasing": one.aliasing[thin].tolist(),
    }


def harmonic_name(m: int) -> str:
    """G0, G-1, G+1, …"""
    return "G0" if m == 0 else f"G{m:+d}"
