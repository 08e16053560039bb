"""Efforts of records that no fit has seen, as fitted models predict them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhythmid.diagnose.effort.fitted import Fitted
from rhythmid.identify.inverse_dynamics.balance import Balance
from rhythmid.identify.inverse_dynamics.estimate import variation_of
from rhythmid.model import Model
from rhythmid.record.record import Record

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class HeldOut:
    """The balance of effort of held-out records, filtered as the search's own was."""

    balance: Balance

    @classmethod
    def of(cls, records: Sequence[Record], model: Model, fitted_on: Balance) -> "HeldOut":
        """Raises InputError where the records hold no effort, or too little motion."""
        return cls(Balance.of(records, model, fitted_on.bandwidth))

    def residual(self, fitted: Fitted) -> Array:
        """Predicted less recorded effort (n,)."""
        fit = fitted.fit
        return self.balance.predicted(fit.model, fit.alignment) - self.balance.measured

    def error(self, fitted: Fitted) -> float:
        """Error (rms) of the predicted effort, as a share of the variation of the recorded one."""
        return float(np.sqrt(np.mean(self.residual(fitted) ** 2))) / variation_of(self.balance)
