"""metadata.yaml of rosbag2, version 9: content of a bag, by file and by topic."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import yaml
from rosbags.interfaces import Connection, ConnectionExtRosbag2, Qos
from rosbags.rosbag2.metadata import dump_qos_v9

VERSION = 9
_NOTHING_YET = 2**63 - 1  # starting time of an empty file, as rosbag2 writes it


@dataclass
class FileContent:
    """Content written to one storage file: number of messages by connection, and the range of their receive times
    [ns]."""

    name: str
    counts: dict[int, int] = field(default_factory=dict)
    first_ns: int = _NOTHING_YET
    last_ns: int = 0
    size: int = 0  # bytes of the messages

    def add(self, connection: int, first_ns: int, last_ns: int, count: int, size: int) -> None:
        """Count `count` further messages."""
        self.counts[connection] = self.counts.get(connection, 0) + count
        self.first_ns, self.last_ns = min(self.first_ns, first_ns), max(self.last_ns, last_ns)
        self.size += size

    def summary(self) -> dict[str, Any]:
        return {
            "path": self.name,
            "starting_time": {"nanoseconds_since_epoch": self.first_ns},
            "duration": {"nanoseconds": max(0, self.last_ns - self.first_ns)},
            "message_count": sum(self.counts.values()),
        }


def qos_text(profiles: Sequence[Qos]) -> str:
    """Offered quality of service in the form of a storage file."""
    return yaml.safe_dump(dump_qos_v9(list(profiles)), sort_keys=False).strip()


def bag_information(
    storage: str,
    files: Sequence[FileContent],
    connections: Sequence[Connection],
    ros_distro: str,
    custom_data: Mapping[str, str] | None = None,
) -> dict[str, Any]:
    """Content of metadata.yaml below its top-level key; `ros_distro` is the ROS distribution of the message types."""
    total = FileContent("")
    for file in files:
        for number, count in file.counts.items():
            total.add(number, file.first_ns, file.last_ns, count, 0)
    whole = total.summary()
    del whole["path"]
    return {
        "version": VERSION,
        "storage_identifier": storage,
        "relative_file_paths": [file.name for file in files],
        **whole,
        "topics_with_message_count": [
            {"topic_metadata": _topic(connection), "message_count": total.counts.get(connection.id, 0)}
            for connection in connections
        ],
        "compression_format": "",
        "compression_mode": "",
        "files": [file.summary() for file in files],
        "custom_data": dict(custom_data) if custom_data else None,
        "ros_distro": ros_distro,
    }


def _topic(connection: Connection) -> dict[str, Any]:
    assert isinstance(connection.ext, ConnectionExtRosbag2)
    return {
        "name": connection.topic,
        "type": connection.msgtype,
        "serialization_format": connection.ext.serialization_format,
        "offered_qos_profiles": dump_qos_v9(list(connection.ext.offered_qos_profiles)),
        "type_description_hash": connection.digest,
    }


def metadata_text(information: Mapping[str, Any]) -> str:
    """The text of metadata.yaml."""
    return yaml.safe_dump({"rosbag2_bagfile_information": dict(information)}, sort_keys=False)
