"""A hypothesis about an effort, fitted, in the form that the evidence takes."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from rhythmid.diagnose.evidence import Linearised
from rhythmid.diagnose.hypothesis import Hypothesis, Kind, Prediction
from rhythmid.identify.drive import controlled
from rhythmid.identify.inverse_dynamics.estimate import EffortFit
from rhythmid.model import Model
from rhythmid.simulation.transport import INPUT_DELAY
from rhythmid.value import Prior


@dataclass(frozen=True, eq=False)
class Fitted:
    """One explanation of the effort.

    `elements` are the labels of what was added (a freed value's name; `input_delay.delay` for a longer delay), `priors` what
    its fit knew before the data, `shape` statistics of the effects themselves, by the name of the rule that looks at them.
    """

    elements: tuple[str, ...]
    kind: Kind
    fit: EffortFit
    priors: dict[str, Prior]
    linearised: Linearised
    shape: Mapping[str, float] = field(default_factory=dict)

    @classmethod
    def of(cls, elements: tuple[str, ...], kind: Kind, fit: EffortFit, priors: dict[str, Prior]) -> "Fitted":
        """The fit with what ends at a bound taken for fixed there."""
        inside = ~fit.at_limit
        linearised = Linearised(
            fit.residual, fit.jacobian[:, inside], fit.precision[inside], fit.departure[inside]
        )
        return cls(elements, kind, fit, priors, linearised)

    @property
    def model(self) -> Model:
        """The fitted model; a delay that was found beyond its own is in its input delay, where it has one."""
        model, name = self.fit.model, INPUT_DELAY
        if name not in model.parameters or controlled(model):
            return model
        value = model.parameters[name]
        if value.fixed and name not in self.elements:
            return model
        late = max(value.value + self.fit.alignment, value.bounds[0])
        return model.with_parameters({name: replace(value, value=late)})

    @property
    def size(self) -> int:
        """Number of parameters."""
        return len(self.fit.names)

    def claimed(self, prediction: Prediction, nrmse: float | None = None) -> Hypothesis:
        """The hypothesis with what it predicts, and its error on held-out data as a share of the effort's variation."""
        model = self.fit.model
        values = {name: model.value(name) for name in self.fit.names}
        return Hypothesis.of(
            model, self.elements, self.kind, self.size, prediction, nrmse, self.shape, values
        )

    def std(self) -> dict[str, float]:
        """Standard deviations of the estimated parameters, inflated by the residual's autocorrelation."""
        return dict(zip(self.fit.names, np.asarray(self.fit.std[1:]).tolist(), strict=True))
