"""Damage of an sqlite3 bag: skips broken pages, compares structure and checksums."""

import sqlite3
import struct

from rhythmid.record.sqlite_writer import checksum


def in_order(number: object, before: int) -> int:
    """The number of a row after the row `before`. A damaged tree may return to earlier rows endlessly: then an
    error is raised."""
    if not isinstance(number, int) or number <= before:
        raise sqlite3.DatabaseError("its table 'messages' is out of order")
    return number


def next_readable(database: sqlite3.Connection, after: int) -> int | None:
    """The first readable row of `messages` after `after`; None if there is none."""

    def first(low: int) -> int | None:
        row = database.execute(
            "SELECT id, topic_id, timestamp, data FROM messages WHERE id > ? ORDER BY id LIMIT 1", (low,)
        ).fetchone()
        return None if row is None else in_order(row[0], low)

    try:
        last = database.execute("SELECT max(id) FROM messages").fetchone()[0]
    except sqlite3.DatabaseError:
        return None
    broken, step = after, 1
    while isinstance(last, int) and broken + step < last:
        try:
            found = first(broken + step)
            break
        except sqlite3.DatabaseError:
            broken, step = broken + step, 2 * step
    else:
        return None
    whole = broken + step
    while whole - broken > 1:  # rows after `broken` cannot be read, those after `whole` can
        middle = (broken + whole) // 2
        try:
            found, whole = first(middle), middle
        except sqlite3.DatabaseError:
            broken = middle
    return found


def wrong_checksums(database: sqlite3.Connection) -> list[str]:
    """Errors found by sqlite's own check and by the checksums of messages, where there are any; one phrase each."""
    found = []
    try:
        (answer,) = database.execute("PRAGMA quick_check(1)").fetchone()
        if answer != "ok":
            found.append(f"sqlite finds it damaged: {' '.join(str(answer).split())[:200]}")
        if not database.execute("SELECT 1 FROM sqlite_master WHERE name = 'checksums'").fetchone():
            return found
        wrong, before = _compared(database)
        found += [
            f"messages {first} to {last} are not what was written: their checksum is wrong"
            for first, last, _ in wrong
        ]
        beyond = database.execute("SELECT count(*) FROM messages WHERE id > ?", (before,)).fetchone()[0]
        if beyond:
            found.append(f"{beyond} messages have no checksum")
    except (sqlite3.DatabaseError, TypeError, ValueError, struct.error) as error:
        found.append(f"its checksums cannot be compared: {error}")
    return found


def wrong_messages(database: sqlite3.Connection) -> list[tuple[int, int]]:
    """First and last row of `messages` of every checksum that is wrong although all its rows are there; empty where there are none, or
    they cannot be compared."""
    try:
        if not database.execute("SELECT 1 FROM sqlite_master WHERE name = 'checksums'").fetchone():
            return []
        return [(first, last) for first, last, whole in _compared(database)[0] if whole]
    except (sqlite3.DatabaseError, TypeError, ValueError, struct.error):
        return []


def _compared(database: sqlite3.Connection) -> tuple[list[tuple[int, int, bool]], int]:
    """First and last row of the checksums that are wrong, with whether all rows are there; and the last row that has a checksum."""
    wrong: list[tuple[int, int, bool]] = []
    before = 0
    query = "SELECT topic_id, timestamp, data FROM messages WHERE id > ? AND id <= ? ORDER BY id"
    for last, stated in database.execute("SELECT last_id, crc32 FROM checksums ORDER BY last_id").fetchall():
        summed, count = 0, 0
        try:
            for topic, time, data in database.execute(query, (before, last)):
                summed, count = checksum(topic, time, data, summed), count + 1
        except sqlite3.DatabaseError:  # a broken page
            count = 0
        if summed != stated or count != last - before:
            wrong.append((before + 1, last, count == last - before))
        before = last
    return wrong, before
