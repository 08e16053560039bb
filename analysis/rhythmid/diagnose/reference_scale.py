"""Scale of a measurement relative to the reference that it follows: y = g x + o, with g and o unknown.

A servo is given a reference and its position is measured by another device: the two may differ in scale and zero. In a model without
force the offset does what a constant force does, so that an offset alone stays a hypothesis of the catalogue. A scale imitates a
spring, and with friction beside it no law of the catalogue fits. It is adopted, for all hypotheses alike, if it predicts data that the
fit has not seen decisively better than an offset alone, and if the effect of the catalogue that explains the records best does not
replace it: with an offset, that effect leaves about as much as scale and offset, or the scale is needed beside it.
"""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rhythmid.diagnose.baseline import Calibration, calibrate
from rhythmid.diagnose.calibration_evidence import Seen
from rhythmid.diagnose.constants import FOLLOWS
from rhythmid.diagnose.free_functions import FreeFunction
from rhythmid.elements.catalogue import Catalogue
from rhythmid.errors import InputError
from rhythmid.identify.output_error import Fit
from rhythmid.identify.series import Series
from rhythmid.model import Model
from rhythmid.progress import Tell
from rhythmid.report.quantity import with_std, with_written_unit

Array = NDArray[np.float64]
GAIN, OFFSET = "sensor_gain", "sensor_offset"
# the quantity that each controller makes follow its reference
CONTROLS = {"position_control": "position", "velocity_control": "velocity"}


def with_reference_scale(
    calibration: Calibration,
    given: Model,
    catalogue: Catalogue,
    pool: ThreadPoolExecutor | None = None,
    tell: Tell = lambda _: None,
) -> Calibration:
    """The calibration of the model `given`, with a gain and an offset of the measurement if the records need them."""
    fit, series = calibration.fit, calibration.series
    if not _follows_reference(fit.model, series) or not {GAIN, OFFSET} <= catalogue.keys():
        return calibration
    alone = Seen.of(fit, pool)
    offset, scale = _columns(alone.fit)
    if not alone.needs(
        alone.extended(FreeFunction("scale and offset", (offset, scale))),
        alone.extended(FreeFunction("offset", (offset,))),
    ):
        return calibration
    tell("the measurement seems to be scaled; looking for an effect that says the same")
    explained = Seen.explained(fit, given, catalogue, pool, tell)
    law = explained.fit.model
    scaled = explained.refitted(_scaled(fit.model, catalogue), series, pool)
    shifted = explained.refitted(law.with_element(catalogue[OFFSET], {"offset": 0.0}), series, pool)
    if explained.replaces(shifted, scaled):
        both = explained.refitted(_scaled(law, catalogue), series, pool)
        if not explained.needs(both, shifted, FOLLOWS):
            return calibration
    tell("refitting with a scale and an offset of the measurement")
    try:
        found = calibrate(_scaled(fit.model, catalogue), series, catalogue, pool, tell)
    except InputError:
        return calibration
    return replace(found, notes=(*calibration.notes, *found.notes))


def _follows_reference(model: Model, series: Sequence[Series]) -> bool:
    """Whether the measured quantity is the one that follows the reference, and the model gives it no scale of its own."""
    return (
        series[0].kind == "reference"
        and any(CONTROLS.get(term.element.name) == series[0].measured for term in model.terms)
        and not any(term.element.name in (GAIN, OFFSET) for term in model.terms)
    )


def _scaled(model: Model, catalogue: Catalogue) -> Model:
    return model.with_element(catalogue[GAIN], {"gain": 1.0}).with_element(catalogue[OFFSET], {"offset": 0.0})


def _columns(fit: Fit) -> tuple[tuple[Array, ...], tuple[Array, ...]]:
    """A constant and the model's output, as signals of each series."""
    made = zip(fit.residuals, fit.run.series, strict=True)
    outputs = tuple(one.averaged - residual for residual, one in made)
    return tuple(np.ones_like(one) for one in outputs), outputs


def scale_told(nominal: Model, fit: Fit) -> tuple[str, ...]:
    """The sentence about an adopted scale and offset; none where the nominal model has its own or none was adopted."""
    gain, offset = f"{GAIN}.gain", f"{OFFSET}.offset"
    if gain in nominal.parameters or not {gain, offset} <= set(fit.names):
        return ()
    told = with_written_unit(
        with_std(fit.model.value(offset), fit.std[offset]), fit.model.parameters[offset].unit
    )
    return (
        f"The measurement is {with_std(fit.model.value(gain), fit.std[gain])} times what follows the reference, plus {told}; neither is in "
        "the nominal model. A spring and a constant force would do the same: compare reference and measurement at rest.",
    )
