"""Writer of bags: rosbag2 directories with MCAP or sqlite3 storage, written completely or not at all."""

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
    ConnectionExtRosbag2,
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.rosbag2.errors import WriterError

from rhythmid.errors import InputError
from rhythmid.record.mcap_writer import McapWriter
from rhythmid.record.message_types import STANDARD_DISTRO, standard_types
from rhythmid.record.messages import Messages, string_message
from rhythmid.record.metadata import VERSION, FileContent, bag_information, metadata_text, qos_text
from rhythmid.record.sqlite_writer import SqliteWriter

Storage = Literal["mcap", "sqlite3"]
_FILES = {StoragePlugin.MCAP: McapWriter, StoragePlugin.SQLITE3: SqliteWriter}
STORAGES = {"mcap": StoragePlugin.MCAP, "sqlite3": StoragePlugin.SQLITE3}
FOREVER = QosTime(9223372036, 854775807)  # rosbag2's notation of an infinite duration


class BagWriter(Writer):
    """rosbags' Writer, extended by storages that accept arrays and by files that can be split.

    `numbered` names the files as rosbag2's recorder does (`bag_0.mcap`, …); without it there is one file, `bag.mcap`.
    `ros_distro` is the ROS distribution that metadata.yaml names.
    """

    def __init__(
        self,
        path: Path | str,
        storage: Storage,
        numbered: bool = False,
        ros_distro: str = STANDARD_DISTRO,
    ) -> None:
        super().__init__(path, version=VERSION, storage_plugin=STORAGES[storage])
        self.files: list[FileContent] = []
        self._numbered = numbered
        self._ros_distro = ros_distro

    @property
    def file(self) -> FileContent:
        """Content written so far to the current file."""
        return self.files[-1]

    def open(self) -> None:
        """Create the folder and the first file. Raises WriterError if the folder exists, OSError or sqlite3.Error."""
        try:
            self.path.mkdir(parents=True)
        except FileExistsError:
            raise WriterError(f"{self.path} exists already and is not overwritten") from None
        self._open_file()

    def _open_file(self) -> None:
        name = f"{self.path.name}_{len(self.files)}" if self._numbered else self.path.name
        storage = _FILES[self.storage_plugin](self.path, self.compression_mode, name)
        self.storage = storage
        self.files.append(FileContent(storage.path.name))

    def split(self) -> None:
        """Close the current file and continue in a new one."""
        self._close_file([self.file])
        self._open_file()
        assert self.storage is not None
        for msgtype in {connection.msgtype: connection for connection in self.connections}.values():
            self.storage.add_msgtype(msgtype)
        for connection in self.connections:
            assert isinstance(connection.ext, ConnectionExtRosbag2)
            self.storage.add_connection(connection, qos_text(connection.ext.offered_qos_profiles))

    def flush(self) -> None:
        """Make all data written so far readable, even if the process is killed."""
        cast(McapWriter | SqliteWriter, self.storage).flush()

    def write(
        self, connection: Connection, timestamp: int, data: bytes | memoryview, sent_ns: int = 0
    ) -> None:
        """Write one message with its receive time [ns], and the time at which it was published [ns] where that is known."""
        cast(McapWriter | SqliteWriter, self.storage).write(connection, timestamp, data, sent_ns)
        self.file.add(connection.id, timestamp, timestamp, 1, len(data))

    def write_arrays(self, parts: Sequence[tuple[Connection, NDArray[np.int64], NDArray[np.uint8]]]) -> None:
        """Write whole topics in order of receive time: connection, times int64[n] [ns], messages uint8[n, size]."""
        if not parts:
            return
        arrays = [(connection.id, log_ns, data) for connection, log_ns, data in parts]
        cast(McapWriter | SqliteWriter, self.storage).write_arrays(arrays)
        for number, log_ns, data in arrays:
            if len(log_ns):
                self.file.add(number, int(log_ns.min()), int(log_ns.max()), len(log_ns), data.size)

    def close(self) -> None:
        """Close the last file and write metadata.yaml, which completes the bag."""
        self._close_file(self.files)
        text = metadata_text(self._information(self.files))
        unfinished = self.metapath.with_suffix(".yaml.tmp")
        unfinished.write_text(text, encoding="utf-8")
        unfinished.replace(self.metapath)

    def _close_file(self, described: Sequence[FileContent]) -> None:
        assert self.storage is not None
        self.storage.close(VERSION, json.dumps(self._information(described)))  # JSON is YAML
        self.storage = None

    def _information(self, files: Sequence[FileContent]) -> dict[str, Any]:
        name = self.storage_plugin.name.lower()
        return bag_information(name, files, self.connections, self._ros_distro, self.custom_data)


def qos(transient_local: bool = False, depth: int = 100) -> Qos:
    """Quality of service of the nodes: reliable, the last `depth` messages; with `transient_local` kept for late
    joiners."""
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
    """Context of a new bag. It appears under `path` when the block ends without an exception, and never otherwise.

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
        writer = BagWriter(folder / path.name, storage)
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
            raise InputError(f"{path}: was created by another process meanwhile and is not overwritten")
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
