"""sqlite3 bags written by whole arrays of messages."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from rosbags.rosbag2.storage_sqlite3 import Sqlite3Writer


class SqliteWriter(Sqlite3Writer):
    """rosbags' sqlite3 storage with `write_arrays` and `flush`, as `McapWriter` has them."""

    def write_arrays(self, parts: Sequence[tuple[int, NDArray[np.int64], NDArray[np.uint8]]]) -> None:
        """Write the messages of several topics in order of receive time.

        Each part is a topic's number, receive times int64[n] [ns] and equally long messages uint8[n, size].
        """
        rows = [
            (topic, time, data)
            for topic, log_ns, block in parts
            for time, data in zip(log_ns.tolist(), map(bytes, block), strict=True)
        ]
        order = np.argsort(np.concatenate([log_ns for _, log_ns, _ in parts]), kind="stable")
        self.cursor.executemany(
            "INSERT INTO messages (topic_id, timestamp, data) VALUES (?, ?, ?)",
            (rows[index] for index in order.tolist()),
        )

    def flush(self) -> None:
        """Commit everything written so far."""
        self.conn.commit()
