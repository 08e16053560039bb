"""Watch a machine: run its twin, collect mismatches, and diagnose each that lasts for a minute."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rhythmid.elements.catalogue import Catalogue
from rhythmid.errors import InputError
from rhythmid.model import Model
from rhythmid.record.record import Channel, Record
from rhythmid.record.signals import INPUT_UNITS, OUTPUT_UNITS
from rhythmid.twin.calibration import Calibration
from rhythmid.twin.diagnosis import Diagnosing
from rhythmid.twin.events import Events
from rhythmid.twin.samples import Samples
from rhythmid.twin.settings import Settings
from rhythmid.twin.twin import Role, Status, Twin

Array = NDArray[np.float64]
DIAGNOSED = 60.0  # [s] of mismatch after which its last minute is diagnosed
BEFORE = 2.0  # [s] of commands and forcing kept from before that minute, longer than delays
STEP = 1.0  # [s] of a record that are processed at a time


class Watch:
    """A twin that also collects `events`, the mismatches so far.

    `diagnose`: lasting mismatches are diagnosed. The other parameters are those of `Twin`.
    """

    def __init__(
        self,
        model: Model,
        settings: Settings,
        forced: bool = True,
        calibration: Calibration | None = None,
        catalogue: Catalogue | None = None,
        diagnose: bool = True,
        elements: tuple[Path, ...] = (),
        released: bool = False,
    ) -> None:
        self.twin = Twin(model, settings, forced, calibration, catalogue, released)
        self.events = Events()
        self._model, self._settings, self._elements = model, settings, elements
        self._diagnose = diagnose
        self._recent: dict[Role, Samples] = {role: Samples() for role in self.twin.samples}
        self._diagnosing: tuple[float, Diagnosing] | None = None
        self._diagnosed: float | None = None  # the event whose diagnosis is running or finished

    def push(self, role: Role, time: Array, value: Array) -> None:
        """Add samples of one signal, as in `Twin.push`."""
        self.twin.push(role, time, value)
        if self._diagnose and role in self._recent:
            self._recent[role].append(np.asarray(time, dtype=float), np.asarray(value, dtype=float))
            self._recent[role].forget(self._recent["output"].newest - DIAGNOSED - BEFORE)

    def advance(self) -> list[Status]:
        """Judge the samples received; see `Twin.advance`."""
        said = self.twin.advance()
        for status in said:
            self.events.take(status)
            self._consider(status)
        self._collect(wait=False)
        return said

    def close(self, wait: bool = False) -> None:
        """End; with `wait`, only after a running diagnosis."""
        self._collect(wait)
        if self._diagnosing is not None:
            self._diagnosing[1].stop()
            self._diagnosing = None

    def _consider(self, status: Status) -> None:
        """Start a diagnosis of a mismatch that has lasted long enough, one at a time."""
        lasting = status.since is not None and status.time - status.since >= DIAGNOSED
        if (
            not (self._diagnose and lasting)
            or self._diagnosing is not None
            or self._diagnosed == status.since
        ):
            return
        assert status.since is not None
        self._diagnosed = status.since
        try:
            self._diagnosing = status.since, Diagnosing(self._window(), self._model, self._elements)
        except InputError as problem:  # for example an acceleration, which a bag of joint states cannot hold
            answer = {"verdict": "failed", "summary": str(problem), "missing": []}
            self.events.diagnosed(status.since, answer)

    def _collect(self, wait: bool) -> None:
        if self._diagnosing is None:
            return
        since, running = self._diagnosing
        if (answer := running.poll(wait)) is not None:
            self.events.diagnosed(since, answer)
            self._diagnosing = None

    def _window(self) -> Record:
        """The last minute as a record."""
        settings, start = self._settings, self._recent["output"].newest - DIAGNOSED
        units = {
            "input": INPUT_UNITS[settings.input_kind],
            "output": OUTPUT_UNITS[settings.output_kind],
            "forcing": "N",
        }
        channels = {}
        for role, samples in self._recent.items():
            time, value = samples.between(start if role == "output" else start - BEFORE, np.inf)
            if len(time):
                channels[role] = Channel(time, value, units[role])
        return Record(
            "window", input_kind=settings.input_kind, output_kind=settings.output_kind, hold=settings.hold, **channels
        )  # fmt: skip


def watch_record(record: Record, watch: Watch, tell: Callable[[Status], None] = lambda status: None) -> None:
    """Run a watch over a record as if it came in live; `tell` receives the status of each segment.

    Raises InputError where the record is shorter than the healthy stretch.
    """
    channels: dict[Role, Channel] = {
        role: record.channels[role] for role in watch.twin.samples if role in record.channels
    }
    fed = dict.fromkeys(channels, 0)
    output = record.output.time
    for until in [*np.arange(output[0] + STEP, output[-1], STEP), np.inf]:
        for role, channel in channels.items():
            last = int(np.searchsorted(channel.time, until))
            part = slice(fed[role], last)
            watch.push(role, channel.time[part], channel.value[part])
            fed[role] = last
        for status in watch.advance():
            tell(status)
    if watch.twin.calibration is None:
        raise InputError(
            f"{record.name} lasts {record.duration:.0f} s, and its first {watch.twin.settings.healthy:g} s are to be healthy operation; "
            "shorten that with --healthy, or give a calibration"
        )
