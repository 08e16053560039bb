"""Fine steps: refit the chosen model with integration steps so short that they do not bias the estimates.

The search compares models, for which an integration error of a tenth of the noise does not matter. It matters for estimates:
the error is the same in every period of the motion, so that over ten thousand samples a hundredth of the noise can shift an
estimate by a standard deviation.
"""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

from rhythmid.diagnose.search.forward import Search
from rhythmid.errors import InputError
from rhythmid.identify.free_run import halved, sufficient
from rhythmid.identify.output_error import INTEGRATION, minimise

HALVINGS = 2  # halvings of the step: for smooth forces the error falls to a 256th


def finely_stepped(found: Search, pool: ThreadPoolExecutor | None = None) -> Search:
    """Refit the chosen model of a search with shorter steps.

    Returns the search unchanged where no effect was chosen, because that fit already used them, or where the model diverges.
    """
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
