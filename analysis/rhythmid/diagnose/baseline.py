"""Calibration: refit all free parameters of the nominal model before asking what it lacks.

Wrong parameters are not missing physics. Neither is a delay, nor an input that is recorded as held but is not held.
Both are detected here and kept apart from effects.
"""

import math
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np

from rhythmid.deadline import time_is_up
from rhythmid.diagnose.constants import CONTRADICTS, FOLLOWS, LATEST, NOT_HELD_LEAST, STANDS_IN
from rhythmid.elements.catalogue import Catalogue
from rhythmid.errors import InputError
from rhythmid.identify.early_output import EARLIEST
from rhythmid.identify.harmonic_likelihood import DELAYS
from rhythmid.identify.other_starts import SETTLED, from_delays, from_windows
from rhythmid.identify.output_error import Fit, estimate, with_bounds
from rhythmid.identify.record_scales import REST_LENGTH
from rhythmid.identify.series import Series
from rhythmid.model import INERTIA, Model
from rhythmid.progress import Tell
from rhythmid.record.timing import nominal_period
from rhythmid.report.quantity import with_written_unit
from rhythmid.simulation.signal import OVERSAMPLING, band_limited, first_order_hold, is_held
from rhythmid.simulation.transport import INPUT_DELAY
from rhythmid.value import Prior

NO_ORIGIN = "No position was measured, so that its origin is arbitrary: the spring's rest length is kept as it was given."
EVEN = 1e-3  # of the period; spread of the sampling intervals up to which the samples count as even
# [s] delays from which another minimum is sought: from a few samples to a slow network
FAR_DELAYS = (0.03, 0.08, 0.15, 0.25)


@dataclass(frozen=True)
class Calibration:
    """The refitted nominal model, its series, and notes for the user.

    The input of the series is held, or `reconstructed` between its samples where it turned out not to be held.
    """

    fit: Fit
    series: tuple[Series, ...]
    notes: tuple[str, ...]
    reconstructed: bool = False


def with_delays(model: Model, series: Sequence[Series], catalogue: Catalogue) -> Model:
    """Give the model an input delay; one that it does not have itself is added as a nuisance parameter.

    The prior of the nuisance has a standard deviation of one sample; its upper bound is `LATEST` samples. A longer delay is
    a hypothesis of its own, because it would otherwise absorb friction and lags. A model's own delay keeps its upper bound.
    Both may become negative by up to `EARLIEST` samples: this reveals an input that is simulated as held but is not held.
    """
    own = model.term("input_delay") is not None
    if not any(one.commanded or (own and one.command is not None) for one in series):
        return model
    period = max(one.period for one in series)
    if not own:
        model = model.with_element(catalogue["input_delay"], {"delay": 0.0})
    current = model.parameters[INPUT_DELAY]
    if current.fixed:
        return model
    low = min(current.bounds[0], -EARLIEST * period)
    if own:
        return with_bounds(model, {INPUT_DELAY: (low, current.bounds[1])})
    nuisance = replace(current, bounds=(low, LATEST * period), prior=Prior(0.0, period))
    return model.with_parameters({INPUT_DELAY: nuisance})


def check_free(model: Model) -> None:
    """Raise InputError for a model that has no free parameter."""
    if not model.free:
        raise InputError(
            "every parameter of the nominal model is fixed, so a wrong value could not be distinguished from missing physics; "
            "free those that are not known exactly (drop 'fixed: true')"
        )


def calibrate(
    model: Model,
    series: Sequence[Series],
    catalogue: Catalogue,
    pool: ThreadPoolExecutor | None = None,
    tell: Tell = lambda _: None,
) -> Calibration:
    """Refit the nominal model. Raises InputError where nothing is free, or where it diverges from every start."""
    check_free(model)
    model = with_delays(model, series, catalogue)
    notes: tuple[str, ...] = ()
    if REST_LENGTH in model.free and any(one.measured != "position" for one in series):
        model, notes = _as_given(model, REST_LENGTH), (NO_ORIGIN,)
    tell("refitting the nominal model")
    best: Fit | None = None
    failure: InputError | None = None
    try:
        best = estimate(model, series, pool=pool)
    except InputError as error:
        failure = error
    if best is None or ((best.nrmse() > SETTLED or not best.converged) and not time_is_up()):
        try:
            again = from_windows(model, series, pool)
            if best is None or again.sum_of_squares < best.sum_of_squares:
                best = again
        except InputError as error:
            failure = failure or error
    if best is None:
        assert failure is not None
        raise failure
    if INERTIA in best.names and best.std[INERTIA] > best.model.value(INERTIA):
        found = calibrate(_as_given(model, INERTIA), series, catalogue, pool, tell)
        return replace(found, notes=(*notes, _no_mass(model), *found.notes))
    if best.nrmse() > FOLLOWS and not time_is_up():
        best = _from_far_delays(best, pool)
    found = _hold(best, series, pool, tell)
    return replace(found, notes=(*notes, *found.notes))


def _as_given(model: Model, name: str) -> Model:
    """The model with a parameter held at its value."""
    return model.with_parameters({name: replace(model.parameters[name], fixed=True)})


def _no_mass(model: Model) -> str:
    mass = model.mass
    return (
        f"The records do not determine the mass: it is kept at {with_written_unit(f'{mass.value:g}', mass.unit)} as given, and stiffnesses, "
        "dampings and forces are in proportion to it."
    )


def _from_far_delays(fit: Fit, pool: ThreadPoolExecutor | None) -> Fit:
    """The fit, or that from a delay far from its own if it leaves much less."""
    bounds = {name: fit.model.parameters[name].bounds for name in DELAYS if name in fit.names}
    tried = {name: [delay for delay in FAR_DELAYS if delay <= high] for name, (_, high) in bounds.items()}
    found = from_delays(fit, tried, pool)
    return found if found.nrmse() < STANDS_IN * fit.nrmse() else fit


def reconstructed(series: Series) -> Series:
    """The series with a held input reconstructed between its samples.

    Evenly spaced samples are interpolated with a band-limited signal, others linearly. An input that is not held is kept.
    """
    command = series.command
    if command is None or not is_held(command) or len(command.x) < 10:
        return series
    time, value = command.x[:-1], command.c[-1]
    even = np.ptp(np.diff(time)) < EVEN * float(np.median(np.diff(time)))
    if not even:
        return replace(series, command=first_order_hold(time, value))
    # block averages have no content near the Nyquist frequency; without averaging the samples alone would be too coarse
    finer = 1 if series.block > 1 else OVERSAMPLING
    return replace(series, command=band_limited(time, value, finer))


def _hold(fit: Fit, series: Sequence[Series], pool: ThreadPoolExecutor | None, tell: Tell) -> Calibration:
    """Detect an input that acts earlier than its samples, hence was not held, and reconstruct it.

    The machine is causal, so a negative delay contradicts holding. The one-step prediction error decides between the two,
    as far as an incomplete model allows. Holding delays a command by half a sample on average; a shift of many samples
    has another cause.
    """
    kept = Calibration(fit, tuple(series), ())
    held = [one for one in series if one.command is not None and is_held(one.command)]
    if INPUT_DELAY not in fit.names or not held or fit.nrmse() > FOLLOWS:
        return kept
    period = nominal_period(np.diff(held[0].inputs.stamps))
    delay, std = fit.model.value(INPUT_DELAY), fit.std[INPUT_DELAY]
    if not math.isfinite(std) or delay > -max(CONTRADICTS * std, NOT_HELD_LEAST * period):
        return kept
    late = -delay / period
    if late > EARLIEST:
        note = (
            f"A free delay of the input comes out at {delay * 1e3:.3f} ± {std * 1e3:.3f} ms ({-late:.1f} of its samples): more than an "
            "input that is not held explains. The clocks of command and measurement differ, or the model lacks something."
        )
        return replace(kept, notes=(note,))
    tell(f"the held input is late by {late:.2f} sample; reconstructing it between its samples")
    note = (
        f"Input about {'half a' if 0.35 < late < 0.65 else f'{late:.2f}'} sample late when held: a free delay comes out "
        f"at {delay * 1e3:.3f} ± {std * 1e3:.3f} ms ({-late:.2f} sample)."
    )
    smooth = [reconstructed(one) for one in series]
    again = estimate(fit.model.with_values({INPUT_DELAY: 0.0}), smooth, pool=pool)
    if again.noise.std > fit.noise.std:
        return replace(kept, notes=(note + " Holding it fits better all the same.",))
    note += " The input is not held but band-limited; it is reconstructed so in all that follows."
    return Calibration(again, tuple(smooth), (note,), reconstructed=True)
