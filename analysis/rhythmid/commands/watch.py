"""`rhythmid watch`: a model beside its machine, live or over a bag."""

from importlib.metadata import entry_points
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rhythmid.commands.options import Elements, JsonFile, Quiet, SignalsFile
from rhythmid.commands.terminal import Terminal
from rhythmid.errors import InputError
from rhythmid.output import require_new, write_json
from rhythmid.report.quantity import number
from rhythmid.ros_packages import not_installed

if TYPE_CHECKING:
    from rhythmid.twin.twin import Status
    from rhythmid.twin.watch import Watch

LIVE_GROUP = "rhythmid.live"  # entry points of packages that can connect to a running robot
LIVE = "watching a running machine (a recording is watched with --bag)"
EXAMPLES = (
    "rhythmid watch model.yaml --signals signals.yaml",
    "rhythmid watch model.yaml --bag bag --healthy 120 --json -",
)


def watch(
    model: Annotated[Path, typer.Argument(help="Identified model of the machine, delays included.")],
    bag: Annotated[
        Path | None, typer.Option("--bag", help="Watch a recording instead of the running machine.")
    ] = None,
    signals: SignalsFile = None,
    healthy: Annotated[
        float,
        typer.Option(
            "--healthy",
            metavar="SECONDS",
            help="Length of the first stretch, which is assumed to be healthy operation.",
        ),
    ] = 60.0,
    false_alarms: Annotated[
        float,
        typer.Option(
            "--false-alarms",
            metavar="NUMBER",
            help="False alarms per day that are allowed in healthy operation.",
        ),
    ] = 1.0,
    calibration: Annotated[
        Path | None,
        typer.Option(
            "--calibration",
            help="File that --save-calibration wrote; the healthy stretch is then not needed.",
        ),
    ] = None,
    save_calibration: Annotated[
        Path | None,
        typer.Option("--save-calibration", help="Write what was learnt from the healthy stretch."),
    ] = None,
    diagnose: Annotated[
        bool, typer.Option(help="When a mismatch has lasted for a minute, diagnose that minute.")
    ] = True,
    elements: Elements = None,
    json: JsonFile = None,
    quiet: Quiet = False,
) -> None:
    """Run a model in parallel with its machine and say when, where and by how much the two differ.

    Without --bag it watches the running machine over ROS 2, until Ctrl-C.
    """
    require_new(json, save_calibration)
    if bag is None and quiet:
        raise InputError(
            "--quiet belongs to a recording: give --bag, or leave it out to see the running machine"
        )
    if bag is None:
        raise typer.Exit(
            _live(
                model=model, signals=signals, healthy=healthy, false_alarms=false_alarms, calibration=calibration,
                save_calibration=save_calibration, diagnose=diagnose, elements=tuple(elements or ()), json=json,
            )
        )  # fmt: skip
    from rich.markup import escape

    from rhythmid.elements.catalogue import load_catalogue
    from rhythmid.model import Model
    from rhythmid.record.read import read_record
    from rhythmid.twin.kept import load, save
    from rhythmid.twin.settings import Settings
    from rhythmid.twin.watch import Watch, watch_record

    catalogue = load_catalogue(elements or ())
    machine = Model.of_one_axis(model, catalogue)
    record = read_record(bag, signals)
    settings = Settings.of(record, healthy, false_alarms)
    forced = record.forcing is not None
    known = None if calibration is None else load(calibration, machine, settings, forced, catalogue)
    watching = Watch(machine, settings, forced, known, catalogue, diagnose, tuple(elements or ()))
    console, seen = Terminal(quiet, json).answer, _Told(watching)
    watch_record(record, watching, seen.take)
    if save_calibration is not None and watching.twin.calibration is not None:
        save(watching.twin.calibration, save_calibration)
    watching.close(wait=True)
    result = seen.result(record.name)
    for event in watching.events.found:
        console.print(f"[bold red]mismatch[/] {escape(event.sentence())}")
        if event.diagnosis is not None:
            console.print(f"  diagnosis: {escape(event.diagnosis['summary'])}")
    if not watching.events.found:
        console.print(f"[green]no mismatch[/] in {result['watched']:.0f} s")
    if left_out := result["outliers"]:
        console.print(f"{left_out} samples of the output that stand far off their neighbours are left out")
    console.print(
        f"innovations are {number(100.0 * result['nrmse'], 2)} % of the motion in healthy operation; "
        f"allowed: {false_alarms:g} false {'alarm' if false_alarms == 1.0 else 'alarms'} a day"
    )
    if json is not None:
        write_json(json, result)


class _Told:
    """Result of a twin on a bag: the length of the watch, and its last delays."""

    def __init__(self, watching: "Watch") -> None:
        self._watching = watching
        self._watched = 0.0
        self._last: Status | None = None
        self._before: float | None = None

    def take(self, status: "Status") -> None:
        if status.level != "learning":
            if self._before is not None:
                self._watched += status.time - self._before
            self._before, self._last = status.time, status

    def result(self, name: str) -> dict[str, Any]:
        """Plain data for JSON."""
        calibration = self._watching.twin.calibration
        delays = {} if self._last is None else self._last.delays
        return {
            "record": name,
            "watched": self._watched,
            "level": None if self._last is None else self._last.level,
            "nrmse": None if calibration is None else calibration.nrmse,
            "outliers": self._watching.twin.outliers,
            "events": [event.to_dict() for event in self._watching.events.found],
            "delays": {key: {"value": one.value, "std": one.std, "unit": "s"} for key, one in delays.items()},
        }


def _live(**options: Any) -> int:
    """Watch the running machine with a package that can connect to it; returns the exit code."""
    known = {entry.name: entry for entry in entry_points(group=LIVE_GROUP)}
    if "watch" not in known:
        raise not_installed(LIVE, "rhythmid_bringup")
    try:
        return known["watch"].load()(**options)
    except ModuleNotFoundError as missing:
        raise not_installed(LIVE, str(missing.name)) from None
