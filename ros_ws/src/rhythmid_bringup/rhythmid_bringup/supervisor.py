"""Supervises the graph of an experiment: start, wait until ready, excite, monitor, stop."""

from __future__ import annotations

import json
import signal
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import rclpy
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import try_shutdown
from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from rhythmid.body.joint_experiment import JointExperiment
from rhythmid.experiment import Delay, Experiment
from rhythmid_nodes.lifecycle import ACTIVE

from .arguments import command, compose_command, replacement_command, ros_arguments
from .liveness import SILENT_AFTER, Liveness, Relay
from .observer import Observer
from .processes import Supervised, end

READY_WITHIN = 180.0  # seconds; importing ROS and compiling the model take most of it on a busy machine
TELL_WAITING = 20.0  # seconds between two lines on what a run without a terminal waits for; nodes on a busy machine are ready before
STALLED_AFTER = 30.0  # seconds
FIGURES_WITHIN = 2.0  # seconds; every node reports its figures once a second
GRAPH = "graph"  # the process that holds all nodes of a composed layout
POST_ROLL = 0.25  # seconds recorded in real time after the latest possible arrival of the last response


@dataclass(frozen=True)
class Outcome:
    """How a run ended: exit code and one sentence."""

    code: int
    sentence: str


@dataclass
class Observed:
    """What the supervisor observed: the figures of every node, the last content of `run`, simulated or real seconds played, and the
    time that this took."""

    run: dict[str, Any] = field(default_factory=dict)
    figures: dict[str, dict[str, str]] = field(default_factory=dict)
    played: float = 0.0
    elapsed: float = 0.0


class Supervisor:
    """One run of the graph. `interrupted()` returns whether the user wants it to stop; `replaced` gives for the name of a node the
    command that runs in its place."""

    def __init__(
        self,
        experiment: Experiment | JointExperiment,
        folder: Path,
        environment: dict[str, str],
        console: Console,
        interrupted: Callable[[], bool],
        replaced: Mapping[str, Sequence[str]] | None = None,
    ) -> None:
        self._replaced = replaced or {}
        self.observed = Observed()
        self._experiment, self._folder, self._environment = experiment, folder, environment
        self._console, self._interrupted = console, interrupted
        self._processes: list[Supervised] = []
        self._began = self._closing = False
        self.waited_for = ""  # by whom and for what, until the excitation plays
        self._lockstep = experiment.time.mode == "lockstep"
        self._length = experiment.count * experiment.time.period_ns * 1e-9
        self._nodes = [spec.name for spec in experiment.nodes() if spec.name not in self._replaced]
        self._liveness = Liveness(
            {
                "command_delay": Relay("excitation", "sent", longest(experiment.input_delay)),
                "measurement_delay": Relay("plant", "samples", longest(experiment.measurement_delay)),
            }
        )
        self._streams = any(topic not in ("run", "diagnostics") for topic in experiment.record.topics)

    def run(self) -> Outcome:
        """Run to the end, and end all processes in any case."""
        rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
        observer = Observer(self._experiment.namespace)
        self._executor = EventsExecutor()
        self._executor.add_node(observer)
        try:
            self._launch()
            outcome = self._wait_until_ready(observer) or self._play(observer)
            silent = self._tell_outcome(observer, outcome)
            if outcome.code == 1 and silent:
                told = f"nothing was heard from {', '.join(silent)} for {FIGURES_WITHIN:g} s"
                outcome = Outcome(1, f"{outcome.sentence}; {told}")
            self._closing = True
            end([process for process in self._processes if process.name != "recorder"], self._listen)
            end(self._processes, self._listen)  # the recorder still receives the last messages of the others
            for process in self._processes:
                process.join_output()
            outcome = self._with_refusal(outcome)
            self.observed.figures, self.observed.run = observer.figures, observer.run
        finally:
            for process in self._processes:
                process.signal(signal.SIGKILL)
            self._executor.shutdown()
            observer.destroy_node()
            try_shutdown()
        return outcome

    def _listen(self) -> None:
        self._executor.spin_once(timeout_sec=0.05)

    def _tell(self, name: str, line: str) -> None:
        if (self._interrupted() or self._closing) and not self._began:
            return  # a node that is ended while it loads has only a traceback to say
        self._console.print(f"[dim]{escape(f'[{name}]')}[/] {escape(line)}")

    def _launch(self) -> None:
        everything = self._experiment.nodes()
        specs = [spec for spec in everything if spec.name not in self._replaced]
        arguments = [
            ros_arguments(
                spec, self._experiment.namespace, self._folder, {"autostart": spec.name != "excitation"}
            )
            for spec in specs
        ]
        if self._experiment.time.layout == "composed":
            graph = self._folder / f"{GRAPH}.json"
            listed = [
                {"executable": spec.executable, "arguments": given} for spec, given in zip(specs, arguments)
            ]
            graph.write_text(json.dumps(listed), encoding="utf-8")
            lines = {GRAPH: compose_command(graph)}
        else:
            lines = {spec.name: command(spec, given) for spec, given in zip(specs, arguments)}
        for spec in everything:
            if spec.name in self._replaced:
                given = self._replaced[spec.name]
                lines[spec.name] = replacement_command(spec, self._experiment.namespace, given)
        for name, line in lines.items():
            self._processes.append(Supervised(name, line, self._environment, self._tell))
            if not self._lockstep:
                self._processes[-1].hurry()

    def _trouble(self, observer: Observer) -> Outcome | None:
        """A node that has ended or stopped early, or the user's wish to stop."""
        dead = next((process for process in self._processes if process.returncode is not None), None)
        if dead is not None:
            dead.join_output()
            self._listen()  # it may have reported the reason
            return _cause(observer) or _death(dead)
        return Outcome(0, "stopped by the user") if self._interrupted() else None

    def _with_refusal(self, outcome: Outcome) -> Outcome:
        """The outcome, led by what a node refused or could not write: its end may have stopped another node before it was noticed itself."""
        refused = next((process.refusal for process in self._processes if process.refusal), "")
        if not refused or not self._began:
            return outcome
        return Outcome(1, refused if refused in outcome.sentence else f"{refused}; {outcome.sentence}")

    def _stopped_working(self, observer: Observer) -> Outcome | None:
        """A node that is alive but does not work. A silent one is killed, so that it cannot act after the run."""
        heard = {name: count for name, count in observer.heard.items() if name in self._nodes}
        silent = self._liveness.silent(time.monotonic(), heard)
        for process in self._processes:
            if process.name in silent or (silent and process.name == GRAPH):
                process.signal(signal.SIGKILL)
        if silent:
            said = f"nothing was heard from {', '.join(silent)} for {SILENT_AFTER:g} s: stopped working"
        else:
            said = self._liveness.stalled(observer.figures)
        return Outcome(1, said) if said else None

    def _bring_up_excitation(self, observer: Observer) -> None:
        """Configure and activate the excitation, once all others are active, the recorder among them."""
        if all(observer.lifecycle(name) == ACTIVE for name in self._nodes if name != "excitation"):
            observer.excitation.advance(observer.lifecycle("excitation"))

    def _wait_until_ready(self, observer: Observer) -> Outcome | None:
        """Wait until every node is ready and the excitation has started; returns the reason if this fails."""
        patience = time.monotonic() + READY_WITHIN
        tell_at = time.monotonic() + TELL_WAITING
        refusal: str | None = None
        with self._console.status("waiting for the nodes") as status:
            while not observer.state:
                self.waited_for = missing = self._missing(observer, refusal)
                if trouble := self._trouble(observer):
                    return trouble
                self._bring_up_excitation(observer)
                heard = all(name in observer.obstacles for name in self._nodes)
                if heard and not any(observer.obstacles.values()):
                    refusal = observer.ask_start() or refusal
                if time.monotonic() > patience:
                    return Outcome(1, f"not ready after {READY_WITHIN:g} s: {missing}")
                status.update(f"waiting for {missing}")
                if not self._console.is_terminal and time.monotonic() > tell_at:
                    tell_at += TELL_WAITING
                    self._console.print(f"waiting for {escape(missing)}")
                self._listen()
        return None

    def _missing(self, observer: Observer, refusal: str | None) -> str:
        """Which nodes are not ready and why; else the `refusal` of the start."""
        silent = [f"{name}: not up yet" for name in self._nodes if name not in observer.obstacles]
        waiting = [f"{name}: {why}" for name, why in observer.obstacles.items() if why]
        missing = "; ".join([*silent, *waiting]) or refusal or "the start"
        if self._replaced:
            missing += f" (in the place of {', '.join(self._replaced)} a command of yours runs)"
        return missing

    def _play(self, observer: Observer) -> Outcome:
        """Wait for the end of the run, the end of a node, or an interruption by the user."""
        self._began = True
        started = time.monotonic()
        columns = (
            TextColumn("{task.description}"),
            BarColumn(),
            TextColumn("{task.completed:.1f} of {task.total:.1f} s"),
        )
        with Progress(
            *columns, TimeElapsedColumn(), TimeRemainingColumn(), console=self._console
        ) as progress:
            bar = progress.add_task(self._experiment.time.mode, total=self._length)
            outcome, moved = None, 0.0
            while outcome is None:
                self._listen()
                now = time.monotonic() - started
                played = observer.acknowledged_ns * 1e-9 if self._lockstep and self._streams else now
                if played > self.observed.played:
                    moved = now
                self.observed.elapsed, self.observed.played = now, min(played, self._length)
                progress.update(bar, completed=self.observed.played)
                outcome = self._trouble(observer) or self._stopped_working(observer) or self._ending(observer)
                if outcome is None and now - moved > STALLED_AFTER:
                    outcome = Outcome(1, f"nothing has moved for {STALLED_AFTER:g} s")
        self._fade_out(observer)
        return outcome

    def _ending(self, observer: Observer) -> Outcome | None:
        """How the run ended by itself, if it has."""
        if observer.state not in ("finished", "stopped"):
            return None
        if self._lockstep:
            if (
                "excitation" not in observer.tripped
                and self._streams
                and observer.acknowledged_ns < self._experiment.count * self._experiment.time.period_ns
            ):
                return None
        else:
            self._record_tail()
        if observer.state == "finished":
            return Outcome(0, "finished")
        if cause := _cause(observer):
            return cause
        reason = observer.run.get("reason", "")
        return Outcome(0 if reason == "asked to stop" else 1, f"excitation stopped: {reason}")

    def _record_tail(self) -> None:
        """Continue to record until the last response has passed both delays."""
        until = time.monotonic() + longest(self._experiment.input_delay) + POST_ROLL
        until += longest(self._experiment.measurement_delay)
        while time.monotonic() < until:
            self._listen()

    def _fade_out(self, observer: Observer) -> None:
        """Let the excitation fade out, if it still plays, before the graph is stopped."""
        if self._lockstep or observer.state != "running":
            return
        observer.excitation.deactivate()
        patience = time.monotonic() + self._experiment.safety.ramp + 1.0
        while observer.state == "running" and time.monotonic() < patience:
            self._listen()
        self._record_tail()

    def _tell_outcome(self, observer: Observer, outcome: Outcome) -> list[str]:
        """Record in the bag how the run ended and how punctual it was (there is no lateness in simulated time). Returns the nodes that
        did not report."""
        if not observer.run:
            return []
        silent: list[str] = []
        if not self._lockstep:
            before = {name: count for name, count in observer.heard.items() if name in self._nodes}
            patience = time.monotonic() + FIGURES_WITHIN
            while (silent := [name for name in before if observer.heard[name] == before[name]]) and (
                time.monotonic() < patience
            ):
                self._listen()
        observer.tell_outcome(outcome.sentence if outcome.code == 1 else "", punctual=not self._lockstep)
        return silent


def _cause(observer: Observer) -> Outcome | None:
    """The node that stopped early; a stop of the excitation may only be a consequence of another node's stop."""
    for name, reason in observer.tripped.items():
        if name != "excitation":
            return Outcome(1, f"{name} stopped: {reason}")
    return None


def _death(process: Supervised) -> Outcome:
    code = process.returncode
    assert code is not None
    if code == 2 and process.refusal:
        return Outcome(2, process.refusal)
    how = f"was killed by {signal.Signals(-code).name}" if code < 0 else f"ended with exit code {code}"
    return Outcome(1, f"{process.name} {how}")


def longest(delay: Delay) -> float:
    """The longest delay [s] of a constant or a profile."""
    return float(delay.table()[1].max())
