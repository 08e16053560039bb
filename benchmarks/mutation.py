"""Corrupted copies of valid inputs: bytes flipped, cut, repeated and overwritten with extreme numbers; words of texts exchanged."""

import random
import re
from collections.abc import Callable, Sequence

Mutation = Callable[[random.Random, bytes], bytes]
EXTREME = (
    0,
    1,
    0x7F,
    0x80,
    0xFF,
    0x7FFF,
    0x8000,
    0xFFFF,
    2**31 - 1,
    2**31,
    2**32 - 1,
    2**60,
    2**63 - 1,
    2**63,
    2**64 - 1,
)
SIZES = (1, 2, 4, 8)  # bytes of the numbers in file formats
PIECE = 64  # bytes that are cut, repeated or inserted at once, at most
WORD = re.compile(rb"[A-Za-z_][A-Za-z_0-9]*|[-+]?\d+(?:\.\d*)?(?:[eE][-+]?\d+)?")
# text with a special meaning in YAML, numbers, paths and terminals
WORDS = (
    b"", b"nan", b"-inf", b"1e999", b"-1e308", b"1e-320", b"0", b"-0.0", b"1_0", b"0x7f", b"0o17", b"1:30", b"9" * 5000, b"null",
    b"yes", b"~", b"[]", b"{}", b"[" * 300, b"{a: " * 200, b"- " * 100, b"&a [*a, *a]", b"*a", b"&a", b"<<: *a", b"!!binary x",
    b"!!timestamp x", b"!!int ''", b"!!bool x", b"!!float x", b"!!set {a}", b"!!python/object/apply:os.system [touch executed]",
    b"!!python/name:os.system", b"2001-02-30", b"2001-12-14t21:59:43.10-99:99", b"|", b">", b"'", b'"', b"#", b"? x", b": ",
    b"../../../x", b"/dev/null", b"\x1b[2J", b"\0", b"\xff\xfe", "²".encode(), "٣".encode(), b"x" * 3000, b"__class__", b"a.b[c",
    b"data[" + b"1" * 5000 + b"]", "data[²]".encode(), b"\n", b"\t", b";", b",,", b"1,5", b"%s", b"{0}",
)  # fmt: skip


def spoil_bytes(rng: random.Random, valid: bytes) -> bytes:
    """One to six changes of a binary file, anywhere."""
    spoilt = bytearray(valid)
    for _ in range(rng.choice((1, 1, 1, 2, 3, 6))):
        rng.choice(BYTE_CHANGES)(rng, spoilt)
    return bytes(spoilt)


def spoil_text(rng: random.Random, valid: bytes) -> bytes:
    """One to four changes of a text: mostly words exchanged, doubled or left out, lines moved, else bytes."""
    spoilt = valid
    for _ in range(rng.choice((1, 1, 2, 4))):
        spoilt = rng.choice(TEXT_CHANGES)(rng, spoilt)
    return spoilt


def _flip(rng: random.Random, data: bytearray) -> None:
    if data:
        data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)


def _number(rng: random.Random, data: bytearray) -> None:
    size = rng.choice(SIZES)
    number = (rng.choice(EXTREME) if rng.random() < 0.7 else rng.getrandbits(8 * size)) % 2 ** (8 * size)
    at = rng.randrange(len(data) + 1)
    data[at : at + size] = number.to_bytes(size, rng.choice(("little", "little", "little", "big")))


def _near_number(rng: random.Random, data: bytearray) -> None:
    """A number that is changed slightly, like lengths and positions that do not agree."""
    size = rng.choice(SIZES)
    if len(data) < size:
        return
    at = rng.randrange(len(data) - size + 1)
    number = int.from_bytes(data[at : at + size], "little") + rng.randint(-9, 9)
    data[at : at + size] = (number % 2 ** (8 * size)).to_bytes(size, "little")


def _cut(rng: random.Random, data: bytearray) -> None:
    at = rng.randrange(len(data) + 1)
    del data[at : at + rng.randint(1, PIECE)]


def _repeat(rng: random.Random, data: bytearray) -> None:
    at = rng.randrange(len(data) + 1)
    data[at:at] = data[at : at + rng.randint(1, PIECE)]


def _insert(rng: random.Random, data: bytearray) -> None:
    at = rng.randrange(len(data) + 1)
    data[at:at] = rng.randbytes(rng.randint(1, PIECE))


def _move(rng: random.Random, data: bytearray) -> None:
    start, size = rng.randrange(len(data) + 1), rng.randint(1, PIECE)
    piece = data[start : start + size]
    at = rng.randrange(len(data) + 1)
    data[at : at + len(piece)] = piece


def _end(rng: random.Random, data: bytearray) -> None:
    del data[rng.randrange(len(data) + 1) :]


BYTE_CHANGES: Sequence[Callable[[random.Random, bytearray], None]] = (
    _flip, _flip, _number, _number, _near_number, _near_number, _cut, _repeat, _insert, _move, _end,
)  # fmt: skip


def _exchange(rng: random.Random, text: bytes) -> bytes:
    found = list(WORD.finditer(text))
    if not found:
        return text
    one = rng.choice(found)
    word = rng.choice(WORDS) if rng.random() < 0.7 else rng.choice(found)[0]
    return text[: one.start()] + word + text[one.end() :]


def _lines(rng: random.Random, text: bytes) -> bytes:
    lines = text.splitlines(keepends=True)
    if not lines:
        return text
    at, other = rng.randrange(len(lines)), rng.randrange(len(lines))
    change = rng.randrange(4)
    if change == 0:
        lines.insert(at, lines[other])
    elif change == 1:
        del lines[at]
    elif change == 2:
        lines[at] = b" " * rng.randint(1, 4) + lines[at]
    else:
        lines[at] = lines[at].lstrip()
    return b"".join(lines)


def _as_bytes(rng: random.Random, text: bytes) -> bytes:
    return spoil_bytes(rng, text)


TEXT_CHANGES: Sequence[Mutation] = (_exchange, _exchange, _exchange, _exchange, _lines, _as_bytes)
