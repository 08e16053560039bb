"""The delay of the motion behind the effort: told, and saved as the model's input delay, where the records show one."""

import math

from rhythmid.diagnose.answer.result import Estimate
from rhythmid.diagnose.answer.wording import unstated_delay
from rhythmid.diagnose.effort.fitted import Fitted
from rhythmid.elements.catalogue import load_catalogue
from rhythmid.identify.drive import controlled
from rhythmid.identify.inverse_dynamics.balance import Balance
from rhythmid.identify.inverse_dynamics.estimate import ROUGH, Alignment
from rhythmid.model import Model
from rhythmid.simulation.transport import INPUT_DELAY


def found_delay(balance: Balance, fitted: Fitted) -> Estimate:
    """Time [s] by which the motion lags the effort, the model's delays included. Without a standard deviation at a limit of the
    alignment, where the fit does not tell it."""
    fit = fitted.fit
    late = fit.alignment if balance.by_reference else balance.later(fit.model, fit.alignment)
    std = math.hypot(float(fit.std[0]), ROUGH * balance.period)
    return Estimate(late, std if math.isfinite(std) and not fit.at_limit[0] else None, "s")


def _unstated(balance: Balance, fitted: Fitted, nominal: Model) -> Estimate | None:
    """The delay, where the nominal model has none and the stamps, which are known to a sample, do not explain it."""
    if (
        balance.by_reference
        or controlled(fitted.fit.model)
        or INPUT_DELAY in (*nominal.parameters, *fitted.elements)
    ):
        return None
    found = found_delay(balance, fitted)
    return found if found.value > Alignment.of(balance).std else None


def delay_told(balance: Balance, fitted: Fitted, nominal: Model) -> tuple[str, ...]:
    """The sentence about a delay that the nominal model does not have."""
    found = _unstated(balance, fitted, nominal)
    return () if found is None else unstated_delay(found.value, found.std)


def with_found_delay(balance: Balance, fitted: Fitted, nominal: Model) -> Model:
    """The fitted model with the delay that `delay_told` tells as its input delay."""
    model, found = fitted.model, _unstated(balance, fitted, nominal)
    if found is None or not unstated_delay(found.value, found.std):
        return model
    return model.with_element(load_catalogue()["input_delay"], {"delay": found.value})
