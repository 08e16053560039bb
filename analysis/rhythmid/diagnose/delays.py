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
    both = bool(found["input"] and found["measurement"])
    if both:
        chosen = list(places.values())
        with np.errstate(invalid="ignore"):  # infinity minus infinity: undetermined
            variance = float(fit.covariance[np.ix_(chosen, chosen)].sum())
        total = found["input"]["value"] + found["measurement"]["value"]
        scatter = math.sqrt(max(variance, 0.0)) if math.isfinite(variance) else None
        found["sum"] = {"value": total, "std": scatter, "unit": "s"}
    else:
        found["sum"] = dict(found["input"] or found["measurement"])
    limit = max(20.0 * (found["sum"].get("std") or 0.0), 2e-3)
    known = [found[key]["std"] is not None and found[key]["std"] < limit for key in places]
    found["separable"] = both and (len(known) < 2 or all(known))
    if all(one.forcing is None for one in fit.run.series):
        found["assumption"] = (
            "no forcing is recorded: only the sum of the delays shows, and it is written to the one delay that is free"
        )
    elif both:
        found["assumption"] = (
            "the recorded forcing acts on the machine at its stamps, without the command's delay"
        )
    else:
        found["assumption"] = "the model has one delay, which stands for both"
    return found
