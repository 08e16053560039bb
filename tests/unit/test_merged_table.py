"""Tables into which streams with stamps of their own were merged: empty cells are no samples that were lost."""

from pathlib import Path

import numpy as np
import pytest

from rhythmid.errors import InputError
from rhythmid.record.bag_report import quality_report
from rhythmid.record.read import read_record

N = 200
TIME = np.arange(N) * 0.002
U, Y = np.sin(7 * TIME), 0.1 * np.cos(7 * TIME)


def signals(folder: Path) -> Path:
    path = folder / "signals.yaml"
    path.write_text(
        "time: {column: t}\ninput: {file: run.csv, column: u}\noutput: {file: run.csv, column: y}\n"
    )
    return path


def text(y: np.ndarray) -> str:
    rows = [f"{t:.17g},{u:.17g},{value:.17g}".replace("nan", "") for t, u, value in zip(TIME, U, y)]
    return "\n".join(["t,u,y", *rows]) + "\n"


def merged(rows: dict[str, list[tuple[float, float]]]) -> str:
    """Streams with stamps of their own as PlotJuggler exports them: a row each message, the other cells empty."""
    names = list(rows)
    every = sorted((at, name, value) for name, samples in rows.items() for at, value in samples)
    lines = [
        ",".join([f"{at:.6f}", *(f"{value:.17g}" if one == name else "" for one in names)])
        for at, name, value in every
    ]
    return "\n".join([",".join(["t", *names]), *lines]) + "\n"  # fmt: skip


def test_rows_of_streams_with_stamps_of_their_own_are_no_lost_samples(tmp_path):
    slow = range(0, N, 10)
    (tmp_path / "run.csv").write_text(
        merged({"y": [*zip(TIME + 3e-4, Y)], "u": [(TIME[k] + 1e-4, U[k]) for k in slow], "other": [*zip(TIME + 7e-4, U)]})
    )  # fmt: skip
    record = read_record(signals(tmp_path))
    np.testing.assert_array_equal(record.output.value, Y)
    assert record.input is not None
    np.testing.assert_array_equal(record.input.value, U[list(slow)])
    report = quality_report(signals(tmp_path))
    assert report.usable and all("NaN" not in line and "lost" not in line for line in report.lines())


def test_a_column_that_is_slower_than_the_rows_is_a_stream_and_one_that_fails_is_not(tmp_path):
    y = np.where(np.arange(N) % 4 == 0, Y, np.nan)
    (tmp_path / "run.csv").write_text(text(y))
    record = read_record(signals(tmp_path))
    np.testing.assert_array_equal(record.output.value, Y[::4])
    (tmp_path / "run.csv").write_text(text(np.where(TIME < TIME[120], np.nan, Y)))
    with pytest.raises(InputError, match="120 of 200 samples are NaN or empty"):
        read_record(signals(tmp_path))
