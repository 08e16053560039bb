"""Tables in text, JSON, NumPy, MATLAB and Parquet: valid, corrupted, and read."""

import gzip
import io
import json
import random
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from fuzz_inputs import COUNT, VALUES
from mutation import spoil_bytes, spoil_text
from scipy.io import savemat

from rhythmid.record.inventory import inventory

TABLE = b"t_ms,u,y\n" + b"".join(b"%d,%.3f,%.3f\n" % (k, VALUES[k], VALUES[-k]) for k in range(COUNT))


def texts() -> list[bytes]:
    semicolons = TABLE.replace(b",", b";").replace(b".", b",")
    return [
        TABLE, semicolons, TABLE.replace(b",", b"\t"), b"# t u y\n" + TABLE.replace(b",", b"  ").split(b"\n", 1)[1],
        b'"run 7"\n"t","u","note"\ns,N,-\n' + b"".join(b'%d,"%.2f","a, ""b"""\n' % (k, VALUES[k]) for k in range(COUNT)),
        TABLE.decode().encode("utf-16"), TABLE.replace(b"u", "µ".encode("cp1252")),
    ]  # fmt: skip


def jsons() -> list[bytes]:
    rows = [
        {"t": 1e-3 * k, "state": {"q": VALUES[k], "v": [VALUES[-k], None]}, "mode": "run"}
        for k in range(COUNT)
    ]
    by_name = {"t": [1e-3 * k for k in range(COUNT)], "q": dict(enumerate(VALUES))}
    return [
        "\n".join(map(json.dumps, rows)).encode(),
        json.dumps(rows, indent=1).encode(),
        json.dumps(by_name).encode(),
    ]


def _arrays() -> dict[str, np.ndarray]:
    return {"t": np.arange(COUNT) * 1e-3, "u": VALUES, "q": np.column_stack([VALUES, VALUES[::-1]])}


def npz_parts() -> list[bytes]:
    """A member's bytes, corrupted before packing, because the archive's checksum would detect it."""
    made = []
    for array in (*_arrays().values(), np.array(["a", "b"]), np.array([{"a": 1}], dtype=object)):
        file = io.BytesIO()
        np.save(file, array, allow_pickle=True)
        made.append(file.getvalue())
    return made


def _npz(member: bytes, method: int) -> bytes:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", method) as archive:
        archive.writestr("t.npy", npz_parts()[0])
        archive.writestr("u.npy", member)
    return file.getvalue()


def spoil_npz(rng: random.Random, valid: bytes) -> bytes:
    method = rng.choice((zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED))
    if rng.random() < 0.7:
        return _npz(spoil_bytes(rng, valid), method)
    return spoil_bytes(rng, _npz(valid, method))


def mats() -> list[bytes]:
    made = []
    nested = {
        **_arrays(),
        "s": {"q": VALUES, "t": {"u": 1.0}},
        "c": np.array([1, "x"], dtype=object),
        "n": "name",
    }
    kinds: tuple[tuple[dict[str, Any], dict[str, Any]], ...] = (
        (nested, {}),
        (nested, {"do_compression": True}),
        (_arrays(), {"format": "4"}),
    )
    for content, options in kinds:
        file = io.BytesIO()
        savemat(file, content, **options)
        made.append(file.getvalue())
    return [made[0], *made]


def parquets() -> list[bytes]:
    import pyarrow as pa
    from pyarrow.parquet import write_table

    made = []
    columns = {"t": np.arange(COUNT) * 1e-3, "u": VALUES, "n": np.arange(COUNT), "w": ["a"] * COUNT}
    for compression in ("none", "snappy", "zstd"):
        file = io.BytesIO()
        write_table(pa.table(columns), file, compression=compression)
        made.append(file.getvalue())
    return made


def use_table(suffix: str) -> Callable[[bytes, Path, int], None]:
    def use(data: bytes, folder: Path, number: int) -> None:
        path = folder / f"run{suffix}"
        path.write_bytes(data)
        inventory(path, rate=None if number % 2 else 100.0)

    return use


def spoil_gzip(rng: random.Random, valid: bytes) -> bytes:
    if rng.random() < 0.5:
        return gzip.compress(spoil_text(rng, valid), 1)
    return spoil_bytes(rng, gzip.compress(valid, 1))
