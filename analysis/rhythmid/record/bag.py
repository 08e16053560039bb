"""A rosbag2 recording on disk: a directory, or one of its storage files, compressed or not, finished or not."""

import re
import struct
from collections.abc import Iterator, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory

from rhythmid import document
from rhythmid.errors import InputError
from rhythmid.record.block import Block, Topic, Wanted
from rhythmid.record.compression import decompress_file
from rhythmid.record.folder_of_tables import is_folder_of_tables
from rhythmid.record.foreign_file import refuse_foreign
from rhythmid.record.lfs_pointer import check_content
from rhythmid.record.mcap_reader import McapReader
from rhythmid.record.sqlite_reader import SqliteReader

SQLITE = ".db3"
SUFFIXES = (".mcap", ".db3", ".mcap.zstd", ".db3.zstd")


def is_bag(path: Path) -> bool:
    """Whether the path looks like a bag: a directory that is no folder of tables, or a file with a storage file's suffix."""
    return path.name.endswith(SUFFIXES) or (path.is_dir() and not is_folder_of_tables(path))


class Bag:
    """A recording. `topics`, `truncated` and `notes` are complete once `blocks` is exhausted.

    Attributes
    ----------
    files : storage files in the order of recording.
    topics : all topics by name, with or without messages.
    truncated : whether the recording ends abruptly (its recorder was killed or is still running).
    notes : messages about the state of the files, one line each; empty for a complete recording.
    stated : number of messages by topic, from metadata.yaml or the end of the files; empty where they do not state it.

    With `verify` the checksums of the files are compared, with `intact` messages whose checksum is wrong are left out. Raises InputError when there is no such recording.
    """

    def __init__(self, path: str | Path, verify: bool = False, intact: bool = False) -> None:
        self.path = Path(path)
        self.stated: dict[str, int] = {}
        self._verify, self._intact = verify, intact
        self.topics: dict[str, Topic] = {}
        self.truncated = False
        self.notes: list[str] = []
        if self.path.exists():
            refuse_foreign(self.path)
        if self.path.is_dir():
            self.files = self._files_of_directory()
        elif not self.path.exists():
            raise InputError(f"{self.path}: no such bag")
        elif is_bag(self.path):
            self.files = [self.path]
        else:
            raise InputError(
                f"{self.path}: is neither a bag directory nor a file named {', '.join(SUFFIXES)}"
            )

    @property
    def name(self) -> str:
        """Name of the recording, without suffixes."""
        return self.path.resolve().name.split(".")[0] if self.path.is_file() else self.path.resolve().name

    def _files_of_directory(self) -> list[Path]:
        metadata = self.path / "metadata.yaml"
        present = [file for file in self.path.iterdir() if file.name.endswith(SUFFIXES) and file.is_file()]
        if not present:
            raise InputError(f"{self.path}: holds no recording (no {' or '.join(SUFFIXES[:2])} file)")
        present.sort(
            key=lambda file: [
                int(part) if part.isdecimal() else part for part in re.split(r"(\d+)", file.name)
            ]
        )
        if not metadata.is_file():
            self.notes.append("metadata.yaml is missing: the recorder was not closed")
            return present
        try:
            listed = document.read(metadata).plain["rosbag2_bagfile_information"]
            files = [self.path / Path(name).name for name in listed["relative_file_paths"]]
            if not all(file.name.endswith(SUFFIXES) for file in files):
                raise ValueError("names other files than recordings")
            missing = [file.name for file in files if not file.is_file()]
            self.stated = {
                str(topic["topic_metadata"]["name"]): int(topic["message_count"])
                for topic in listed["topics_with_message_count"]
            }
        except (OSError, ValueError, KeyError, TypeError):
            self.notes.append("metadata.yaml is damaged: all storage files of the directory were read")
            return present
        if missing:
            raise InputError(f"{self.path}: {missing[0]}, which metadata.yaml lists, is missing")
        return files

    def blocks(self, wanted: Wanted = lambda topic: True) -> Iterator[Block]:
        """Messages of the wanted topics, block by block in the order of recording. Raises InputError."""
        for file in self.files:
            check_content(file)
            if file.suffix != ".zstd":
                yield from self._read(file, wanted)
                continue
            with TemporaryDirectory(prefix="rhythmid-") as folder:
                plain = Path(folder) / file.stem
                try:
                    decompress_file(file, plain)
                except (ValueError, OSError) as error:
                    raise InputError(f"{file}: cannot be decompressed: {error}") from None
                yield from self._read(plain, wanted)

    def _read(self, file: Path, wanted: Wanted) -> Iterator[Block]:
        # a chunk of an MCAP file whose checksum is wrong is never read
        reader = SqliteReader(file, self._intact) if file.suffix == SQLITE else McapReader(file)
        try:
            yield from reader.blocks(wanted)
        except InputError:
            raise
        except (ValueError, struct.error) as error:
            raise InputError(f"{file}: is damaged: {error}") from None
        self.topics.update(reader.topics)
        self.notes += [f"{file.name}: {note}" for note in reader.damage]
        if self._verify:
            self.notes += [f"{file.name}: {note}" for note in reader.wrong_checksums()]
            if not (self.path / "metadata.yaml").is_file():
                for name, count in reader.counted().items():
                    self.stated[name] = self.stated.get(name, 0) + count
        if reader.truncated:
            self.truncated = True
            self.notes.append(f"{file.name}: breaks off; what precedes the break was read")

    def lost(self, counts: Mapping[str, int]) -> dict[str, int]:
        """Number of messages by topic that are missing from `counts`, as far as the bag states the total."""
        return {
            name: missing
            for name, stated in self.stated.items()
            if (missing := stated - counts.get(name, 0)) > 0
        }
