"""What was read of a recording of several joints: its tables and topics are read once, not once for each joint."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from rhythmid.record.bag import Bag
from rhythmid.record.block import Block, Topic
from rhythmid.record.columns import Columns, read_columns
from rhythmid.record.signals import Signals
from rhythmid.record.table import Table


@dataclass(frozen=True, eq=False)
class Opened:
    """What was read of the recording of several joints, for the next one of them: tables by file, and the bag with its columns and runs."""

    tables: dict[Path, Table] = field(default_factory=dict)
    bags: dict[Path, tuple[Bag, Mapping[str, Columns], list[bytes]]] = field(default_factory=dict)
    fields: Mapping[str, list[Any]] = field(default_factory=dict)

    @classmethod
    def of(cls, signals: Iterable[Signals]) -> "Opened":
        """Nothing read yet, for records with these signals."""
        fields: dict[str, list[Any]] = {}
        for one in signals:
            for topic, wanted in fields_of(one).items():
                known = fields.setdefault(topic, [])
                known += [each for each in wanted if each not in known]
        return cls(fields=fields)

    def table(self, path: Path) -> Table:
        """A table, read at the first call."""
        if path not in self.tables:
            self.tables[path] = Table.load(path)
        return self.tables[path]

    def bag(
        self, bag: Bag, fields: Mapping[str, list[Any]]
    ) -> tuple[Bag, Mapping[str, Columns], list[bytes]]:
        """A bag, its columns of all these fields, and the descriptions of its run, read at the first call."""
        if bag.path not in self.bags:
            wanted, run = self.fields or fields, list[bytes]()
            blocks = bag.blocks(lambda topic: topic.name in wanted or is_run(topic))
            self.bags[bag.path] = bag, read_columns(_divert_run(blocks, run), wanted), run
        return self.bags[bag.path]


def fields_of(signals: Signals) -> dict[str, list[Any]]:
    """The fields that signals need, by topic."""
    wanted: dict[str, list[Any]] = {}
    for source in signals.channels.values():
        wanted.setdefault(source.topic, []).append(source.field)
    return wanted


def is_run(topic: Topic) -> bool:
    """Whether the topic holds descriptions of the experiment."""
    return topic.type == "std_msgs/msg/String" and topic.name.rsplit("/", 1)[-1] == "run"


def _divert_run(blocks: Iterable[Block], run: list[bytes]) -> Iterator[Block]:
    for block in blocks:
        if is_run(block.topic):
            run.extend(block)
        else:
            yield block
