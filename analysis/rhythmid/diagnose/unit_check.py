"""Units that are off by a thousand: millimetres for metres, kilonewtons for newtons.

Where the mass is known no parameter makes up for them, and what they do to a fit looks like anything but units. Where the nominal
model misses a stretch of a record altogether, each channel is tried in the neighbouring unit.
"""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
from scipy.interpolate import PPoly

from rhythmid.errors import InputError
from rhythmid.identify.descent import WHITE, first_guess
from rhythmid.identify.free_run import prepare_run
from rhythmid.identify.output_error import estimate
from rhythmid.identify.series import Series, dominant_frequency
from rhythmid.model import Model

FACTORS = (1e-3, 1e3)
STRETCH = 15.0  # periods that are looked at
POOR = 1.0  # error of the model as given, relative to the motion, from which it is refitted
LOST = 0.5  # error of the refitted model from which other units are tried
FOUND = 0.3  # error below which the other unit is believed
BETTER = 0.4  # share to which it has to lower the error
CHANNELS = {"output": "value", "input": "command", "forcing": "forcing"}


def check_units(model: Model, series: Sequence[Series], pool: ThreadPoolExecutor | None = None) -> None:
    """Raise InputError when a channel in units a thousand times larger or smaller suits the model, and as recorded does not.

    A model whose mass is free fits records in any unit, so nothing is said of one.
    """
    if not model.mass.fixed:
        return
    one = _stretch(max(series, key=lambda s: float(np.std(s.averaged))))
    if _as_given(model, one) < POOR:
        return
    error = _refitted(model, one, pool)
    if error < LOST:
        return
    tried = []
    for channel, attribute in CHANNELS.items():
        for factor in FACTORS:
            if (other := _scaled(one, attribute, factor)) is not None:
                tried.append((_refitted(model, other, pool), channel, factor))
    best, channel, factor = min(tried)
    if best < FOUND and best < BETTER * error:
        raise InputError(
            f"{one.name}: the {channel} seems to be in units {max(factor, 1.0 / factor):g} times too {'small' if factor < 1.0 else 'large'}: with scale: "
            f"{factor:g} under '{channel}:' in signals.yaml the nominal model misses {100 * best:.0f} % of the motion, without it {100 * min(error, 99):.0f} %"
        )


def _stretch(series: Series) -> Series:
    """The first periods of a series."""
    count = int(STRETCH / (dominant_frequency(series) * series.period * series.block)) + 1
    count = min(count, series.blocks)
    samples = count * series.block
    return replace(series, time=series.time[:samples], value=series.value[:samples], used=series.used[:count])


def _as_given(model: Model, one: Series) -> float:
    """Error of the model as it is, from the first samples' position and slope, relative to the motion."""
    run = prepare_run(model, [one])
    outputs = run.outputs(model, first_guess(model, run))
    spread = max(float(np.std(one.averaged)), 1e-300)
    return np.inf if outputs is None else float(np.sqrt(np.mean((outputs[0] - one.averaged) ** 2))) / spread


def _refitted(model: Model, one: Series, pool: ThreadPoolExecutor | None) -> float:
    try:
        noise = replace(WHITE, std=1e-2 * max(float(np.std(one.averaged)), 1e-300))
        return estimate(model, [one], noise=noise, pool=pool, iterations=12).nrmse()
    except InputError:
        return np.inf


def _scaled(one: Series, attribute: str, factor: float) -> Series | None:
    signal = getattr(one, attribute)
    if signal is None:
        return None
    return replace(
        one,
        **{attribute: PPoly(factor * signal.c, signal.x) if isinstance(signal, PPoly) else factor * signal},
    )
