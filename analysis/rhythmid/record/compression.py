"""Compressed parts of bags: MCAP chunks (zstd, lz4), single messages and whole files (zstd)."""

import shutil
import sys
from pathlib import Path

import lz4.frame

if sys.version_info >= (3, 14):
    from compression import zstd
else:
    from backports import zstd

ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"


def compress(data: bytes) -> bytes:
    """`data` as one zstd frame."""
    return zstd.compress(data)


def decompress(data: bytes, method: str) -> bytes:
    """Decompress a chunk; `method` as MCAP names it: '' (none), 'zstd' or 'lz4'.

    A frame that breaks off gives what precedes the break. Raises ValueError when `data` is no such frame.
    """
    if method == "":
        return data
    try:
        if method == "zstd":
            return zstd.ZstdDecompressor().decompress(data)
        if method == "lz4":
            return lz4.frame.LZ4FrameDecompressor().decompress(data)
    except (zstd.ZstdError, RuntimeError, EOFError) as error:
        raise ValueError(str(error)) from None
    raise ValueError(f"unknown compression {method!r}")


def decompress_file(source: Path, target: Path) -> None:
    """Decompress a zstd file. Raises ValueError when it is damaged."""
    try:
        with zstd.open(source, "rb") as packed, target.open("wb") as plain:
            shutil.copyfileobj(packed, plain)
    except (zstd.ZstdError, EOFError) as error:
        raise ValueError(str(error)) from None
