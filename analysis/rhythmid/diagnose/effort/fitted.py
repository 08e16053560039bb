"""A fitted hypothesis about an effort, in the form that the evidence needs."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from rhythmid.diagnose.constants import UNNAMED_EFFORT
from rhythmid.diagnose.evidence import Linearised, odds_of_rests
from rhythmid.diagnose.hypothesis import Hypothesis, Kind, Prediction
from rhythmid.diagnose.size_error import std_beside_others
from rhythmid.identify.drive import controlled
from rhythmid.identify.inverse_dynamics.balance import Balance
from rhythmid.identify.inverse_dynamics.estimate import EffortFit, size_of
from rhythmid.identify.robust_covariance import weighted
from rhythmid.model import Model
from rhythmid.simulation.transport import INPUT_DELAY
from rhythmid.value import Prior

Array = NDArray[np.float64]


def odds_at_rest(fit: EffortFit, balance: Balance) -> Array:
    """Log odds (r,) of the rests of a balance under a fitted model.

    What models of real machines leave of the effort does not count against one.
    """
    return odds_of_rests(balance.rests.excess(fit.model), max(fit.scale, UNNAMED_EFFORT * size_of(balance)))


@dataclass(frozen=True, eq=False)
class Fitted:
    """One explanation of the effort.

    `elements` are the labels of the additions: a freed value's name, or `input_delay.delay` for a longer delay. `priors` are
    the priors of its fit. `shape` holds statistics of the effects by the name of the rule that uses them.
    """

    elements: tuple[str, ...]
    kind: Kind
    fit: EffortFit
    priors: dict[str, Prior]
    linearised: Linearised
    shape: Mapping[str, float] = field(default_factory=dict)

    @classmethod
    def of(
        cls, elements: tuple[str, ...], kind: Kind, fit: EffortFit, priors: dict[str, Prior], balance: Balance
    ) -> "Fitted":
        """The hypothesis of a fit to a balance; a parameter that ends at a bound counts as fixed there."""
        inside = ~fit.at_limit
        linearised = Linearised(
            fit.residual, fit.jacobian[:, inside], fit.precision[inside], fit.departure[inside], odds_at_rest(fit, balance)
        )  # fmt: skip
        return cls(elements, kind, fit, priors, linearised)

    @property
    def key(self) -> tuple[str, ...]:
        """The elements in alphabetical order, equal for equal structures."""
        return tuple(sorted(self.elements))

    @property
    def model(self) -> Model:
        """The fitted model; the additional delay found by the fit is added to its input delay, if it has one."""
        model, name = self.fit.model, INPUT_DELAY
        if name not in model.parameters or controlled(model):
            return model
        value = model.parameters[name]
        if value.fixed and name not in self.elements:
            return model
        late = max(value.value + self.fit.alignment, value.bounds[0])
        return model.with_parameters({name: replace(value, value=late)})

    def claimed(self, prediction: Prediction, nrmse: float | None = None) -> Hypothesis:
        """The hypothesis with its prediction, and its error on held-out data relative to the effort's variation."""
        model = self.fit.model
        values = {name: model.value(name) for name in self.fit.names}
        return Hypothesis.of(
            model, self.elements, self.kind, len(values), prediction, nrmse, self.shape, values
        )

    def std(self) -> dict[str, float]:
        """Standard deviations of the estimated parameters, inflated by the residual's autocorrelation."""
        return dict(zip(self.fit.names, np.asarray(self.fit.std[1:]).tolist(), strict=True))

    def std_beside_others(self) -> dict[str, float]:
        """The same, of each effect's parameters where those of the other effects are known."""
        rows = weighted(self.fit)
        std = {"alignment": float(self.fit.std[0])} | self.std()
        inside = dict(zip(std, rows.inside, strict=True))
        estimated = {name: std[name] for name in std if inside[name]}
        priors = [
            Prior(0.0, 1.0 / math.sqrt(one)) if one > 0.0 else None for one in self.fit.precision[rows.inside]
        ]
        return self.std() | std_beside_others(self.elements, estimated, rows.columns, priors)


def kind_of(elements: Sequence[str], model: Model) -> Kind:
    """The kind of hypothesis that these additions to the nominal model make."""
    if not elements:
        return "nominal"
    if INPUT_DELAY in elements:
        return "delay"
    return "effects" if all(model.term(label) is not None for label in elements) else "freed_value"
