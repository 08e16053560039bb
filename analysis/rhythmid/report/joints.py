"""The report of a machine of several joints: the robot with its faulty joints, a table for all joints, and for each joint what was measured
and predicted."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rhythmid.diagnose.joints.joint_answer import BASE
from rhythmid.diagnose.joints.misfit import left_in_words
from rhythmid.report.blocks import (
    Block,
    Bullets,
    Drawing,
    Equation,
    Fold,
    Paragraph,
    Section,
    Table,
    Tiles,
    drawing,
)
from rhythmid.report.chart import Chart, Curve
from rhythmid.report.page import Page, Tone
from rhythmid.report.quantity import (
    NONE,
    estimate,
    percent,
    plain,
    pretty_name,
    pretty_unit,
    probability,
    sentence,
)
from rhythmid.report.robot_figure import DrawnJoint, robot_svg
from rhythmid.report.sections import reproduce_section

Array = NDArray[np.float64]
VERDICTS: dict[str, tuple[str, Tone]] = {
    "consistent": ("Nothing is missing", "good"),
    "missing_physics": ("Missing physics", "found"),
    "unknown_physics": ("Something unknown is missing", "open"),
    "undecided": ("Undecided", "open"),
}
SHOWN = 3.0  # [s] of a record that are drawn


@dataclass(frozen=True, eq=False)
class JointCurves:
    """A joint's effort over time (n,) [s], in `unit`: as measured, as the refitted nominal path predicts it, and with the named effects."""

    time: Array
    measured: Array
    nominal: Array
    augmented: Array
    unit: str


def joints_page(
    result: Mapping[str, Any], source: str, robot: Sequence[DrawnJoint], curves: Mapping[str, JointCurves],
    command: str, models: Mapping[str, str],
) -> Page:  # fmt: skip
    """The report of a diagnosis of several joints; `result` is what `--json` writes."""
    verdict, tone = VERDICTS[result["verdict"]]
    named = ", ".join(f"{pretty_name(one['element'])}{_at(one)}" for one in result["missing"])
    if named:
        verdict = f"{verdict}: {named}"
    return Page(
        title=f"rhythmid diagnosis: {verdict}",
        kicker=f"Diagnosis of {source}",
        verdict=verdict,
        words=plain(str(result["summary"])),
        tone=tone,
        tiles=Tiles(()),
        sections=(
            Section("Where", (_robot(robot), _table(result))),
            *(
                [Section("What is missing", (*_missing(result), *_families(result)))]
                if result["missing"] or result["families"]
                else []
            ),
            Section("Measured and predicted", tuple(_efforts(result, curves))),
            Section("The next experiment", (Paragraph(sentence(plain(result["next_experiment"])), "lead"),)),
            *_remarks(result),
            reproduce_section(command, models),
        ),
    )


def _place(effect: Mapping[str, Any]) -> str:
    return str(effect["joint"] or BASE)


def _at(effect: Mapping[str, Any]) -> str:
    return f" at {effect['joint']}" if effect["joint"] else ""


def _robot(robot: Sequence[DrawnJoint]) -> Block:
    faulty = [f"{one.name} ({one.fault})" for one in robot if one.fault]
    alt = f"The robot's joints; marked: {', '.join(faulty) or 'none'}"
    words = "Circles are revolute joints, squares prismatic ones. Red: physics is missing there; ! if it has a name, ? if not."
    return Drawing("The robot", robot_svg(robot, alt), words, wide=True)


def _table(result: Mapping[str, Any]) -> Table:
    rows, marked = [], []
    for place, (joint, one) in enumerate(result["joints"].items()):
        missing = [pretty_name(m["element"]) for m in result["missing"] if m["joint"] == joint]
        errors = [one["fit"][name]["heldout_nrmse"] for name in ("refitted_nominal", "augmented")]
        rest = one["remainder"]
        left = left_in_words(one["verdict"], rest["share"], rest["significant"], errors[1])
        left = left.replace(" %", "\u202f%")
        shown = [NONE if error is None else percent(error) for error in errors]
        rows.append((joint, one["verdict"].replace("_", " "), ", ".join(missing) or NONE, *shown, left))
        if one["verdict"] != "consistent":
            marked.append(place)
    for joint, why in result["not_judged"].items():
        rows.append((joint, "not judged", why, NONE, NONE, NONE))
    columns = ("joint", "verdict", "missing", "error, nominal", "error, augmented", "left")
    caption = "All joints; errors of the effort on data that no fit has seen, as a share of it"
    return Table(caption, columns, tuple(rows), tuple(marked))


def _missing(result: Mapping[str, Any]) -> list[Block]:
    blocks: list[Block] = []
    for one in result["missing"]:
        where = f"{_place(one)}, slot {one['slot']}: {pretty_name(one['element'])}"
        whose = "the joint's" if one["joint"] else "a joint's"
        blocks.append(
            Paragraph(
                f"{where}. It explains {percent(one['share'])} of {whose} mismatch; the probability of the name is "
                f"{probability(one['probability'])}."
            )
        )
        blocks.append(Equation(one["equation"]))
        rows = []
        for name, value in one["parameters"].items():
            rows.append((name, estimate(value["value"], value["std"], value["unit"])))
        blocks.append(
            Table(f"Parameters at {_place(one)}, with 95 % intervals.", ("parameter", "value"), tuple(rows))
        )
    return blocks


def _families(result: Mapping[str, Any]) -> list[Block]:
    """At each joint the kinds of physics that are missing, whose laws share their evidence."""
    rows = [
        (
            joint,
            str(one["family"]),
            probability(one["probability"]),
            percent(one["share"]),
            ", ".join(map(pretty_name, one["laws"])),
        )
        for joint, families in result["families"].items()
        for one in families
    ]
    if not rows:
        return []
    caption = (
        "Laws of one family share their evidence, so that the family may be certain where the law is not."
    )
    columns = ("joint", "family", "probability of a law of it", "share of the mismatch", "laws that are open")
    return [Table(caption, columns, tuple(rows))]


def _efforts(result: Mapping[str, Any], curves: Mapping[str, JointCurves]) -> list[Block]:
    blocks: list[Block] = []
    for joint, one in curves.items():
        part = one.time <= one.time[0] + SHOWN
        time = one.time[part]
        chart = Chart(
            f"Effort at {joint} over time, measured and predicted",
            "time [s]",
            f"effort [{pretty_unit(one.unit)}]",
            (
                Curve(time, one.measured[part], "measured", "measured"),
                Curve(time, one.nominal[part], "nominal", "before", dashed=True),
                Curve(time, one.augmented[part], "with the named effects", "after"),
            ),
        )
        shown = drawing(
            joint, chart, "All are filtered as for the evidence. Nominal: the joint's path, refitted. Straight lines bridge samples that are left out, such as those in contact.",
        )  # fmt: skip
        faulty = result["joints"][joint]["verdict"] != "consistent"
        blocks.append(shown if faulty else Fold(f"{joint}: consistent", (shown,)))
    return blocks


def _remarks(result: Mapping[str, Any]) -> list[Section]:
    lines = [*result["assumptions"], *result["notes"]]
    return [Section("Assumptions and notes", (Bullets(tuple(map(sentence, lines))),))] if lines else []
