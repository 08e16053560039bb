"""The signal path of a machine as a drawing: its slots, their elements, and the missing effects.

Drawn twice, horizontally for wide screens and paper, vertically for narrow screens; the style sheet shows one of them.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from textwrap import wrap

from rhythmid.report.chart import opening

ROLES = {
    "command": "delays and lags of u",
    "actuator": "command to force",
    "force": "inertia and forces",
    "sensor": "motion to output",
}
LINE = 16.0
WRAP = 25  # letters in a line of a box
FLAG_LETTER = 7.6  # width of a bold letter on a flag


@dataclass(frozen=True)
class SlotContent:
    """Content of a slot: names of the nominal model's elements, names of the missing effects, and whether the slot is
    suspected."""

    elements: tuple[str, ...] = ()
    missing: tuple[str, ...] = ()
    suspect: bool = False

    @property
    def faulty(self) -> bool:
        return self.suspect or bool(self.missing)

    @property
    def lines(self) -> list[tuple[str, str]]:
        """(class, text) of every line in the box."""
        found = [("", line) for name in self.elements for line in wrap(name, WRAP)] or [
            ("faint", "no element")
        ]
        return [*found, *(("missing", line) for name in self.missing for line in wrap(f"+ {name}", WRAP))]


def draw_signal_path(
    slots: Mapping[str, SlotContent], forced: bool, alt: str, note: str = "missing here"
) -> str:
    """The path u → command → (+ f0) → actuator → force → sensor → y, and the clocks below it.

    `slots` by name; `note` labels the ones that are faulty.
    """
    content = {name: slots.get(name, SlotContent()) for name in (*ROLES, "timing")}
    return (
        f'<div class="lying">{_lying(content, forced, alt, note)}</div>'
        f'<div class="standing">{_standing(content, forced, alt, note)}</div>'
    )


def _box(
    name: str, role: str, slot: SlotContent, x: float, y: float, width: float, height: float, note: str
) -> str:
    faulty = " faulty" if slot.faulty else ""
    middle = x + width / 2
    parts = [
        f'<rect class="slot{faulty}" x="{x:.0f}" y="{y:.0f}" width="{width:.0f}" height="{height:.0f}" rx="6"/>',
        f'<text class="slot-name" x="{middle:.0f}" y="{y + 21:.0f}" text-anchor="middle">{name}</text>',
        f'<text class="faint" x="{middle:.0f}" y="{y + 36:.0f}" text-anchor="middle">{role}</text>',
    ]
    for index, (kind, text) in enumerate(slot.lines):
        at = y + 60 + LINE * index
        parts.append(
            f'<text class="{kind}" x="{middle:.0f}" y="{at:.0f}" text-anchor="middle">{escape(text)}</text>'
        )
    if slot.faulty:
        wide = FLAG_LETTER * len(note) + 18
        parts.append(
            f'<rect class="flag" x="{middle - wide / 2:.0f}" y="{y - 15:.0f}" width="{wide:.0f}" height="20" rx="10"/>'
        )
        parts.append(
            f'<text class="flag-text" x="{middle:.0f}" y="{y - 1:.0f}" text-anchor="middle">{escape(note)}</text>'
        )
    return "".join(parts)


def _arrow(x0: float, y0: float, x1: float, y1: float) -> str:
    if y0 == y1:
        head = f"M{x1:.0f} {y1:.0f}l-8 -4.5v9z"
    else:
        head = f"M{x1:.0f} {y1:.0f}l-4.5 -8h9z"
    return f'<path class="wire" d="M{x0:.0f} {y0:.0f}L{x1:.0f} {y1:.0f}"/><path class="head" d="{head}"/>'


def _sum(x: float, y: float) -> str:
    return f'<circle class="sum" cx="{x:.0f}" cy="{y:.0f}" r="10"/><path class="wire" d="M{x - 5:.0f} {y:.0f}h10M{x:.0f} {y - 5:.0f}v10"/>'


def _clocks(slot: SlotContent, x: float, y: float, width: float, note: str) -> str:
    faulty = " faulty" if slot.faulty else ""
    texts = [text for kind, text in slot.lines if kind != "faint"]
    said = "clocks: stamps and changing delays" + (f" ({', '.join(texts)})" if texts else "")
    parts = [
        f'<rect class="slot clocks{faulty}" x="{x:.0f}" y="{y:.0f}" width="{width:.0f}" height="30" rx="6"/>',
        f'<text class="{"missing" if slot.faulty else "faint"}" x="{x + width / 2:.0f}" y="{y + 19:.0f}" text-anchor="middle">{escape(said)}</text>',
    ]
    if slot.faulty:
        wide = FLAG_LETTER * len(note) + 18
        parts.append(
            f'<rect class="flag" x="{x + width - wide - 10:.0f}" y="{y - 11:.0f}" width="{wide:.0f}" height="20" rx="10"/>'
        )
        parts.append(
            f'<text class="flag-text" x="{x + width - 10 - wide / 2:.0f}" y="{y + 3:.0f}" text-anchor="middle">{escape(note)}</text>'
        )
    return "".join(parts)


def _height(slots: Sequence[SlotContent]) -> float:
    return 60.0 + LINE * max(len(slot.lines) for slot in slots)


def _lying(content: Mapping[str, SlotContent], forced: bool, alt: str, note: str) -> str:
    boxes = [content[name] for name in ROLES]
    top, width = 52.0, 192.0
    tall = _height(boxes)
    middle = top + tall / 2
    places = {"command": 46.0, "actuator": 306.0, "force": 532.0, "sensor": 758.0}
    parts = [opening(1000, top + tall + 62, alt)]
    parts.append(f'<text class="signal" x="14" y="{middle - 8:.0f}" text-anchor="middle">u</text>')
    parts.append(_arrow(4, middle, 44, middle))
    junction = 271.0
    parts.append(
        _arrow(238, middle, junction - 11, middle)
        + _sum(junction, middle)
        + _arrow(junction + 10, middle, 304, middle)
    )
    if forced:
        parts.append(_arrow(junction, 26, junction, middle - 11))
        parts.append(
            f'<text class="signal" x="{junction:.0f}" y="18" text-anchor="middle">f₀, the forcing</text>'
        )
    parts.append(
        _arrow(498, middle, 530, middle) + _arrow(724, middle, 756, middle) + _arrow(950, middle, 994, middle)
    )
    parts.append(f'<text class="signal" x="976" y="{middle - 8:.0f}" text-anchor="middle">y</text>')
    parts += [_box(name, ROLES[name], content[name], places[name], top, width, tall, note) for name in ROLES]
    parts.append(_clocks(content["timing"], 46, top + tall + 22, 904, note))
    return "".join([*parts, "</svg>"])


def _standing(content: Mapping[str, SlotContent], forced: bool, alt: str, note: str) -> str:
    x, width = 60.0, 240.0
    centre = x + width / 2
    y = 44.0
    parts = [
        f'<text class="signal" x="{centre + 14:.0f}" y="18">u</text>',
        _arrow(centre, 4, centre, y - 2 - 10),
    ]
    y += 4.0
    for name in ROLES:
        tall = _height([content[name]])
        parts.append(_box(name, ROLES[name], content[name], x, y, width, tall, note))
        y += tall
        if name == "command":
            parts.append(_arrow(centre, y, centre, y + 21) + _sum(centre, y + 32))
            if forced:
                parts.append(_arrow(x + 30, y + 32, centre - 11, y + 32))
                parts.append(f'<text class="signal" x="{x - 50:.0f}" y="{y + 36:.0f}">f₀, forcing</text>')
            y += 43
        parts.append(_arrow(centre, y, centre, y + 34))
        y += 46 if name != "sensor" else 36
    parts.append(f'<text class="signal" x="{centre + 14:.0f}" y="{y - 8:.0f}">y</text>')
    y += 16
    parts.append(_clocks(content["timing"], 6, y, 348, note))
    return "".join([opening(360, y + 36, alt), *parts, "</svg>"])
