"""Results of a diagnosis, as plain data for its report."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rhythmid.report.correlation import Correlation
from rhythmid.report.quantity import pretty_name
from rhythmid.report.record_quality import RecordQuality
from rhythmid.report.run import Compared, Run
from rhythmid.report.sections import Estimates

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ElementWords:
    """What the catalogue says of an element; `parameters` are the meanings of its parameters by name."""

    title: str
    parameters: Mapping[str, str]
    also_known_as: tuple[str, ...] = ()
    reference: str = ""


@dataclass(frozen=True)
class ElementScore:
    """Best score of one element in the first round: chi-squared of the score test."""

    element: str
    slot: str
    statistic: float


@dataclass(frozen=True, eq=False)
class FreeFunction:
    """The missing force (or sensor error) as an unknown smooth function of one quantity, before and after the effects are added.

    `explained` is the share of the mismatch that it explains in held-out blocks; `grid`, `force` (k,) draw it.
    """

    quantity: str
    explained: float
    grid: Array
    force: Array
    grid_unit: str
    force_unit: str
    explained_after: float | None = None
    grid_after: Array | None = None
    force_after: Array | None = None


@dataclass(frozen=True, eq=False)
class TransferChange:
    """Harmonic transfer functions of the refitted nominal and of the final model: complex128[h, n] of the harmonics
    `indices` (h,) at `frequency` [Hz] (n,); `unit` of output over input; `pumping` frequency [Hz], None without forcing."""

    frequency: Array
    indices: tuple[int, ...]
    before: NDArray[np.complex128]
    after: NDArray[np.complex128]
    unit: str
    pumping: float | None


@dataclass(frozen=True, eq=False)
class Findings:
    """The content of the page, as plain data. Fields with a default belong to one scoring mode only, and are left out if
    absent.

    Attributes
    ----------
    result : the diagnosis as its JSON has it.
    source : the nominal model's name and the records' names in words.
    slots : elements of the nominal model by slot; `forced` if a forcing was recorded.
    compared : quantity in which records and models are compared: motion or effort.
    runs : records with the predictions of the models, held-out records last.
    chosen : names of the chosen hypothesis; empty for the nominal model.
    output_unit, force_unit : units of the motion, and of the force.
    noise : standard deviation of the measurement noise in the compared averages, from repetitions; None if nothing repeats.
    slow_noise : of slow averages, per sample: noise as above, or the residual of the final model.
    scores : best score test of every element, best first; scores above `threshold` are significant.
    functions : free functions, the most explaining first.
    transfer : change of the transfer functions, or the reason why there is none; None where they were not looked at.
    nominal, refitted, refitted_delays : the nominal model's parameters as given and refitted, and its delays.
    at_bound : parameters of the final model that ended at a bound; `unconverged` models whose refit did not settle.
    words : descriptions of the mentioned elements in the catalogue, by name.
    hints : (element, other element, experiment that separates them).
    correlation : of the final model's parameters, if they were fitted together.
    """

    result: Mapping[str, Any]
    source: str
    slots: Mapping[str, tuple[str, ...]]
    forced: bool
    compared: Compared
    runs: tuple[Run, ...]
    chosen: tuple[str, ...]
    output_unit: str
    force_unit: str
    nominal: Estimates
    refitted: Estimates
    records: tuple[RecordQuality, ...]
    words: Mapping[str, ElementWords]
    command: str
    models: Mapping[str, str]
    refitted_delays: Mapping[str, Any] = field(default_factory=dict)
    noise: float | None = None
    slow_noise: float | None = None
    scores: tuple[ElementScore, ...] = ()
    threshold: float | None = None
    functions: tuple[FreeFunction, ...] = ()
    transfer: TransferChange | str | None = None
    at_bound: tuple[str, ...] = ()
    unconverged: tuple[tuple[str, ...], ...] = ()
    hints: tuple[tuple[str, str, str], ...] = ()
    correlation: Correlation | None = None

    @property
    def repaired(self) -> bool:
        """Whether anything was added to the nominal model, or set free in it."""
        return bool(self.result["missing"]) or any(run.after is not None for run in self.runs)

    @property
    def changed(self) -> str:
        """Difference of the final model from the refitted nominal one, in words."""
        return self.runs[0].labels[1] if self.runs else "with the added effect"

    def unit_of(self, quantity: str) -> str:
        """Unit of a quantity on which a mismatch may depend."""
        rates = {"velocity": "s", "acceleration": "s^2"}
        if quantity in rates:
            return f"{self.output_unit}/{rates[quantity]}"
        if quantity == "time":
            return "s"
        return self.force_unit if quantity in ("actuator force", "effort", "load") else self.output_unit

    def title(self, element: str) -> str:
        """The element's name as a heading has it."""
        return self.words[element].title if element in self.words else pretty_name(element).capitalize()
