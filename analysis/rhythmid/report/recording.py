"""The report of a recording: its content, the quality of its timing, and its channels over time."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rhythmid.record.record import Channel, Record
from rhythmid.report.blocks import Block, Bullets, Drawing, Paragraph, Section, Table, Tile, Tiles, drawing
from rhythmid.report.chart import Chart, Curve
from rhythmid.report.page import Page, Tone
from rhythmid.report.quantity import NONE, number, pretty_unit, scaled, sentence, with_unit
from rhythmid.report.sections import reproduce_section

Array = NDArray[np.float64]
LINK = "time"
MEGABYTE = 1e6
EVEN = 1e-3  # share of a step; smaller differences between steps are drawn as a flat line
USABLE: dict[bool, tuple[str, Tone]] = {
    True: ("Usable, with remarks", "found"),
    False: ("Usable, and nothing to remark", "good"),
}


def recording_page(
    result: Mapping[str, Any],
    record: Record | None,
    remarks: Sequence[str],
    command: str,
    further: Sequence[Section] = (),
    verdict: tuple[str, Tone] | None = None,
) -> Page:
    """The report of `check`, and of `run` with its own `verdict` and `further` sections, which come first.

    `result` is the output of `check --json`, `record` the readable part of the recording, `remarks` the notes, one line each.
    """
    said, tone = verdict or (USABLE[bool(remarks)] if result["usable"] else ("Not usable", "open"))
    problems = " ".join(map(sentence, result["problems"]))
    channels = [] if record is None else [_channels(record)]
    return Page(
        title=f"rhythmid recording: {said}",
        kicker=f"Recording {result['path']}",
        verdict=said,
        words=problems or _words(result, remarks),
        tone=tone,
        tiles=_tiles(result),
        sections=(
            *further,
            Section("Remarks", (_listed([*result["problems"], *remarks]),)),
            *channels,
            *_quality(result),
            *_topics(result),
            reproduce_section(command, {}),
        ),
    )


def _words(result: Mapping[str, Any], remarks: Sequence[str]) -> str:
    roles = ", ".join(result["channels"])
    if not remarks:
        return f"The channels {roles} have no gaps, no duplicates, no clipped samples and no damage."
    return f"The channels {roles} can be read; {len(remarks)} {'remarks say' if len(remarks) > 1 else 'remark says'} what to know before trusting them."


def _tiles(result: Mapping[str, Any]) -> Tiles:
    made = [Tile("length", with_unit(number(result["duration"], 4), "s"))]
    output = result["channels"].get("output")
    if output:
        factor, unit = scaled(output["jitter_std"], "s")
        jitter = (
            "none"
            if output["jitter_std"] < 1e-12
            else with_unit(number(factor * output["jitter_std"], 3), unit)
        )
        made += [
            Tile("rate of the output", with_unit(number(output["rate"], 5), "Hz")),
            Tile("jitter of its times", jitter, "standard deviation"),
            Tile("gaps of the output", str(output["gaps"]), f"{output['lost']} samples lost"),
        ]
    made.append(
        Tile(
            "size",
            with_unit(number(result["size"] / MEGABYTE, 3), "MB"),
            "truncated" if result["truncated"] else "",
        )
    )
    return Tiles(tuple(made))


def _listed(lines: Sequence[str]) -> Block:
    return Bullets(tuple(map(sentence, lines))) if lines else Paragraph("None.", "note")


def _channels(record: Record) -> Section:
    """Every channel over time, and the time between its samples where that is not always the same."""
    blocks: list[Block] = []
    even: list[str] = []
    for role, channel in record.channels.items():
        blocks.append(_over_time(role, channel))
        steps = np.diff(channel.time)
        if len(steps) > 1 and np.ptp(steps) > EVEN * float(np.median(steps)):
            blocks.append(_steps(role, channel.time[1:], steps))
        else:
            even.append(role)
    if even:
        blocks.append(Paragraph(f"Evenly spaced in time: {', '.join(even)}.", "note"))
    return Section("Channels", tuple(blocks))


def _over_time(role: str, channel: Channel) -> Drawing:
    factor, unit = scaled(float(np.ptp(channel.value)) if len(channel) else 0.0, channel.unit)
    shown = pretty_unit(unit)
    return drawing(
        role.capitalize(),
        Chart(
            f"The channel {role} over time, {len(channel)} samples.", "time [s]",
            f"{role} [{shown}]" if shown else role, (Curve(channel.time, factor * channel.value, "", "after"),), link=LINK,
        ),
        f"{len(channel)} samples of {role}, as recorded{f' from {channel.source}' if channel.source else ''}.",
        wide=True,
    )  # fmt: skip


def _steps(role: str, time: Array, steps: Array) -> Drawing:
    factor, unit = scaled(float(np.median(steps)), "s")
    return drawing(
        f"Time between samples of {role}",
        Chart(
            f"Time between the samples of {role}, over time. Longest: {with_unit(number(factor * float(steps.max()), 3), unit)}.",
            "time [s]", f"step [{unit}]", (Curve(time, factor * steps, "", "measured"),),
            from_zero=True, link=LINK,
        ),
        "A flat line is an even clock; its width is jitter, a spike is a gap.",
        wide=True,
    )  # fmt: skip


def _seconds(value: float | None) -> str:
    if value is None:
        return NONE
    factor, unit = scaled(abs(value), "s")
    return with_unit(number(factor * value, 3), unit) if abs(value) > 1e-12 else "none"


def _quality(result: Mapping[str, Any]) -> list[Section]:
    rows = tuple(
        (
            role, one["source"] or NONE, with_unit(number(one["rate"], 5), "Hz"), _seconds(one["jitter_std"]), str(one["gaps"]),
            str(one["duplicates"]), str(one["clipped"]), str(one["nan"]),
        )
        for role, one in result["channels"].items()
    )  # fmt: skip
    columns = ("channel", "source", "rate", "jitter (std)", "gaps", "duplicates", "clipped", "no number")
    return [Section("Quality of the channels", (Table("As recorded.", columns, rows),))] if rows else []


def _topics(result: Mapping[str, Any]) -> list[Section]:
    rows = tuple(
        (
            one["name"], one["type"], str(one["count"]), with_unit(number(one["rate"], 4), "Hz") if one["rate"] else NONE, _seconds(one["jitter_std"]),
            str(one["gaps"]), str(one["duplicates"]), _seconds(one["lateness_mean"]),
        )
        for one in result["topics"]
    )  # fmt: skip
    columns = (
        "topic",
        "type",
        "messages",
        "rate",
        "jitter (std)",
        "gaps",
        "duplicates",
        "received after stamp",
    )
    caption = (
        "All topics of the bag, timed by the stamps of their headers where they have any, else by receipt."
    )
    return [Section("Topics", (Table(caption, columns, rows),))] if rows else []
