"""The report of an identified machine of several joints: the robot, a table of all joints, and for each joint its estimates, its effort as
measured and as predicted, its residual over frequency, and the correlation of the estimates."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.signal import welch

from rhythmid.body.body import BODY
from rhythmid.body.inertial_parameter import ARMATURE
from rhythmid.report.blocks import (
    Block,
    Bullets,
    Columns,
    Drawing,
    Fold,
    Paragraph,
    Section,
    Table,
    Tile,
    Tiles,
    drawing,
)
from rhythmid.report.chart import Chart, Curve
from rhythmid.report.correlation import Correlation, correlation_figure
from rhythmid.report.page import Page
from rhythmid.report.quantity import NONE, number, percent, pretty_name, pretty_unit, rounded, sentence
from rhythmid.report.robot_figure import DrawnJoint, robot_svg
from rhythmid.report.sections import reproduce_section

Array = NDArray[np.float64]
SHOWN = 3.0  # [s] of a record that are drawn
SEGMENTS = 4  # of a stretch whose spectrum is taken, at least
BRIDGED = 10.0  # samples of a gap in it, at most
FEWEST = 64  # samples of a stretch that has a spectrum
WORDS = "Circles are revolute joints, squares prismatic ones. At red joints the values are not to be used."


@dataclass(frozen=True, eq=False)
class IdentifiedEffort:
    """A joint's effort over time (n,) [s] in one stretch, in `unit`: as measured, as the given path predicts it and as the identified one does."""

    time: Array
    measured: Array
    given: Array
    identified: Array
    unit: str


def joint_identification_page(
    result: Mapping[str, Any], source: str, robot: Sequence[DrawnJoint], efforts: Mapping[str, IdentifiedEffort],
    command: str, models: Mapping[str, str],
) -> Page:  # fmt: skip
    """The report of `identify` for several joints; `result` is what `--json` writes."""
    poor = result["quality"]["not_identified"]
    worst = max(result["quality"]["effort_nrmse"].items(), key=lambda one: one[1])
    verdict = f"Not identified: {', '.join(poor)}" if poor else f"{len(result['parameters'])} parameters identified"  # fmt: skip
    words = (
        "The identified values miss too much of the effort and of the motion of these joints, so none of their values can be used."
        if poor
        else f"The identified machine misses {percent(worst[1])} of the effort at most, at {worst[0]}."
    )
    return Page(
        title=f"rhythmid identification: {verdict}",
        kicker=f"Identification of {source}",
        verdict=verdict,
        words=words,
        tone="open" if poor or result["quality"]["worse"] else "good",
        tiles=_tiles(result),
        sections=(
            Section("The joints", (_robot(robot), _table(result))),
            Section("Each joint", tuple(_joint(result, joint, efforts.get(joint)) for joint in result["quality"]["effort_nrmse"])),
            *_links(result),
            *_remarks(result),
            reproduce_section(command, models),
        ),
    )  # fmt: skip


def _tiles(result: Mapping[str, Any]) -> Tiles:
    quality, inertia = result["quality"], result["inertia"]
    found = [Tile("parameters", str(len(result["parameters"])), f"of {len(quality['effort_nrmse'])} joints")]
    run = quality["free_run"].get("identified")
    if run:
        worst = max(run, key=lambda joint: run[joint])
        found.append(Tile("motion missed, at most", percent(run[worst]), f"at {worst}, free run, held out"))
    if inertia is not None:
        told = f"of {inertia['count']} of the links are seen"
        found.append(Tile("inertial combinations", str(inertia["rank"]), told))
    return Tiles(tuple(found))


def _robot(robot: Sequence[DrawnJoint]) -> Drawing:
    faulty = [f"{one.name} ({one.fault})" for one in robot if one.fault]
    alt = f"The robot's joints; marked: {', '.join(faulty) or 'none'}"
    return Drawing("The robot", robot_svg(robot, alt), WORDS, wide=True)


def _table(result: Mapping[str, Any]) -> Table:
    quality = result["quality"]
    runs, rows, marked = quality["free_run"], [], []
    for place, (joint, error) in enumerate(quality["effort_nrmse"].items()):
        moved = [percent(runs[name][joint]) if name in runs else NONE for name in ("given", "identified")]
        count = len(_own(result["parameters"], joint))
        rows.append((joint, str(count), percent(error), *moved))
        if joint in (*quality["not_identified"], *quality["worse"]):
            marked.append(place)
    columns = ("joint", "parameters", "effort", "motion, given", "motion, fitted")
    caption = "All joints: shares that are missed, of the effort by the fit, of the motion by free runs with the given and the fitted values over data that no fit has seen"
    return Table(caption, columns, tuple(rows), tuple(marked))


def _own(names: Mapping[str, Any] | Sequence[str], joint: str) -> list[str]:
    """Those of the names that belong to a joint."""
    rotor = f"{BODY}.{joint}.{ARMATURE}"
    return [name for name in names if name.startswith(f"{joint}.") or name == rotor]


def _short(name: str, joint: str) -> str:
    return name.removeprefix(f"{BODY}.").removeprefix(f"{joint}.")


def _joint(result: Mapping[str, Any], joint: str, effort: IdentifiedEffort | None) -> Block:
    quality = result["quality"]
    own = {_short(n, joint): result["parameters"][n] for n in _own(result["parameters"], joint)}
    blocks: list[Block] = []
    if own:
        rows = tuple(
            (pretty_name(name), rounded(v["value"], v["std"]), number(v["std"], 2), pretty_unit(v["unit"]))
            for name, v in own.items()
        )
        blocks.append(
            Table(f"Parameters of {joint}", ("parameter", "value", "standard deviation", "unit"), rows)
        )
    if effort is not None:
        blocks += _effort(joint, effort)
    names = result["correlations"]["names"]
    mine = [name for name in _own(names, joint) if _short(name, joint) in own]
    if len(mine) > 1:
        at = [names.index(name) for name in mine]
        matrix = np.array(result["correlations"]["matrix"], dtype=float)[np.ix_(at, at)]
        blocks.append(correlation_figure(Correlation(tuple(_short(name, joint) for name in mine), matrix)))
    marked = joint in (*quality["not_identified"], *quality["worse"])
    summary = f"{joint}: {percent(quality['effort_nrmse'][joint])} of the effort is missed"
    return Fold(summary, tuple(blocks), marked or len(quality["effort_nrmse"]) <= 2)


def _effort(joint: str, one: IdentifiedEffort) -> list[Block]:
    part = one.time <= one.time[0] + SHOWN
    time, unit = one.time[part], pretty_unit(one.unit)
    over_time = Chart(
        f"Effort at {joint} over time, measured and predicted", "time [s]", f"effort [{unit}]",
        (
            Curve(time, one.measured[part], "measured", "measured"),
            Curve(time, one.given[part], "as given", "before", dashed=True),
            Curve(time, one.identified[part], "identified", "after"),
        ),
    )  # fmt: skip
    blocks: list[Block] = [
        drawing(
            f"Effort at {joint}",
            over_time,
            "All are filtered as for the fit. As given: the path and the body before the fit.",
        )
    ]
    figures: list[Block] = [_against(joint, one, unit)]
    if (spectrum := _spectrum(joint, one, unit)) is not None:
        figures.append(spectrum)
    return [*blocks, Columns(tuple(figures))]


def _against(joint: str, one: IdentifiedEffort, unit: str) -> Drawing:
    """Measured over predicted effort: a right model's points lie along the diagonal."""
    part = one.time <= one.time[0] + SHOWN
    ends = np.array([one.identified[part].min(), one.identified[part].max()])
    chart = Chart(
        f"Measured effort at {joint} against the predicted one", f"predicted [{unit}]", f"measured [{unit}]",
        (
            Curve(one.identified[part], one.measured[part], "measured", "after"),
            Curve(ends, ends, "equal", "measured", dashed=True),
        ),
        path=True,
    )  # fmt: skip
    return drawing(
        f"Measured against predicted at {joint}",
        chart,
        "What lies beside the diagonal is missed: a loop is late or early, a step is friction.",
    )


def _spectrum(joint: str, one: IdentifiedEffort, unit: str) -> Drawing | None:
    """Amplitude density of the effort and of its residual, over the longest stretch without a long gap; P. D. Welch, IEEE Trans. Audio
    Electroacoust. 15 (1967) 70. The samples at rest that a fit leaves out are bridged by straight lines."""
    steps = np.diff(one.time)
    period = float(np.median(steps))
    breaks = np.flatnonzero(steps > BRIDGED * period) + 1
    bounds = [0, *breaks.tolist(), len(one.time)]
    begin, end = max(zip(bounds, bounds[1:]), key=lambda pair: pair[1] - pair[0])
    grid = np.arange(one.time[begin], one.time[end - 1], period)
    if len(grid) < FEWEST:
        return None
    length = max(FEWEST, len(grid) // SEGMENTS)

    def density(values: Array) -> tuple[Array, Array]:
        frequency, power = welch(np.interp(grid, one.time, values), 1.0 / period, nperseg=length)
        return frequency[1:], np.sqrt(power[1:])

    curves = (
        (one.measured, "measured", "measured", False),
        (one.given - one.measured, "left, as given", "before", True),
        (one.identified - one.measured, "left, identified", "after", False),
    )
    chart = Chart(
        f"Amplitude density of the effort at {joint} and of what is left of it", "frequency [Hz]", f"density [{unit}/√Hz]",
        tuple(Curve(*density(values), label, style, dashed) for values, label, style, dashed in curves), y_log=True,
    )  # fmt: skip
    return drawing(
        f"What is left at {joint} over frequency",
        chart,
        "Lines that stand out of what is left are physics that the path lacks; a flat floor is noise.",
    )


def _links(result: Mapping[str, Any]) -> list[Section]:
    inertia = result["inertia"]
    if inertia is None:
        return []
    rows = []
    for link, values in inertia["links"].items():
        mass = values["m"]
        centre = ", ".join(f"{values[name] / mass + 0.0:.4f}" for name in ("mx", "my", "mz"))
        rows.append((link, f"{number(mass, 4)}\u202fkg", f"({centre})\u202fm"))
    caption = (
        "Physically consistent inertias of the links, as close to those of the file as the efforts allow"
    )
    table = Table(caption, ("link", "mass", "centre of mass in its frame"), tuple(rows))
    lead = Paragraph(
        f"The efforts show {inertia['rank']} of {inertia['count']} inertial parameters, or combinations of them; the others are the file's."
    )
    return [Section("The links", (lead, table))]


def _remarks(result: Mapping[str, Any]) -> list[Section]:
    found = []
    if result["not_separable"]:
        found.append(
            Section(
                "What the records do not separate", (Bullets(tuple(map(sentence, result["not_separable"]))),)
            )
        )
    if result["notes"]:
        found.append(Section("Notes", (Bullets(tuple(map(sentence, result["notes"]))),)))
    return found
