"""The two delays of a fit and their sum, and whether the records separate them."""

import math
from typing import Any

import numpy as np

from rhythmid.identify.output_error import Fit
from rhythmid.simulation.transport import INPUT_DELAY, MEASUREMENT_DELAY

# share of a prior's standard deviation above which an estimate only repeats it: the records then hold less than a
# fiftieth of the prior's information
REPEATS = 0.99
NAMES = {"input": INPUT_DELAY, "measurement": MEASUREMENT_DELAY}


def delays_of(fit: Fit) -> dict[str, Any]:
    """Delays with standard deviations [s], in the format of the JSON output.

    A standard deviation is None where the records do not determine the delay, so that it is that of its prior.
    """
    found: dict[str, Any] = {}
    places = {}
    for key, name in NAMES.items():
        if name in fit.model.parameters:
            value = fit.model.value(name)
            std, prior = fit.std.get(name, 0.0), fit.model.parameters[name].prior
            told = std < (math.inf if prior is None else REPEATS * prior.std)
            found[key] = {"value": value, "std": std if told else None, "unit": "s"}
            if name in fit.names:
                places[key] = fit.names.index(name)
        else:
            found[key] = {}
    if found["input"] and found["measurement"]:
        chosen = list(places.values())
        with np.errstate(invalid="ignore"):  # infinity minus infinity: undetermined
            variance = float(fit.covariance[np.ix_(chosen, chosen)].sum())
        total = found["input"]["value"] + found["measurement"]["value"]
        scatter = math.sqrt(max(variance, 0.0)) if math.isfinite(variance) else None
        found["sum"] = {"value": total, "std": scatter, "unit": "s"}
    else:
        found["sum"] = dict(found["input"] or found["measurement"])
    separable = True
    if len(places) == 2:
        each = [found[key]["std"] for key in places]
        limit = max(20.0 * (found["sum"]["std"] or 0.0), 2e-3)
        separable = all(std is not None and std < limit for std in each)
    elif len(places) < 2 and not (found["input"] and found["measurement"]):
        separable = False
    found["separable"] = separable
    forced = any(one.forcing is not None for one in fit.run.series)
    if not forced:
        found["assumption"] = (
            "no forcing is recorded: only the sum of the delays shows, and it is written to the one delay that is free"
        )
    elif found["input"] and found["measurement"]:
        found["assumption"] = (
            "the recorded forcing acts on the machine at its stamps, without the command's delay"
        )
    else:
        found["assumption"] = "the model has one delay, which stands for both"
    return found
