"""A robot drawn as its joints: chains from the base to the last links, the joints that lack physics marked."""

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from textwrap import shorten

from rhythmid.report.chart import opening

COLUMN, ROW, LEFT, TOP = 130.0, 84.0, 110.0, 46.0  # pixels between joints, between chains, and of the margins
BELOW = 42.0  # room under the lowest joint, for its fault
RADIUS = 15.0
ELBOW = 16.0  # from the edge of what carries a joint to where the line to it turns
LETTERS = 18  # of a label under a joint


@dataclass(frozen=True)
class DrawnJoint:
    """A joint: its name, the joint that carries it (none: the base), whether it turns, and what is wrong there in a few words."""

    name: str
    parent: str | None
    turns: bool
    fault: str = ""
    open: bool = False  # something is wrong that has no name


def robot_svg(joints: Sequence[DrawnJoint], alt: str) -> str:
    """The drawing: circles turn, squares slide, the base stands on the left."""
    place = _places(joints)
    columns = 1 + max(column for column, _ in place.values())
    rows = 1 + max(row for _, row in place.values())
    width, height = LEFT + COLUMN * columns + 20.0, TOP + ROW * (rows - 1) + BELOW
    middle = TOP + ROW * (rows - 1) / 2.0
    parts = [opening(width, height, alt)]
    at = {name: (LEFT + COLUMN * (column + 0.4), TOP + ROW * row) for name, (column, row) in place.items()}
    for one in joints:
        (x, y), (px, py) = at[one.name], at[one.parent] if one.parent else (50.0 - RADIUS, middle)
        turn = px + RADIUS + ELBOW
        parts.append(f'<path class="join" fill="none" d="M{px:.0f} {py:.0f}H{turn:.0f}V{y:.0f}H{x:.0f}"/>')
    for one in joints:
        parts += _joint(one, *at[one.name])
    parts.append(f'<rect class="slot" x="6" y="{middle - 18:.0f}" width="44" height="36" rx="4"/>')
    parts.append(f'<text class="faint" x="28" y="{middle + 4:.0f}" text-anchor="middle">base</text>')
    return "".join([*parts, "</svg>"])


def _joint(one: DrawnJoint, x: float, y: float) -> list[str]:
    kind = "slot faulty" if one.fault else "slot"
    shape = f'<circle class="{kind}" cx="{x:.0f}" cy="{y:.0f}" r="{RADIUS:.0f}"/>'
    if not one.turns:
        side = 2.0 * RADIUS
        shape = f'<rect class="{kind}" x="{x - RADIUS:.0f}" y="{y - RADIUS:.0f}" width="{side:.0f}" height="{side:.0f}"/>'
    label = escape(shorten(one.name, LETTERS, placeholder="…"))
    found = [
        shape,
        f'<text class="slot-name" x="{x:.0f}" y="{y - RADIUS - 8:.0f}" text-anchor="middle">{label}</text>',
    ]
    if one.fault:
        mark = "?" if one.open else "!"
        found.append(
            f'<text class="slot-name" x="{x:.0f}" y="{y + 5:.0f}" text-anchor="middle">{mark}</text>'
        )
        found.append(
            f'<text class="missing" x="{x:.0f}" y="{y + RADIUS + 16:.0f}" text-anchor="middle">{escape(shorten(one.fault, 24, placeholder="…"))}</text>'
        )
    return found


def _places(joints: Sequence[DrawnJoint]) -> dict[str, tuple[int, float]]:
    """Column and row of each joint: chains share rows from the base on, a joint with several children stands between them."""
    children: dict[str | None, list[str]] = {}
    for one in joints:
        children.setdefault(one.parent, []).append(one.name)
    found: dict[str, tuple[int, float]] = {}
    rows = iter(range(len(joints)))

    def put(name: str, column: int) -> float:
        below = [put(child, column + 1) for child in children.get(name, [])]
        row = sum(below) / len(below) if below else float(next(rows))
        found[name] = column, row
        return row

    for name in children.get(None, []):
        put(name, 0)
    return found
