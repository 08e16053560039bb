"""Bags written: rosbag2 directories with MCAP or sqlite3 storage, complete or not at all."""

import json
import os
import shutil
import sqlite3
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Literal, cast

import numpy as np
from numpy.typing import NDArray
from rosbags.interfaces import (
    Connection,
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer

from rhythmid.errors import InputError
from rhythmid.record.mcap_writer import McapWriter
from rhythmid.record.message_types import standard_types
from rhythmid.record.messages import Messages, string_message
from rhythmid.record.sqlite_writer import SqliteWriter

Storage = Literal["mcap", "sqlite3"]
STORAGES = {"mcap": StoragePlugin.MCAP, "sqlite3": StoragePlugin.SQLITE3}
FOREVER = QosTime(9223372036, 854775807)  # how rosbag2 writes an infinite duration


class BagWriter(Writer):
    """rosbags' Writer with storages that also take arrays."""

    STORAGE_PLUGINS = {StoragePlugin.MCAP: McapWriter, StoragePlugin.SQLITE3: SqliteWriter}

    def flush(self) -> None:
        """Make everything written so far readable, should the process be killed."""
        cast(McapWriter | SqliteWriter, self.storage).flush()

    def write_arrays(self, parts: Sequence[tuple[Connection, NDArray[np.int64], NDArray[np.uint8]]]) -> None:
        """Write whole topics in order of receive time: connection, times int64[n] [ns], messages uint8[n, size]."""
        if not parts:
            return
        arrays = [(connection.id, log_ns, data) for connection, log_ns, data in parts]
        cast(McapWriter | SqliteWriter, self.storage).write_arrays(arrays)
        for number, log_ns, _ in arrays:
            if len(log_ns):
                self.counts[number] += len(log_ns)
                self.min_timestamp = min(self.min_timestamp, int(log_ns.min()))
                self.max_timestamp = max(self.max_timestamp, int(log_ns.max()))


def qos(transient_local: bool = False, depth: int = 100) -> Qos:
    """Quality of service that the nodes offer: reliable, the last `depth` messages; kept for late joiners or not."""
    durability = QosDurability.TRANSIENT_LOCAL if transient_local else QosDurability.VOLATILE
    return Qos(
        QosHistory.KEEP_LAST, 1 if transient_local else depth, QosReliability.RELIABLE, durability,
        FOREVER, FOREVER, QosLiveliness.AUTOMATIC, FOREVER, False,
    )  # fmt: skip


def add_topic(writer: Writer, topic: str, msgtype: str, transient_local: bool = False) -> Connection:
    """Declare a topic of a standard type (`sensor_msgs/msg/JointState`, …) in an open bag."""
    profile = qos(transient_local)
    return writer.add_connection(topic, msgtype, typestore=standard_types(), offered_qos_profiles=[profile])


@contextmanager
def new_bag(path: str | Path, storage: Storage = "mcap", compress: bool = False) -> Iterator[BagWriter]:
    """A bag being written. It appears under `path` when the block ends without an exception, and never otherwise.

    Raises InputError when `path` exists, its folder cannot be written, or `storage` is unknown.
    """
    path = Path(path)
    if storage not in STORAGES:
        raise InputError(f"storage {storage!r} is unknown: use {' or '.join(STORAGES)}")
    if os.path.lexists(path):
        raise InputError(f"{path}: exists already and is not overwritten; choose another path or remove it")
    folder: Path | None = None
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        folder = Path(tempfile.mkdtemp(prefix=f".{path.name}.", dir=path.parent))
        writer = BagWriter(folder / path.name, version=9, storage_plugin=STORAGES[storage])
        if compress:
            writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
        writer.open()
        try:
            yield writer
        except BaseException:
            writer.abort()
            raise
        writer.close()
        if os.path.lexists(path):  # renaming would replace an empty folder
            raise InputError(f"{path}: was made by someone else meanwhile and is not overwritten")
        (folder / path.name).rename(path)
    except (OSError, sqlite3.Error) as error:
        raise InputError(f"{path}: cannot be written: {getattr(error, 'strerror', None) or error}") from None
    finally:
        if folder is not None:
            shutil.rmtree(folder, ignore_errors=True)


def write_bag(
    path: str | Path,
    topics: Mapping[str, Messages],
    storage: Storage = "mcap",
    run: Mapping[str, Any] | None = None,
    joint: str = "leg",
    frame_id: str = "",
    namespace: str = "/hopper",
) -> Path:
    """Write joint states as a bag.

    Parameters
    ----------
    path : new bag directory; it is complete or absent, and an existing one is never touched.
    topics : topic -> messages; names without a leading '/' are relative to `namespace`.
    run : description of the experiment, written as JSON to the latched topic `run`.

    Returns the path. Raises InputError when the path exists or cannot be written, or a value is not finite.
    """
    if not joint:
        raise InputError("the joint needs a name")
    full = {
        name if name.startswith("/") else f"{namespace.rstrip('/')}/{name}": m for name, m in topics.items()
    }
    for name, messages in full.items():
        messages.check(name)
    with new_bag(path, storage) as writer:
        if run is not None:
            note = add_topic(
                writer, f"{namespace.rstrip('/')}/run", "std_msgs/msg/String", transient_local=True
            )
            starts = [int(messages.log_ns.min()) for messages in full.values() if len(messages)]
            writer.write(note, min(starts, default=0), string_message(json.dumps(run)))
        parts = [
            (
                add_topic(writer, name, "sensor_msgs/msg/JointState"),
                messages.log_ns,
                messages.serialised(joint, frame_id),
            )
            for name, messages in full.items()
        ]
        writer.write_arrays(parts)
    return Path(path)
