"""sqlite3 storage files of rosbag2, including those whose recorder was killed during a transaction."""

import mmap
import os
import shutil
import sqlite3
import struct
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import closing
from itertools import islice
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from rhythmid.errors import InputError
from rhythmid.record.block import Block, Topic, Wanted, by_topic
from rhythmid.record.sqlite_damage import in_order, next_readable, wrong_checksums, wrong_messages
from rhythmid.record.sqlite_pages import Pages

_ROWS = 50_000  # rows fetched at once,
_BYTES = 64 << 20  # and bytes after which no further row is fetched
_LARGEST_ROW = 256 << 20  # bytes; sqlite's own limit is larger, and a database may compute its rows


class SqliteReader:
    """One .db3 file. `truncated` says whether its recorder was killed; `topics` lists all topics once opened.

    A journal beside the file holds the data that sqlite needs to undo or finish the last transaction. That requires
    writing, so file and journal are copied and the copy is opened; the recording itself is never changed. A
    truncated file is copied, too, and read up to its end. A file that sqlite cannot open because its beginning is
    damaged is read page by page. With `intact` messages whose checksum is wrong are left out.
    """

    def __init__(self, path: Path, intact: bool = False) -> None:
        self.path = path
        self._intact = intact
        self._wrong: list[tuple[int, int]] = []
        self.topics: dict[str, Topic] = {}
        self.damage: list[str] = []
        self.by_pages = False
        self._last = 0
        self._journals = [
            journal for end in ("-journal", "-wal")
            if (journal := path.with_name(path.name + end)).is_file() and journal.stat().st_size
        ]  # fmt: skip
        self.truncated = bool(self._journals)

    def blocks(self, wanted: Wanted = lambda topic: True) -> Iterator[Block]:
        """Messages of the wanted topics, block by block in the order of recording."""
        try:
            with self.path.open("rb") as file:
                head = file.read(32)
            if not head.startswith(b"SQLite format 3"):
                yield from self._by_pages(
                    wanted, "is not an sqlite3 bag (it does not start like an sqlite database)"
                )
                return
            page, whole = _sizes_by_header(head)
            size = self.path.stat().st_size
            cut_off = size < whole and not self._journals
            self.truncated = self.truncated or cut_off
            if not self._journals and not cut_off:
                yield from self._read(self.path, "mode=ro", wanted)
                return
            with TemporaryDirectory(prefix="rhythmid-") as folder:
                for file in (self.path, *self._journals):
                    shutil.copyfile(file, Path(folder) / file.name)
                copy = Path(folder) / self.path.name
                if cut_off:  # zeros for the lost pages, without which sqlite would not read the existing ones
                    os.truncate(copy, size - size % page)
                    os.truncate(copy, whole)
                yield from self._read(copy, "mode=rw", wanted)
        except sqlite3.Error as error:
            # sqlite quotes whole columns
            reason = f"is not a readable sqlite3 bag: {' '.join(str(error).split())[:200]}"
            if self._last or not _is_damage(error):
                raise InputError(f"{self.path}: {reason}") from None
            yield from self._by_pages(wanted, reason)
        except OSError as error:
            raise InputError(f"{self.path}: cannot be read: {error.strerror or error}") from None

    def _read(self, path: Path, mode: str, wanted: Wanted) -> Iterator[Block]:
        with closing(sqlite3.connect(f"{path.absolute().as_uri()}?{mode}", uri=True)) as database:
            database.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, _LARGEST_ROW)
            database.execute(
                "PRAGMA trusted_schema = OFF"
            )  # no function with side effects, in case the schema calls one
            if self._intact:
                self._wrong = wrong_messages(database)
            numbered = _topics(database)
            self.topics = {topic.name: topic for topic in numbered.values()}
            chosen = {number: topic for number, topic in numbered.items() if wanted(topic)}
            yield from self._blocks_of(chosen, self._rows(database, ",".join(map(str, chosen))))

    def _by_pages(self, wanted: Wanted, reason: str) -> Iterator[Block]:
        """Messages of a file that sqlite cannot open. Raises InputError with the reason where its pages name no topic."""
        with self.path.open("rb") as file:
            size = file.seek(0, os.SEEK_END)
            data = memoryview(mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) if size else b"")
        pages = Pages(data)
        numbered = _numbered(
            [(number, *values[1:5]) for number, values in pages.rows(_is_topic)],
            [(values[1], values[3], values[2]) for _, values in pages.rows(_is_definition)],
        )
        if not numbered:
            raise InputError(f"{self.path}: {reason}")
        self.topics = {topic.name: topic for topic in numbered.values()}
        self.by_pages = True
        self.damage.append("sqlite cannot open it, so that it was read page by page")
        chosen = {number: topic for number, topic in numbered.items() if wanted(topic)}
        unnamed: Counter[int] = Counter()

        def rows() -> Iterator[tuple[int, int, bytes]]:
            for number, (_, topic, time, message) in pages.rows(_is_message):
                if number > self._last + 1:
                    self.damage.append(f"messages {self._last + 1} to {number - 1} are lost")
                self._last = number
                if topic in chosen:
                    yield topic, time, message
                elif topic not in numbered:
                    unnamed[topic] += 1

        yield from self._blocks_of(chosen, rows())
        self.damage += [
            f"{count} messages of topic number {number} are lost: the part of the file that names it is damaged"
            for number, count in sorted(unnamed.items())
        ]

    def _blocks_of(self, chosen: dict[int, Topic], rows: Iterator[tuple[int, int, bytes]]) -> Iterator[Block]:
        while batch := self._messages(_batch(rows)):
            number, log_ns, data = zip(*batch, strict=True)
            size = np.fromiter(map(len, data), dtype=np.int64, count=len(data))
            start = np.cumsum(size) - size
            yield from by_topic(
                chosen, np.array(number), b"".join(data), start, size, np.array(log_ns, dtype=np.int64)
            )

    def _rows(self, database: sqlite3.Connection, chosen: str) -> Iterator[tuple[int, int, bytes]]:
        """The rows of the chosen topics; unreadable pages are skipped and reported."""
        query = f"SELECT id, topic_id, timestamp, data FROM messages WHERE topic_id IN ({chosen}) AND id > ? ORDER BY id"
        while True:
            try:
                for number, *row in database.execute(query, (self._last,)):
                    self._last = in_order(number, self._last)
                    if not any(first <= number <= last for first, last in self._wrong):
                        yield row[0], row[1], row[2]
                return
            except sqlite3.DatabaseError as error:
                following = next_readable(database, self._last)
                if following is None:
                    if not self._last:
                        raise
                    self.damage.append(f"is damaged behind message {self._last}: {error}")
                    self.truncated = True
                    return
                self.damage.append(f"messages {self._last + 1} to {following - 1} are lost: {error}")
                self._last = following - 1

    def _messages(self, rows: list[tuple[int, int, bytes]]) -> list[tuple[int, int, bytes]]:
        """The rows that are messages."""
        found = [row for row in rows if [*map(type, row)] == [int, int, bytes]]
        if len(found) < len(rows):
            if not found:
                raise sqlite3.DatabaseError("not every row of its table 'messages' is a message")
            self.damage.append(f"{len(rows) - len(found)} rows of its table 'messages' are no messages")
        return found

    def wrong_checksums(self) -> list[str]:
        """Errors found by sqlite's own check and by the checksums of a finished file, one phrase each."""
        if self.truncated or self.by_pages:
            return []
        with closing(sqlite3.connect(f"{self.path.absolute().as_uri()}?mode=ro", uri=True)) as database:
            return wrong_checksums(database)

    def counted(self) -> dict[str, int]:
        """Number of messages by topic as stated in the file: sqlite files state none."""
        return {}


class _NoTables(sqlite3.DatabaseError):
    """The schema lacks the tables of a recording."""


def _is_damage(error: sqlite3.Error) -> bool:
    """Whether the error means that the file is no database, or a damaged one."""
    code = getattr(error, "sqlite_errorcode", sqlite3.SQLITE_OK)
    return isinstance(error, _NoTables) or code & 0xFF in (sqlite3.SQLITE_NOTADB, sqlite3.SQLITE_CORRUPT)


def _batch(rows: Iterator[tuple[int, int, bytes]]) -> list[tuple[int, int, bytes]]:
    """The next rows, within the limits for memory."""
    batch: list[tuple[int, int, bytes]] = []
    fetched = 0
    for row in islice(rows, _ROWS):
        batch.append(row)
        fetched += len(row[2]) if isinstance(row[2], bytes) else 0
        if fetched > _BYTES:
            break
    return batch


def _sizes_by_header(head: bytes) -> tuple[int, int]:
    """Sizes [bytes] of a page and of the whole database from the first 32 bytes (https://sqlite.org/fileformat.html)."""
    if len(head) < 32:
        return 1, 0
    page, pages = struct.unpack_from(">H", head, 16)[0], struct.unpack_from(">I", head, 28)[0]
    page = 65536 if page == 1 else max(1, page)
    return page, page * pages


def _topics(database: sqlite3.Connection) -> dict[int, Topic]:
    tables = {name for (name,) in database.execute("SELECT name FROM sqlite_master WHERE type = 'table'")}
    if not {"topics", "messages"} <= tables:
        raise _NoTables("it has no tables 'topics' and 'messages'")
    definitions: list[tuple[str, str, str]] = []
    if "message_definitions" in tables:
        query = "SELECT topic_type, encoded_message_definition, encoding FROM message_definitions"
        definitions = list(database.execute(query))
        if any({*map(type, row)} != {str} for row in definitions):
            raise sqlite3.DatabaseError("its table 'message_definitions' holds no texts")
    stored = {column[1] for column in database.execute("PRAGMA table_info(topics)")}
    qos = "offered_qos_profiles" if "offered_qos_profiles" in stored else "''"
    query = f"SELECT id, name, type, serialization_format, {qos} FROM topics ORDER BY id"
    found = list(database.execute(query))
    if not all(isinstance(number, int) and {*map(type, texts)} == {str} for number, *texts in found):
        raise sqlite3.DatabaseError("its table 'topics' holds no names and types")
    return _numbered(found, definitions)


def _numbered(topics: Sequence[tuple[Any, ...]], definitions: Sequence[tuple[Any, ...]]) -> dict[int, Topic]:
    """Topics by number, from rows with number, name, type, encoding and QoS, and from rows with type, definition
    and its format."""
    known = {name: (definition, form) for name, definition, form in definitions}
    return {
        number: Topic(name, msgtype, encoding, *known.get(msgtype, ("", "")), *profiles)
        for number, name, msgtype, encoding, *profiles in topics
    }


# types of the rows in a recording's tables; the first value, an INTEGER PRIMARY KEY, is the row's number


def _is_message(values: Sequence[object]) -> bool:
    return [*map(type, values)] == [type(None), int, int, bytes]


def _is_topic(values: Sequence[object]) -> bool:
    return _are_texts(values) and str(values[1]).startswith("/") and "/" in str(values[2])


def _is_definition(values: Sequence[object]) -> bool:
    return _are_texts(values) and not str(values[1]).startswith("/") and "/" in str(values[1])


def _are_texts(values: Sequence[object]) -> bool:
    return len(values) >= 4 and values[0] is None and {*map(type, values[1:])} == {str}
