"""Result of an identification: parameters, delays and HTFs, each with its uncertainty and its assumptions.

`Identification.to_dict` defines the JSON of `rhythmid identify --json`.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rhythmid.errors import InputError
from rhythmid.identify.caution import Caution
from rhythmid.identify.joint import JointFit
from rhythmid.identify.joint_covariance import JointCovariance
from rhythmid.identify.paper import PaperResult
from rhythmid.ltp.harmonic_estimate import HarmonicEstimate, HarmonicEstimates
from rhythmid.model import Model
from rhythmid.record.record import Record
from rhythmid.report.quantity import percent, pretty_unit
from rhythmid.result import Result, Row, axis_or_new, legend_above

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from rich.console import Console

    from rhythmid.identify.held_out import HeldOut

Array = NDArray[np.float64]
POINTS = 600  # largest number of frequencies of an HTF in the output


@dataclass(frozen=True)
class Estimate:
    """A value with its standard deviation.

    Attributes
    ----------
    value
        None where it is not identifiable.
    std
        Standard deviation; None where it is not known.
    unit
        Unit of both.

    Examples
    --------
    >>> Estimate(200.1, 0.4, "N/m").to_dict()
    {'value': 200.1, 'std': 0.4, 'unit': 'N/m'}
    """

    value: float | None
    std: float | None
    unit: str

    def to_dict(self) -> dict[str, Any]:
        return {"value": self.value, "std": self.std, "unit": self.unit}


@dataclass(frozen=True)
class Observables:
    """Observables of the delays.

    Attributes
    ----------
    phase
        Phase of the limit cycle, A = τ_y + δ_f [s].
    slope
        Slope of the response's phase, B = τ_u + τ_y [s].
    offset
        Offset of the sidebands' phases, C = τ_u − δ_f [s].
    z
        Closure A + C − B divided by its standard deviation.
    """

    phase: Estimate
    slope: Estimate
    offset: Estimate
    z: float

    def to_dict(self) -> dict[str, Any]:
        return {"A": self.phase.to_dict(), "B": self.slope.to_dict(), "C": self.offset.to_dict()}


@dataclass(frozen=True)
class InnerDelay:
    """A dead time inside the machine.

    Attributes
    ----------
    delay
        The dead time [s]; without a value where it is not `separable`.
    separable
        Whether the dead time alone is identifiable.
    reason
        Why not, where it is not.
    sums
        Identifiable sums with other delays [s], by their elements' labels.
    """

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
    """Delays of command and measurement.

    Attributes
    ----------
    input, measurement, sum
        τ_u, τ_y and τ_u + τ_y [s]. Input and measurement delay have no value where they are not `separable`.
    separable
        Whether both delays are identifiable separately.
    assumption
        Assumption on which the separation rests.
    closure
        Limit-cycle phase + sideband offset − slope of G_0, divided by its standard deviation. It is near zero for a
        correct model. None where one of the three is not identifiable.
    aliases
        Further pairs with the same fit.
    intervals
        95 % intervals of delays that are not separable [s].
    undetermined
        Changes of parameters to which the records are insensitive, in words.
    inner
        Dead times inside the machine, by their elements' labels.
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
    """Transfer functions to report: the `functions` Ĥ_m estimated without a model from the first record, whether
    the `paper`'s method is reported, and for each of the two the missing conditions."""

    functions: HarmonicEstimates | None
    paper: bool
    missing: str | None = None
    paper_missing: str | None = None


@dataclass(frozen=True, eq=False)
class Identification(Result):
    """Result of `rhythmid identify`.

    Attributes
    ----------
    model
        The model with all estimates, delays included.
    parameters
        Estimates by "element.parameter".
    delays
        Of the command and measurement paths.
    shown
        Transfer functions, as far as their conditions hold.
    paper
        Results of the paper's method, record by record; empty where it gives none.
    quality
        Rate [Hz], gaps, jitter_std [s], nrmse and other measures of the quality of records and fit.
    joint
        The joint fit; None where another method was requested.
    notes
        Messages for the user, one line each.
    cautions
        Reasons to doubt the estimates.
    held_out
        Free runs of the identified model over the held-out records; None without such records.

    Examples
    --------
    >>> import rhythmid as rh
    >>> chirp = {"type": "chirp", "amplitude": 0.02, "sweep": 4.0, "repetitions": 2}
    >>> found = rh.identify(rh.simulate(rh.paper_hopper(), {"excitation": chirp, "time": {"rate": 250}}).record)
    >>> found.usable, found.delays.separable
    (True, True)
    >>> round(found.parameters["linear_spring.stiffness"].value)
    200
    >>> len(found.covariance.names) == len(found.covariance.matrix)
    True
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
    held_out: "HeldOut | None" = None

    @property
    def usable(self) -> bool:
        """Whether the fit explains enough of the records to count as an identification."""
        return not any(caution.name == "not_identified" for caution in self.cautions)

    @property
    def headline(self) -> str:
        """Number of estimated parameters, and the share of the motion that the model leaves unexplained."""
        found = sum(one.value is not None for one in self.parameters.values())
        left = percent(self.quality["nrmse"])
        if not self.usable:
            why = next(caution.text for caution in self.cautions if caution.name == "not_identified")
            return why[0].upper() + why[1:]
        unseen = None if self.held_out is None else self.held_out.nrmse
        more = "" if unseen is None else f", and {percent(unseen)} of the held-out motion"
        return f"{found} of {len(self.parameters)} parameters identified; the free run leaves {left} of the motion{more}"

    @property
    def estimates(self) -> dict[str, Estimate]:
        """All estimates by name: the parameters, then `delay: input`, `delay: measurement` and `delay: sum` [s]."""
        delays = {"input": self.delays.input, "measurement": self.delays.measurement, "sum": self.delays.sum}
        return dict(self.parameters) | {f"delay: {name}": one for name, one in delays.items()}

    @property
    def covariance(self) -> JointCovariance:
        """Covariance of the estimates, delays included; `covariance.correlation` is their correlation.

        Raises InputError for the paper's method, which estimates magnitudes and phases separately.
        """
        if self.joint is None:
            raise InputError("the paper's method has no joint covariance; identify with method='joint'")
        return self.joint.fit.joint_covariance

    def tables(self) -> Mapping[str, Sequence[Row]]:
        """`estimates`; `harmonics`: the transfer functions, frequency by frequency; `held_out`: the error of each held-out record."""
        functions = self.shown.functions
        return {
            "estimates": [{"name": name} | one.to_dict() for name, one in self.estimates.items()],
            "harmonics": [
                {"m": one.m, "frequency": frequency, "magnitude": abs(value), "phase": float(np.angle(value)), "std": std}
                for one in (() if functions is None else functions.functions)
                for frequency, value, std in zip(one.frequency.tolist(), one.value.tolist(), one.std.tolist())
            ],
            "held_out": [] if self.held_out is None else [one.to_dict() for one in self.held_out.runs],
        }  # fmt: skip

    def show(self, console: "Console") -> None:
        """Print estimates, delays and cautions."""
        from rhythmid.identify.printed import show

        show(self.to_dict(), console)

    def _functions(self) -> HarmonicEstimates:
        if self.shown.functions is None:
            raise InputError(f"no transfer functions: {self.shown.missing}")
        return self.shown.functions

    def to_xarray(self) -> "xr.Dataset":
        """The transfer functions as an xarray Dataset over `harmonic` and `frequency`; see `HarmonicEstimates.to_xarray`.

        Raises InputError, with the missing condition, where no transfer functions were estimated.
        """
        return self._functions().to_xarray(f"{self.model.units.position}/{self.model.units.force}")

    def plot(self, axis: "Axes | None" = None, record: int = 0) -> "Axes":
        """Draw the measured motion and the identified model's free run over time.

        Parameters
        ----------
        axis
            Matplotlib axis; None for a new figure.
        record
            Index of the record.

        Raises
        ------
        InputError
            For the paper's method, which does not simulate.
        """
        if self.joint is None:
            raise InputError("the paper's method has no free run to draw; identify with method='joint'")
        axis, fit = axis_or_new(axis), self.joint.fit
        series = fit.run.series[record]
        axis.plot(series.centres, series.averaged, color="0.7", linewidth=3.0, label="measured")
        axis.plot(
            series.centres, series.averaged + fit.residuals[record], linewidth=1.0, label="identified model"
        )
        axis.set(xlabel="time [s]", ylabel=f"output [{pretty_unit(self.records[0].output.unit)}]")
        axis.margins(x=0.01)
        legend_above(axis)
        return axis

    def plot_transfer_function(self, m: int = 0, axis: "Axes | None" = None) -> "Axes":
        """Draw the magnitude of harmonic m over frequency with its 95 % region.

        Raises InputError where no transfer functions were estimated, or not this one.
        """
        one = self._functions().of(m)
        axis = axis_or_new(axis)
        size = np.abs(one.value)
        axis.fill_between(
            one.frequency, np.maximum(size - one.radius, 0.0), size + one.radius, alpha=0.3, label="95 %"
        )
        axis.plot(one.frequency, size, ".", markersize=3, color="black", label="estimate")
        units = self.model.units
        name = f"|$G_{{{m:+d}}}$|" if m else "|$G_0$|"
        axis.set(
            xlabel="output frequency [Hz]",
            ylabel=f"{name} [{pretty_unit(f'{units.position}/{units.force}')}]",
        )
        axis.set_ylim(bottom=0.0)
        legend_above(axis)
        return axis

    def to_dict(self) -> dict[str, Any]:
        """The JSON of `identify --json`; plain numbers, lists and strings."""
        functions = self.shown.functions
        paper = self.paper[0].delays if self.shown.paper else {}
        return {
            "usable": self.usable,
            "warnings": [caution.to_dict() for caution in self.cautions],
            "parameters": {name: estimate.to_dict() for name, estimate in self.parameters.items()},
            "delays": self.delays.to_dict(),
            "covariance": None if self.joint is None else self.covariance.to_dict(),
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
            "held_out": None if self.held_out is None else self.held_out.to_dict(),
            "notes": list(self.notes),
        }


def _harmonic(one: HarmonicEstimate) -> dict[str, Any]:
    """One transfer function as lists, thinned to the resolution of a figure."""
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
