"""Recovery of a recording whose recorder was killed: readable messages are written to a complete bag."""

import time
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import groupby
from operator import itemgetter
from pathlib import Path
from typing import Any

from rosbags.interfaces import Connection
from rosbags.rosbag2 import ReaderError
from rosbags.rosbag2.metadata import parse_qos

from rhythmid.errors import InputError
from rhythmid.progress import Tell, silent
from rhythmid.record.bag import Bag
from rhythmid.record.bag_writer import BagWriter, Storage, new_bag
from rhythmid.record.block import Topic
from rhythmid.record.message_types import typestore


@dataclass(frozen=True)
class Recovered:
    """The new bag, its number of messages by topic, and the damage of the old bag.

    `lost` is the number of messages by topic that the old bag states but does not hold; empty where it states none.
    """

    path: Path
    counts: Mapping[str, int]
    notes: tuple[str, ...]
    lost: Mapping[str, int]

    def to_dict(self) -> dict[str, Any]:
        """The result as plain values for JSON."""
        return {
            "path": str(self.path),
            "recovered": dict(self.counts),
            "lost": dict(self.lost),
            "notes": list(self.notes),
        }

    def lines(self) -> list[str]:
        """The result as plain text."""
        found = [f"  note: {note}" for note in self.notes]
        for name in sorted({*self.counts, *self.lost}):
            lost = f", {self.lost[name]} lost" if name in self.lost else ""
            found.append(f"  {name}: {self.counts.get(name, 0)} messages{lost}")
        return [f"{self.path}: {sum(self.counts.values())} messages recovered", *found]


TELLING = 1.0  # [s] between two progress messages


def recover(path: str | Path, out: str | Path, storage: Storage = "mcap", tell: Tell = silent) -> Recovered:
    """Write every intact message of the incomplete or damaged bag `path` to the new bag `out`.

    Topics, types, times and QoS are kept; the old bag is not changed. `tell` is called regularly with the
    number of messages written. Raises InputError when nothing can be read, or `out` exists or cannot be written.
    """
    bag = Bag(path, verify=True, intact=True)
    connections: dict[str, Connection] = {}
    counts: dict[str, int] = {}
    left_out: dict[str, str] = {}
    told = time.monotonic()
    with new_bag(out, storage) as writer:
        # blocks of one buffer belong together: their messages are sorted into the order of recording
        for _, together in groupby(bag.blocks(), key=lambda block: id(block.buffer)):
            blocks = [block for block in together if block.topic.name not in left_out]
            for block in blocks:
                name = block.topic.name
                if name not in connections:
                    try:
                        connections[name] = _declare(writer, block.topic)
                    except InputError as error:
                        left_out[name] = f"left out: {error}"
            messages = [
                (start, block.topic.name, stamp, data, sent)
                for block in blocks
                if block.topic.name in connections
                for start, stamp, sent, data in zip(
                    block.start.tolist(),
                    block.log_ns.tolist(),
                    (block.log_ns if block.sent_ns is None else block.sent_ns).tolist(),
                    block,
                )
                if stamp >= 0  # no clock has negative times: such a message is damaged
            ]
            for _, name, stamp, data, sent in sorted(messages, key=itemgetter(0)):
                writer.write(connections[name], stamp, data, sent if sent > 0 else 0)
                counts[name] = counts.get(name, 0) + 1
            if time.monotonic() - told >= TELLING:
                told = time.monotonic()
                tell(f"{sum(counts.values())} messages recovered so far")
        if not counts:
            raise InputError(f"{path}: holds no readable message; nothing was recovered")
    return Recovered(Path(out), counts, (*bag.notes, *left_out.values()), bag.lost(counts))


def _declare(writer: BagWriter, topic: Topic) -> Connection:
    store = typestore(topic)
    definition = topic.definition or store.generate_msgdef(topic.type, ros_version=2)[0]
    try:
        profiles = parse_qos(topic.qos)
    except (ReaderError, KeyError, TypeError):
        profiles = []
    return writer.add_connection(
        topic.name,
        topic.type,
        msgdef=definition,
        rihs01=store.hash_rihs01(topic.type),
        serialization_format=topic.encoding,
        offered_qos_profiles=profiles,
    )
