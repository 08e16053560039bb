"""A diagnosis of the last minute, in a separate process of low priority."""

import json
import os
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from rhythmid.model import Model
from rhythmid.record.convert import write_record
from rhythmid.record.record import Record

NICER = 5  # niceness above the twin's: by the kernel's table of weights a third of its share of a busy processor, without starving
BUDGET = 120.0  # [s] budget of the diagnosis
PATIENCE = 900.0  # [s] after which it is stopped


class Diagnosing:
    """A running `rhythmid diagnose`. `poll` returns its result once."""

    def __init__(self, record: Record, model: Model, elements: tuple[Path, ...] = ()) -> None:
        self._folder = TemporaryDirectory(prefix="rhythmid-twin-")
        folder = Path(self._folder.name)
        bag = write_record(record, folder / "window")
        model.save(folder / "model.yaml")
        self._answer = folder / "answer.json"
        more = [word for path in elements for word in ("--elements", str(path))]
        self._process = subprocess.Popen(
            [
                sys.executable, "-m", "rhythmid.cli", "diagnose", str(bag), "--signals", str(bag / "signals.yaml"),
                "--model", str(folder / "model.yaml"), "--json", str(self._answer), "--budget", str(BUDGET), *more,
            ],
            stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
        )  # fmt: skip

        own = os.getpriority(os.PRIO_PROCESS, 0)
        os.setpriority(os.PRIO_PROCESS, self._process.pid, min(own + NICER, 19))

    def poll(self, wait: bool = False) -> dict[str, Any] | None:
        """Verdict, summary, names with slot and probability, and refitted parameters.

        None while it is running, unless told to `wait`. A diagnosis that fails has the verdict "failed", with the reason as summary.
        """
        if self._process.poll() is None and not wait:
            return None
        try:
            _, said = self._process.communicate(timeout=PATIENCE)
        except subprocess.TimeoutExpired:
            self._process.kill()
            _, said = self._process.communicate()
        try:
            answer = json.loads(self._answer.read_text(encoding="utf-8"))
        except (OSError, ValueError):
            lines = said.strip().splitlines() or [f"exit code {self._process.returncode}"]
            return {"verdict": "failed", "summary": lines[-1], "missing": []}
        finally:
            self._folder.cleanup()
        missing = [{key: one[key] for key in ("element", "slot", "probability")} for one in answer["missing"]]
        return {key: answer[key] for key in ("verdict", "summary", "parameters")} | {"missing": missing}

    def stop(self) -> None:
        """Stop without an answer."""
        if self._process.poll() is None:
            self._process.kill()
            self._process.communicate()
        self._folder.cleanup()
