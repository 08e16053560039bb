"""Detects held-out records whose output is measured from another zero than in the fit. They are reported, not corrected.

Where an encoder was zeroed at another position, a correct model predicts such a record badly. The zero is reported
where it alone explains nearly all of a large error.
"""

import math
from collections.abc import Sequence

import numpy as np

from rhythmid.errors import InputError
from rhythmid.identify.noise import NoiseModel
from rhythmid.identify.output_error import Fit, start_only
from rhythmid.identify.own_zeros import LEFT
from rhythmid.identify.record_zero import moved, with_record_zero
from rhythmid.identify.series import Series, record_of
from rhythmid.identify.zero_estimates import zeros_of
from rhythmid.model import Model

# least unexplained share of the motion of a held-out record for which its zero is estimated
MISFIT_OF_WRONG_ZERO = 0.1
# ratio to the least error within which the smallest zero is reported: zeros one turn apart fit equally well
AS_GOOD = 1.1
TURNS = (0.5, -0.5, 1.0, -1.0)  # turns by which an encoder's zero may be off at a rotating joint


def held_out_zero_notes(fit: Fit, unseen: Sequence[Series]) -> tuple[str, ...]:
    """A sentence on each held-out record whose zero differs from that of the fitted records; none where zeros are
    not identifiable."""
    if not unseen or unseen[0].measured != "position":
        return ()
    own = {record_of(one) for one in fit.run.series}
    names = dict.fromkeys(record_of(one) for one in unseen if one.zero is None and record_of(one) not in own)
    middle = float(np.mean([np.mean(one.value) for one in fit.run.series]))
    found: list[str] = []
    for name in names:
        parts = [one for one in unseen if record_of(one) == name]
        zero = _zero_of(fit, parts, middle)
        if zero is not None:
            found.append(_sentence(name, zero, fit.model.units.position))
    return tuple(found)


def _zero_of(fit: Fit, parts: Sequence[Series], middle: float) -> float | None:
    """Zero of a record relative to that of the fit, where it explains nearly all of a large error; else None."""
    model, step = fit.model, fit.run.max_step
    error = _error(model, parts, fit.noise, step)
    size = math.sqrt(float(np.mean([np.var(one.value) for one in parts])))
    if error is None or error[0] < MISFIT_OF_WRONG_ZERO * size:
        return None
    starts = [0.0, float(np.mean([np.mean(one.value) for one in parts])) - middle]
    if model.units.position == "rad":
        starts += [2.0 * math.pi * turn for turn in TURNS]
    free = with_record_zero(model)
    tried = [_error(free, [moved(one, start) for one in parts], fit.noise, step) for start in starts]
    told = [one for one in tried if one is not None]
    least = min((left for left, _ in told), default=math.inf)
    if least**2 > LEFT * error[0] ** 2:
        return None
    return min((zero for left, zero in told if left <= AS_GOOD * least), key=abs)


def _error(
    model: Model, parts: Sequence[Series], noise: NoiseModel, step: float
) -> tuple[float, float] | None:
    """The rms residual of a record, and the record's zero; None where the record cannot be simulated."""
    try:
        fit = start_only(model, parts, noise, step)
        zeros = [value for value, _ in zeros_of(fit).values()]
    except InputError:
        return None
    return fit.white.std, zeros[0] if zeros else 0.0


def _sentence(name: str, zero: float, unit: str) -> str:
    return (
        f"The output's zero of the held-out {name} is {zero:+.3g} {unit} from that of the records of the fit, which explains nearly all "
        f"that the model leaves of it: an encoder that was zeroed elsewhere? Give that record  offset: {-zero:.3g}  in its signals."
    )
