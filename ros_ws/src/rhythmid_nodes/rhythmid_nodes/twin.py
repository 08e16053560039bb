"""twin: a model in parallel with its machine. It subscribes to command, forcing and measurement, and reports on /diagnostics when the two differ.

A thin node around `rhythmid.twin`: callbacks only queue, and a separate thread feeds the twin. `twin/state` carries its figures for
plotting, as a JointState whose names are the quantities and whose positions are their values.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.topic_endpoint_info import TopicEndpointInfo
from sensor_msgs.msg import JointState

from rhythmid.elements.catalogue import load_catalogue
from rhythmid.errors import InputError
from rhythmid.model import Model
from rhythmid.output import require_new, write_json
from rhythmid.record.field import Field
from rhythmid.record.signals import Signals, Source
from rhythmid.twin.inbox import Inbox
from rhythmid.twin.kept import load, save
from rhythmid.twin.settings import Settings
from rhythmid.twin.twin import Status
from rhythmid.twin.watch import Watch

from .clock import Clock, Worker
from .diagnostics import status_name
from .joint_state import stamp_of
from .lateness import Lateness
from .node import JOINT, TIME_MODE, GraphNode, run
from .parameters import Parameter
from .qos import AdaptiveSubscription, latched, message_type

_PERIOD = 0.1  # s between two reads of the queue
_RELEASED = "command"  # topic of the commands that the last relay before the machine has released
ENDED, LAST = "mismatches ended", "last mismatch"
"""Keys of the events among the values of the model."""

UNSTAMPED = "without stamps"
"""What follows the topic in the key of a signal whose messages bear none."""

_LATE_NS = 10_000_000  # a message that is older on arrival counts as late
PARAMETERS = (
    TIME_MODE,
    JOINT,
    Parameter("model", "", "model YAML file of the machine, as identified, with its delays"),
    Parameter("elements", None, "folders with further elements that the model names", items=str),
    Parameter("signals", "", "signals.yaml that says which topic is what; not given: excitation, joint_states, forcing"),
    Parameter("healthy", 60.0, "beginning that is taken for healthy operation", "s", (20.0, 86400.0)),
    Parameter("false_alarms", 1.0, "false alarms allowed in a day of healthy operation", "1/day", (1e-3, 1e3)),
    Parameter("calibration", "", "file of what an earlier run has learnt of the healthy machine"),
    Parameter("save_calibration", "", "file to write that to"),
    Parameter("diagnose", True, "diagnose the last minute of a mismatch that lasts for a minute"),
    Parameter("result", "", "JSON file to write the mismatches to at the end"),
    Parameter("hardware_id", "", "name of the machine on /diagnostics; not given: the namespace"),
)  # fmt: skip
_LEVELS = {
    "learning": DiagnosticStatus.OK,
    "late": DiagnosticStatus.OK,
    "ok": DiagnosticStatus.OK,
    "warn": DiagnosticStatus.WARN,
    "error": DiagnosticStatus.ERROR,
}


class _Ear:
    """One topic: its subscription, and the number and lateness of its messages."""

    def __init__(self, node: TwinNode, topic: str) -> None:
        self.count = 0
        self.lateness = Lateness(_LATE_NS)
        self._rate = (time.monotonic(), 0, 0.0)
        self.stamped: bool | None = None  # None before its type is known
        self._node, self._topic = node, topic
        self.subscription = AdaptiveSubscription(node, topic, node.while_active(self._receive), self._found)

    def _found(self, type_name: str, _publishers: Sequence[TopicEndpointInfo]) -> None:
        fields = message_type(type_name).get_fields_and_field_types()
        self.stamped = next(iter(fields.values()), "") == "std_msgs/Header"
        self._node.inbox.learn_type(self._topic, type_name)

    def _receive(self, data: bytes, received_ns: int, sent_ns: int) -> None:
        received_ns = received_ns or self._node.wall.now()
        self.count += 1
        if self.stamped:
            self.lateness.add(max(0, received_ns - stamp_of(data)))
        self._node.inbox.put(self._topic, data, received_ns, sent_ns or received_ns)

    def rate(self) -> float:
        """Messages per second since about a second ago."""
        then, count, rate = self._rate
        now = time.monotonic()
        if now - then >= 1.0:
            rate = (self.count - count) / (now - then)
            self._rate = now, self.count, rate
        return rate


class TwinNode(GraphNode):
    """Feeds a `rhythmid.twin.watch.Watch` and reports its results."""

    def __init__(self, **options: Any) -> None:
        super().__init__("twin", PARAMETERS, **options)

    def configure(self) -> None:
        values = self.values
        if self.lockstep:
            raise InputError("parameter time_mode = 'lockstep': a twin runs beside a machine, in real time")
        self.wall = Clock()
        self.inbox = Inbox(self._signals(), self._released())
        self._catalogue = load_catalogue(tuple(Path(folder) for folder in values["elements"] or ()))
        self._watch = self._build()
        self._status: Status | None = None
        self._told = ("", 0.0)
        self._hardware = values["hardware_id"] or self.get_namespace().strip("/") or "machine"
        self._reports = self.create_publisher(DiagnosticArray, "/diagnostics", latched(1))
        self._figures = self.create_publisher(JointState, "twin/state", 10)
        self._ears = {topic: _Ear(self, topic) for topic in self.inbox.topics}
        self._thread = Worker("twin", self._feed)
        self.workers.append(self._thread)

    def _signals(self) -> Signals:
        if self.values["signals"]:
            return Signals.load(self.values["signals"])
        return Signals.default(self.get_namespace(), self.values["joint"])

    def _released(self) -> Source | None:
        """Of rhythmid's own graph, the commands that the delay injector has released."""
        if self.values["signals"]:
            return None
        field = Field.parse(f"effort[{self.values['joint']}]")
        return Source("N", self.resolve_topic_name(_RELEASED), field)

    def _build(self) -> Watch:
        values = self.values
        if not values["model"]:
            raise InputError("parameter model is missing: name a model YAML file")
        require_new(*(Path(values[name]) for name in ("save_calibration", "result") if values[name]))
        model = Model.of_one_axis(values["model"], self._catalogue)
        signals = self._signals()
        settings = Settings(
            signals.input_kind, signals.output_kind, signals.hold or "zero", values["healthy"], values["false_alarms"]
        )  # fmt: skip
        forced = self.inbox.forced
        known = None
        if values["calibration"]:
            known = load(Path(values["calibration"]), model, settings, forced, self._catalogue)
        folders = tuple(Path(folder) for folder in values["elements"] or ())
        return Watch(
            model,
            settings,
            forced,
            known,
            self._catalogue,
            values["diagnose"],
            folders,
            "released" in self.inbox.channels,
        )

    def figures(self) -> dict[str, str]:
        found: dict[str, str] = {}
        for topic, ear in self._ears.items():
            found[f"{topic} rate [Hz]"] = f"{ear.rate():.1f}"
            found[f"{topic} lost"] = str(ear.subscription.lost)
            if ear.stamped is False:
                found[f"{topic} {UNSTAMPED}"] = "its lateness cannot be seen"
                continue
            for key, value in ear.lateness.summary(f"{topic} lateness").items():
                found[key.replace("_mean_ms", " mean [ms]").replace("_p99_ms", " p99 [ms]").replace("_max_ms", " max [ms]")] = value  # fmt: skip
        twin = self._watch.twin
        return {**found, "samples refused": str(twin.refused), "outliers left out": str(twin.outliers)}

    def obstacles(self) -> list[str]:
        return [
            f"no publisher of {topic}"
            for topic, ear in self._ears.items()
            if not ear.subscription.matched and topic != self.resolve_topic_name(_RELEASED)
        ]

    def finish(self) -> None:
        self._thread.stop()
        self._watch.close()
        calibration = self._watch.twin.calibration
        if self.values["save_calibration"] and calibration is not None:
            save(calibration, Path(self.values["save_calibration"]))
        # a failed watch writes none: its events so far would read as all that there was to see
        if self.values["result"] and self.failure is None:
            write_json(
                Path(self.values["result"]),
                {"events": [event.to_dict() for event in self._watch.events.found]},
            )

    # The twin's own thread

    def _feed(self) -> None:
        while not self._thread.stopping.wait(_PERIOD):
            for role, (times, values) in self.inbox.drain().items():
                self._watch.push(role, times, values)
            said = self._watch.advance()
            for status in said:
                self._plot(status)
            if said:
                self._status = said[-1]
            self._report()

    def _report(self) -> None:
        """Publish the newest status once a second, and a change of level at once."""
        status = self._status
        if status is None:
            return
        now = time.monotonic()
        if status.level == self._told[0] and now - self._told[1] < 1.0:
            return
        self._told = status.level, now
        told = {key: f"{value:.6g}" for key, value in quantities(status).items()} | self._events()
        diagnostic = DiagnosticStatus(
            level=_LEVELS[status.level],
            name=status_name(f"{self.get_fully_qualified_name()}/model"),
            message=self._message(status),
            hardware_id=self._hardware,
            values=[KeyValue(key=key, value=value) for key, value in {**told, **self._diagnosis()}.items()],
        )
        message = DiagnosticArray(status=[diagnostic])
        message.header.stamp = self.get_clock().now().to_msg()
        self._reports.publish(message)

    def _events(self) -> dict[str, str]:
        """The number of mismatches that have ended, and the last of them."""
        ended = [event for event in self._watch.events.found if event.until is not None]
        return {ENDED: str(len(ended)), LAST: ended[-1].sentence()} if ended else {}

    def _diagnosis(self) -> dict[str, str]:
        """Verdict and names of the diagnosis of the present mismatch; empty if there is none."""
        event = self._watch.events.current
        if event is None or event.diagnosis is None:
            return {}
        names = ", ".join(one["element"] for one in event.diagnosis["missing"]) or "none"
        return {"diagnosis": event.diagnosis["verdict"], "diagnosis names": names}

    def _message(self, status: Status) -> str:
        if status.level == "learning":
            return "learning the healthy machine"
        if status.level == "late":
            return "messages come too late to be used"
        event = self._watch.events.current
        if event is None:
            return "the machine does what its model does"
        if status.mismatch < 1.0:
            return f"the machine does what its model does again; it has left it {event.sentence()}"
        return f"the machine has left its model {event.sentence()}"

    def _plot(self, status: Status) -> None:
        found = quantities(status)
        message = JointState(name=list(found), position=list(found.values()))
        stamp_ns = (self.inbox.origin_ns or 0) + round(1e9 * status.time)
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp_ns, 1_000_000_000)
        self._figures.publish(message)


def quantities(status: Status) -> dict[str, float]:
    """A status as numbers, with their units."""
    found = {"mismatch [threshold]": status.mismatch, "innovation rms [1]": status.innovation}
    for name, delay in status.delays.items():
        found[f"delay {name} [s]"] = delay.value
        if delay.std is not None:
            found[f"delay {name} std [s]"] = delay.std
    for slot, share in (status.isolation.share if status.isolation is not None else {}).items():
        found[f"share {slot} [1]"] = share
    return found


def main() -> None:
    run(TwinNode)


if __name__ == "__main__":
    main()
