"""First guesses of a joint's controller gains from its reference, position and effort."""

import numpy as np

from rhythmid.record.record import Record

EXPLAINED = 0.5  # least share of the effort that two gains and a constant explain, for them to be used


def first_gains(record: Record) -> tuple[float, float, float] | None:
    """Gains of  effort = k_p (reference - position) - k_d velocity + constant, and the share of the effort that they explain, by least squares.

    None where they explain less than half of the effort, where a gain is not positive, or without a reference or an effort.
    """
    output, effort, asked = record.output, record.effort, record.input
    if effort is None or asked is None or record.input_kind != "reference":
        return None
    time, position = output.time, output.value
    held = np.clip(np.searchsorted(asked.time, time, "right") - 1, 0, len(asked.time) - 1)
    error = asked.value[held] - position
    side = np.interp(time, effort.time, effort.value)
    columns = np.column_stack([error, -np.gradient(position, time), np.ones(len(time))])
    kept = np.isfinite(columns).all(axis=1) & np.isfinite(side)
    kept &= (time >= max(asked.time[0], effort.time[0])) & (time <= effort.time[-1])
    if kept.sum() <= columns.shape[1]:
        return None
    side, columns = side[kept], columns[kept]
    gains = np.linalg.lstsq(columns, side, rcond=None)[0]
    power = float(np.var(side))
    share = 1.0 - float(np.mean((side - columns @ gains) ** 2)) / power if power > 0.0 else 0.0
    if share < EXPLAINED or gains[0] <= 0.0:
        return None
    return float(gains[0]), max(float(gains[1]), 0.0), share
