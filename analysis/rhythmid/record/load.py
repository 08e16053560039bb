"""A recording as a Record, in one call."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, cast

from rhythmid.plain_yaml import plain_yaml
from rhythmid.record.joint_record import JointSignals, names_joints, read_joint_record
from rhythmid.record.read import read_record
from rhythmid.record.record import Record
from rhythmid.record.signals import Signals


def load(
    source: str | Path,
    signals: Signals | JointSignals | Mapping[str, Any] | str | Path | None = None,
    use: tuple[float, float] | None = None,
) -> Record:
    """Read a recording; a `JointRecord` where the signals have `joints`.

    Parameters
    ----------
    source
        A bag directory, an .mcap or .db3 file, a table (.csv, .mat, .npz, .parquet), or a signals.yaml that names
        tables.
    signals
        Mapping of the channels: a signals.yaml, or its content as a mapping; by default the topics of rhythmid's own
        nodes.
    use
        Start and end [s] of the part of the recording to use.

    Returns
    -------
    Record
        Channels `output`, `input`, `forcing` and others where recorded, each with times [s] and values, float64[n].

    Raises
    ------
    InputError
        One line, where the source cannot be read or lacks a channel that `signals` names.

    Examples
    --------
    >>> import tempfile, numpy as np, rhythmid as rh
    >>> t = np.arange(0.0, 2.0, 0.01)
    >>> table = tempfile.mkdtemp() + "/swing.csv"
    >>> np.savetxt(table, np.column_stack([t, 0.3 * np.cos(5 * t)]), delimiter=",", header="t,angle", comments="")
    >>> record = rh.load(table, signals={"time": {"column": "t"}, "output": {"column": "angle", "unit": "rad"}})
    >>> len(record.output), record.output.unit, round(record.duration, 2)
    (200, 'rad', 1.99)
    """
    if isinstance(signals, Mapping):
        text = plain_yaml(signals, "signals")
        signals = JointSignals.from_text(text) if "joints" in signals else Signals.from_text(text)
    elif signals is not None and not isinstance(signals, (Signals, JointSignals)) and names_joints(signals):
        signals = JointSignals.load(signals)
    if isinstance(signals, JointSignals):
        record = cast(Record, read_joint_record(source, signals))
    else:
        record = read_record(source, signals)
    return record if use is None else record.cut(*use)
