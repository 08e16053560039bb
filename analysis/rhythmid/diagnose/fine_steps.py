"""Fine steps: the chosen model fitted again with integration steps so short that they move no estimate.

The search compares models, for which an integration error of a tenth of the noise is nothing. Estimates are another matter: the
error is the same in every period of the motion, and over ten thousand samples a hundredth of the noise can be a standard deviation.
"""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

from rhythmid.diagnose.search.forward import Search
from rhythmid.errors import InputError
from rhythmid.identify.free_run import halved, sufficient
from rhythmid.identify.output_error import INTEGRATION, minimise

HALVINGS = 2  # of the step: the error of smooth forces falls to a 256th


def finely_stepped(found: Search, pool: ThreadPoolExecutor | None = None) -> Search:
    """The search with the fit of its chosen model at shorter steps; as it is where no effect was chosen, whose fit had them, or
    where the model diverges."""
    if not found.best.added:
        return found
    fit = found.fit
    tolerance = INTEGRATION * fit.noise.variance**0.5
    run = halved(sufficient(fit.run, fit.model, fit.starts, tolerance, HALVINGS - 1))
    try:
        fine = minimise(
            fit.model, run, fit.names, fit.noise, fit.starts, pool=pool, differences=fit.differences
        )
    except InputError:
        return found
    return replace(found, fit=fine)
