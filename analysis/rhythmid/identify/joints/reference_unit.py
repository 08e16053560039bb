"""References in another unit than the positions that follow them: detected by the sizes of both motions, without a
body model."""

from collections.abc import Sequence

import numpy as np

from rhythmid.identify.channel_change import DEGREE, NAMED
from rhythmid.record.joint_record import JointRecord
from rhythmid.record.record import Record

FOLLOWS = 0.7  # correlation of reference and position above which a joint follows its reference
FACTORS = {True: (DEGREE, "degrees are of radians"), False: (1e-3, "millimetres are of metres")}


def reference_mend(record: JointRecord, rotational: Sequence[bool]) -> str | None:
    """References that seem to be in another unit, and the text to write, in one line; None where they agree with
    the positions.

    Parameters
    ----------
    rotational : for each joint of the record, whether it is rotational.
    """
    found: dict[tuple[str, str, str], dict[str, tuple[float, float]]] = {}
    for (joint, one), turns in zip(record.joints.items(), rotational, strict=True):
        factor, unit = FACTORS[turns]
        ratio = _ratio(one)
        if ratio is None:
            continue
        for role, other, size in (("reference", "position", ratio), ("position", "reference", 1.0 / ratio)):
            if abs(size * factor - 1.0) < NAMED:
                found.setdefault((role, other, unit), {})[joint] = size, factor
    if not found:
        return None
    (role, other, unit), joints = next(iter(found.items()))
    sizes = sorted(round(size) for size, _ in joints.values())
    times = f"{sizes[0]}" if sizes[0] == sizes[-1] else f"{sizes[0]} to {sizes[-1]}"
    scales = ", ".join(f"{joint}: {factor:.6g}" for joint, (_, factor) in joints.items())
    key = "input" if role == "reference" else "output"
    return (
        f"{record.name}: the {role} of {', '.join(joints)} is {times} times as large as its {other}, as {unit}; write  "
        f"scale: {{{scales}}}  under '{key}:' in signals.yaml"
    )


def _ratio(record: Record) -> float | None:
    """Size of the reference's motion relative to that of the position; None where the position does not follow a
    reference."""
    given = record.reference or (record.input if record.input_kind == "reference" else None)
    if given is None:
        return None
    time, position = record.output.time, record.output.value
    asked = np.interp(time, given.time, given.value)
    if np.ptp(asked) == 0.0 or np.ptp(position) == 0.0:
        return None
    if np.corrcoef(asked, position)[0, 1] < FOLLOWS:
        return None
    return float(np.std(asked) / np.std(position))
