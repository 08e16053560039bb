"""The live twin: a model that runs beside the machine, is corrected by measurements, and reports when the two differ.

It takes samples as they come and judges them segment by segment. It needs neither ROS nor a clock: time is that of the samples.
"""

from collections import deque
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from rhythmid.elements.catalogue import Catalogue, load_catalogue
from rhythmid.model import Model
from rhythmid.twin.calibration import Calibration, calibrate
from rhythmid.twin.changes import DELAYS, without_own_forcing
from rhythmid.twin.detector import Threshold
from rhythmid.twin.isolation import DelayNow, Isolation, delays_now, isolate
from rhythmid.twin.lateness import LOOK, Doubt, possible_lateness
from rhythmid.twin.observer import Observer
from rhythmid.twin.outliers import WithoutOutliers
from rhythmid.twin.released import Released
from rhythmid.twin.samples import Samples
from rhythmid.twin.score import Score, Whitener
from rhythmid.twin.segment import Simulation
from rhythmid.twin.settings import Settings

Array = NDArray[np.float64]
Level = Literal["learning", "late", "ok", "warn", "error"]
Role = Literal["input", "output", "forcing", "released"]
CONFIRMED = 10.0  # [s] of mismatch after which a warning becomes an error
# [s] by which commands and forcing may be older than the measurement before they are taken as held
PATIENCE = 1.0


@dataclass(frozen=True)
class Status:
    """The twin's report after a segment.

    Attributes
    ----------
    time : time of the newest judged measurement [s].
    level : "learning" in the healthy stretch; "late" where messages come too late to be used; "warn" with the first mismatch, "error"
        when it has lasted ten seconds; otherwise "ok".
    mismatch : the largest statistic as a multiple of its threshold.
    innovation : rms of the normalised innovations of the last second, 1 in healthy operation.
    since : time when the mismatch was first detected [s], None without one.
    isolation : its location, None without a mismatch.
    delays : estimates from the last window: input, measurement and their sum.
    """

    time: float
    level: Level
    mismatch: float = 0.0
    innovation: float = 1.0
    since: float | None = None
    isolation: Isolation | None = None
    delays: dict[str, DelayNow] = field(default_factory=dict)


class Twin:
    """A model beside its machine.

    Parameters
    ----------
    model : the identified model, with its delays.
    settings : the meaning of the signals, and the allowed false-alarm rate.
    forced : whether the forcing is measured; otherwise the model's own drives act.
    calibration : from an earlier run of the twin; with None, the first `settings.healthy` seconds are taken for healthy.
    released : whether the release times of commands are given as well.
    """

    def __init__(
        self,
        model: Model,
        settings: Settings,
        forced: bool = True,
        calibration: Calibration | None = None,
        catalogue: Catalogue | None = None,
        released: bool = False,
    ) -> None:
        self.model = without_own_forcing(model) if forced else model
        self.settings, self.calibration = settings, calibration
        self.samples: dict[Role, Samples] = {"input": Samples(), "output": Samples()}
        if forced:
            self.samples["forcing"] = Samples()
        self._measured = WithoutOutliers(keep=settings.output_kind == "acceleration")
        self._released = Released(_delay(self.model, DELAYS[0])) if released else None
        self._catalogue = load_catalogue() if catalogue is None else catalogue
        self._taken = 0  # measurements of the buffer that have been judged
        self._observer: Observer | None = None
        self._since: float | None = None
        self._below: float | None = None
        self._after = 0  # segments since the mismatch was detected
        if calibration is not None:
            self._engage(calibration)

    def push(self, role: Role, time: Array, value: Array) -> None:
        """Add samples of one signal: times [s] (n,), increasing, on one clock for all signals, and values (n,)."""
        into = self.samples.get(role)
        if self._released is not None and role in ("input", "released"):
            into = self._released.given if role == "input" else self._released.released
        if role == "output":
            into = self._measured.given
        if into is not None:
            into.append(np.asarray(time, dtype=float), np.asarray(value, dtype=float))

    def advance(self) -> list[Status]:
        """Judge all segments whose signals are complete; a status for each.

        Raises InputError when the healthy stretch is over and shows no motion, or a motion that the model does not reproduce.
        """
        output = self.samples["output"]
        output.append(*self._measured.take())
        if self._released is not None:
            self.samples["input"].append(*self._released.take(output.newest - PATIENCE))
        if self.calibration is None:
            if not len(output) or output.newest - output.time[0] < self.settings.healthy + PATIENCE:
                return [Status(output.newest, "learning")] if len(output) else []
            self._learn()
        calibration = self.calibration
        assert calibration is not None
        said = []
        size = calibration.filter.samples
        while self._taken + size <= len(output) and self._complete(
            float(output.time[self._taken + size - 1])
        ):
            status = self._judge(calibration, self._taken, self._taken + size)
            self._taken += size
            if status is not None:
                said.append(status)
        self._forget()
        return said

    @property
    def refused(self) -> int:
        """Samples left out, not finite or not newer than the one before."""
        return self._measured.given.refused + sum(one.refused for one in self.samples.values())

    @property
    def outliers(self) -> int:
        """Measurements left out because they stand far off their neighbours."""
        return self._measured.left_out

    def _complete(self, time: float) -> bool:
        """Whether all signals up to a time are known, or silent, and so are the later measurements that determine lateness."""
        newest = self.samples["output"].newest
        return newest >= time + LOOK and all(
            one.newest >= time or newest >= time + PATIENCE
            for role, one in self.samples.items()
            if role != "output"
        )

    def _learn(self) -> None:
        output = self.samples["output"]
        end = int(np.searchsorted(output.time, output.time[0] + self.settings.healthy))
        stretch = Samples()
        stretch.append(output.time[:end], output.value[:end])
        self.calibration = calibrate(
            self.model,
            self._catalogue,
            self.settings,
            stretch,
            self.samples["input"],
            self.samples.get("forcing"),
        )
        self._engage(self.calibration)
        self._taken = max(0, end - self.calibration.filter.samples)

    def _engage(self, calibration: Calibration) -> None:
        simulation = Simulation(calibration.model, calibration.changes, self.settings, calibration.period)
        self._observer = Observer(simulation, calibration.filter, calibration.sizes)
        self._whitener = Whitener(calibration.noise, len(calibration.changes))
        longest = max(one.segments for one in calibration.healthy.thresholds)
        self._scores: deque[Score] = deque(maxlen=longest)
        self._settling = longest  # segments until the filter's initial state is forgotten

    def _doubt(self, first: int, end: int, period: float) -> Doubt:
        """Uncertainty of a segment's times."""
        stamps = self.samples["output"].time
        since = max(0, int(np.searchsorted(stamps, stamps[first] - LOOK)) - 1)
        until = int(np.searchsorted(stamps, stamps[end - 1] + LOOK, side="right"))
        near = stamps[since:until]
        return Doubt.of(near, possible_lateness(near, period), first - since, end - since)

    def _judge(self, calibration: Calibration, first: int, end: int) -> Status | None:
        """Judge the measurements from `first` to before `end`."""
        assert self._observer is not None
        output = self.samples["output"]
        time, value = output.time[first:end], output.value[first:end]
        doubt = self._doubt(first, end, calibration.period)
        found = self._observer.take(time, value, doubt, self.samples["input"], self.samples.get("forcing"))
        if found is None:
            self._settling = self._scores.maxlen or 1
            return None
        if not doubt.punctual:
            level = "late" if self._since is None else self._lasting(float(time[-1]))
            return Status(float(time[-1]), level, since=self._since)
        score = self._whitener(found)
        if self._settling:
            self._settling -= 1
            return Status(float(time[-1]), "learning")
        self._scores.append(score)
        sums = [(self._last(one.segments), one) for one in calibration.healthy.thresholds]
        if len(self._scores) < sums[-1][1].segments:
            return Status(float(time[-1]), "ok")
        return self._say(calibration, float(time[-1]), sums)

    def _last(self, segments: int) -> Score:
        """Score of the last segments."""
        scores = list(self._scores)[-segments:]
        return sum(scores[1:], scores[0])

    def _say(self, calibration: Calibration, now: float, sums: list[tuple[Score, Threshold]]) -> Status:
        """Status from the scores of all windows, the shortest window first."""
        healthy, (shortest, fast), (longest, slow) = calibration.healthy, sums[0], sums[-1]
        mismatch = max(healthy.mismatch(total, one) for total, one in sums)
        level = self._level(now, mismatch)
        where = None
        excess = slow.score_excess
        if level != "ok":
            longest = self._last(self._since_onset(fast.segments, slow.segments))
            where = isolate(longest, healthy, calibration.changes, excess)
            excess = where.excess
            self._after += 1
        values = [_delay(calibration.model, name) for name in DELAYS]
        beside = None if where is None or not where.changes else where.changes[0].name
        delays = delays_now(longest, healthy, calibration.changes, values, beside, excess)
        squares = shortest.squares / max(shortest.count * fast.squares_mean, 1e-300)
        return Status(now, level, mismatch, float(np.sqrt(squares)), self._since, where, delays)

    def _since_onset(self, fast: int, slow: int) -> int:
        """Number of segments since the mismatch was detected; later on without the transient of the short window."""
        settled = self._after - fast
        return min(settled if settled >= fast else max(self._after, 1), slow)

    def _level(self, now: float, mismatch: float) -> Level:
        """Level after a test; a mismatch ends when it has been below its threshold for `CONFIRMED` seconds."""
        if mismatch >= 1.0:
            if self._since is None:
                self._since, self._after = now, 0
            self._below = None
        elif self._since is not None:
            self._below = now if self._below is None else self._below
            if now - self._below >= CONFIRMED:
                self._since = self._below = None
        return "ok" if self._since is None else self._lasting(now)

    def _lasting(self, now: float) -> Level:
        """Level of a mismatch by its duration."""
        assert self._since is not None
        return "error" if now - self._since >= CONFIRMED else "warn"

    def _forget(self) -> None:
        """Drop samples that no later segment needs."""
        output = self.samples["output"]
        if self._observer is None or self._taken == 0 or self._observer.start is None:
            return
        simulation = self._observer.simulation
        keep = min(self._observer.start.time, float(output.time[self._taken - 1]))
        keep -= simulation.longest_delay + PATIENCE
        first = max(0, int(np.searchsorted(output.time, output.time[self._taken - 1] - LOOK)) - 2)
        output.time, output.value = output.time[first:], output.value[first:]
        self._taken -= first
        for role, one in self.samples.items():
            if role != "output":
                one.forget(keep, keep=8)


def _delay(model: Model, name: str) -> float:
    return model.value(name) if name in model.parameters else 0.0
