"""Compressed parts of bags: MCAP chunks (zstd, lz4), single messages and whole files (zstd)."""

import sys
from pathlib import Path

import lz4.frame

if sys.version_info >= (3, 14):
    from compression import zstd
else:
    from backports import zstd

ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"
HARMLESS = 256 << 20  # bytes that any file may unpack to, however small it is packed
EXPANSION = 200  # largest expansion ratio of a larger file; recordings of constants reach about 50
_PIECE = 1 << 20  # bytes written at once


def largest(packed: int) -> int:
    """Largest allowed size [bytes] of `packed` compressed bytes after unpacking: more would be an attempt to fill
    the memory."""
    return max(HARMLESS, EXPANSION * packed)


def compress(data: bytes) -> bytes:
    """`data` as one zstd frame."""
    return zstd.compress(data)


def decompress(data: bytes, method: str) -> bytes:
    """Decompress a chunk; `method` as MCAP names it: '' (none), 'zstd' or 'lz4'.

    A truncated frame gives the data before its end. Raises ValueError when `data` is no such frame, or holds more than
    `largest` allows.
    """
    if method == "":
        return data
    most = largest(len(data))
    try:
        if method == "zstd":
            plain = zstd.ZstdDecompressor().decompress(data, most + 1)
        elif method == "lz4":
            plain = lz4.frame.LZ4FrameDecompressor().decompress(data, most + 1)
        else:
            raise ValueError(f"unknown compression {method!r}")
    except (zstd.ZstdError, RuntimeError, EOFError, MemoryError) as error:
        raise ValueError(str(error) or "it is too large") from None
    if len(plain) > most:
        raise ValueError(f"it holds more than {most} bytes in {len(data)}")
    return plain


def decompress_file(source: Path, target: Path) -> None:
    """Decompress a zstd file. Raises ValueError when it is damaged, or holds more than `largest` allows."""
    most = largest(source.stat().st_size)
    try:
        with zstd.open(source, "rb") as packed, target.open("wb") as plain:
            while piece := packed.read(_PIECE):
                plain.write(piece)
                if plain.tell() > most:
                    raise ValueError(f"it holds more than {most} bytes")
    except (zstd.ZstdError, EOFError) as error:
        raise ValueError(str(error)) from None
