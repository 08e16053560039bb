"""Storage of answers in files, each as soon as it is finished, so that a batch can continue after an interruption."""

import json
import os
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from rhythmid.batch.answered import Answered
from rhythmid.batch.task import Task
from rhythmid.errors import InputError
from rhythmid.output import require_writable, write_json, write_text

MARK = "rhythmid_batch.json"  # marks the folder of a batch; other folders are not written to
ANSWERS = "answers"


class Kept:
    """The folder of a batch. Each answer has a JSON file and a page. The JSON is written last, so that an answer with a JSON file is complete.

    Raises InputError for a folder that holds something else.
    """

    def __init__(self, folder: Path) -> None:
        if os.path.lexists(folder) and not (folder / MARK).is_file():
            if not folder.is_dir():
                raise InputError(f"{folder}: exists already and is no folder; name another with --out")
            if any(folder.iterdir()):
                raise InputError(
                    f"{folder}: exists already and is no batch's; name another folder with --out"
                )
        require_writable(folder / MARK)
        self.folder = folder

    def begin(self) -> None:
        """Make the folder, and mark it as a batch's."""
        if not (self.folder / MARK).is_file():
            write_json(self.folder / MARK, {"program": "rhythmid", "content": "answers of a batch"})

    def get(self, task: Task) -> Answered | None:
        """The answer to a task without page and result, None if there is none yet."""
        try:
            content = json.loads(self._path(task, ".json").read_text(encoding="utf-8"))
            return brief(Answered.of(_of_task(content, task)))
        except (OSError, ValueError, KeyError, TypeError):
            return None

    def put(self, task: Task, answered: Answered) -> None:
        """Store an answer. A failed task is not stored, so that it is tried again."""
        if answered.failure:
            return
        write_text(self._path(task, ".html"), answered.page)
        write_json(
            self._path(task, ".json"), {"key": task.key, "name": task.name, "answer": answered.to_dict()}
        )

    def page(self, task: Task) -> str:
        """Link to the page of an answer, relative to the folder."""
        return f"{ANSWERS}/{task.file}.html"

    def _path(self, task: Task, suffix: str) -> Path:
        return self.folder / ANSWERS / f"{task.file}{suffix}"


def brief(answered: Answered) -> Answered:
    """An answer without the parts that only its own files need."""
    return replace(answered, result=None, page="")


def _of_task(content: Mapping[str, Any], task: Task) -> Mapping[str, Any]:
    if content["key"] != task.key:
        raise KeyError(task.key)
    return content["answer"]
