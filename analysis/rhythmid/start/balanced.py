"""Force balance of records with little metadata: includes the restoring force, the sign of the driving signal, and
the unit of an angle."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from rhythmid.elements.force.pendulum_gravity import LEAST_SWING
from rhythmid.errors import InputError
from rhythmid.model import MASS, Model
from rhythmid.record.record import Record
from rhythmid.start.balance import LATEST_ACTION, OFF_CENTRE, Law, Rows
from rhythmid.start.correction import Correction
from rhythmid.units import Units
from rhythmid.value import Value

UNEXPLAINED = 0.8  # largest unexplained share of the driving signal for which the balance's values are used
DEGREE = math.pi / 180.0  # rad


@dataclass(frozen=True, eq=False)
class Balanced:
    """The driving signal and the columns, the law that balances them, the restoring force, doubts about the recording,
    and corrections of it with which alone the law holds."""

    rows: Rows
    law: Law
    kind: str
    doubts: tuple[str, ...] = ()
    corrections: tuple[Correction, ...] = ()

    @property
    def explained(self) -> str:
        """Share of the driving signal that the law explains, in per cent."""
        return f"{max(0.0, 1.0 - self.law.left):.0%}"


def balance_of(
    records: Sequence[Record],
    bare: Model,
    rotary: bool,
    driver: str,
    unit_told: bool,
    latest: float = LATEST_ACTION,
) -> Balanced:
    """The balance of records driven by the channel `driver`, which acts at most `latest` [s] after it was recorded; `unit_told` says
    whether the unit of the position is known.

    Raises InputError where the records are too short or have no driving signal.
    """
    found = _of_either_sign(records, bare, rotary, driver, latest)
    if unit_told or not rotary or any(one.output_kind != "position" for one in records):
        return found
    degrees = [_scaled(one, DEGREE) for one in records]
    other = _of_either_sign(degrees, bare, rotary, driver, latest)
    if other.kind == "pendulum" and other.law.left <= UNEXPLAINED and other.law.earns_place(found.law):
        why = (
            f"with the output in degrees (scale: {DEGREE:.9g}) the balance of forces explains {other.explained} of the {driver}, in rad "
            f"{found.explained}: its unit is not stated, and degrees are assumed"
        )
        return replace(other, corrections=(Correction("output", why, DEGREE), *other.corrections))
    if found.kind == "pendulum":
        doubt = f"the unit of the angle is not stated, and gravity needs rad: if it is in degrees, give the output  scale: {DEGREE:.9g}"
        return replace(found, doubts=(*found.doubts, doubt))
    return found


def _scaled(record: Record, scale: float) -> Record:
    """The record with its output in another unit, without a recorded velocity."""
    return replace(record, output=replace(record.output, value=record.output.value * scale), velocity=None)


def _of_either_sign(
    records: Sequence[Record], bare: Model, rotary: bool, driver: str, latest: float
) -> Balanced:
    """The balance, with the opposite sign of the driving signal where only that explains the motion."""
    rows = replace(Rows.of(records, bare), latest=latest)
    plain = Balanced(rows, *restoring(records, rows, rotary, inertial=True))
    turned = None if rows.by_base else _reversed(records, rows, plain.law, rotary)
    if turned is None:
        return plain
    found = Balanced(rows.reversed, *turned)
    why = (
        f"with scale: -1 for the {driver} the balance of forces explains {found.explained} of it, as recorded {plain.explained}: its sign "
        "seems to be opposite to the motion's"
    )
    return replace(found, corrections=(Correction(driver, f"{why}, and is turned round here", -1.0),))


def sign_note(records: Sequence[Record], units: Units) -> str | None:
    """A note on a driving signal whose sign is opposite to the motion's; None where it is not, or the records have no
    balance of forces."""
    driver = "effort" if records and records[0].effort is not None else "input"
    bare = Model(Value(1.0, units.mass, False, MASS.bounds), (), units)
    try:
        found = _of_either_sign(records, bare, units.position == "rad", driver, LATEST_ACTION)
    except InputError:
        return None
    return found.corrections[0].why.removesuffix(", and is turned round here") if found.corrections else None


def _reversed(records: Sequence[Record], rows: Rows, law: Law, rotary: bool) -> tuple[Law, str] | None:
    """The balance with the opposite sign of the driving signal, where it explains clearly more without more delay;
    else None.

    The inertia itself has to explain a share: the effort of a controller of position and speed is balanced by
    spring and damper with the opposite sign. The opposite sign of a periodic signal is half a period of delay, so a
    law with more delay says nothing about the sign.
    """
    turned, kind = restoring(records, rows.reversed, rotary, inertial=True)
    if turned.left > UNEXPLAINED or turned.delay > law.delay or not turned.earns_place(law):
        return None
    rest = [name for name in turned.coefficients if name != "acceleration"]
    return (turned, kind) if turned.earns_place(rows.reversed.fit(rest, turned.delay)) else None


def rest_of(law: Law, kind: str) -> float | None:
    """Where the restoring force of a balance vanishes: the rest of a spring, or where a pendulum hangs; None without one."""
    found = law.coefficients
    if kind == "spring":
        return -found.get("constant", 0.0) / found["position"]
    return math.atan2(-found.get("cosine", 0.0), found["sine"]) if kind == "pendulum" else None


def restoring(records: Sequence[Record], rows: Rows, rotary: bool, inertial: bool) -> tuple[Law, str]:
    """The balance with the restoring force, if there is one: a spring, or gravity of a pendulum.

    The integral of a speed drifts. In full turns gravity has to explain clearly more even beside a sensor that is off centre. Gravity depends on the absolute angle, which the integral does not give; a
    spring is identifiable from it only where the motion returns, and so it is where nothing drives the machine: along a motion of
    one direction it is told neither from damping nor from a push, and no more is gravity's sine within a turn. Each force has to explain clearly more even beside dry
    friction, which every machine may have: a spring partly absorbs it, and in a motion of one direction a constant is the same,
    but would move the machine where it rests. Where friction is the better of the two, or is needed beside a constant, it is in the law and
    no kind of its own.
    """
    measured = all(record.output_kind == "position" for record in records)
    moving = ["acceleration", "velocity"] if inertial else ["velocity"]
    level = [] if rows.steady else ["constant"]  # a constant would balance a constant driving signal
    full = [*moving, "position", *level]
    delay = rows.delay(full)
    plain = rows.fit(moving, delay)
    options: dict[str, Law] = {
        "constant": rows.fit([*moving, *level], delay),
        "spring": rows.fit(full, delay),
    }
    if rotary and measured and rows.span >= 2.0 * LEAST_SWING:
        options["pendulum"] = rows.fit([*moving, "sine", *(["cosine"] if level else [])], delay)
    driven = any(one.input is not None or one.effort is not None for one in records)
    if "pendulum" in options and not (driven or rows.comes_back or rows.span >= 2.0 * math.pi):
        del options["pendulum"]
    if "pendulum" in options and rows.span >= 2.0 * math.pi:
        off, both = (
            rows.fit([*one.coefficients, *OFF_CENTRE], delay) for one in (plain, options["pendulum"])
        )
        if not both.earns_place(off):
            del options["pendulum"]
    if options["spring"].coefficients["position"] <= 0.0 or not ((measured and driven) or rows.comes_back):
        del options["spring"]
    law, kind = plain, "free"
    if options["constant"].earns_place(law):
        against, both, steady = (
            rows.fit([*moving, *more], delay, moving=True)
            for more in (["friction"], [*level, "friction"], level)
        )
        # where the motion has one direction, the filter alone tells the two apart
        needed = both.earns_place(against) and (rows.comes_back or steady.left < against.left)
        law, kind = (options["constant"], "constant") if needed else (against, "free")
        if needed and both.earns_place(steady):
            law = both  # alone, the constant would take on the friction of the direction that prevails
    back = [name for name in ("spring", "pendulum") if name in options]
    if back:
        best = min(back, key=lambda name: options[name].left)
        dry = [
            rows.fit([*dict.fromkeys([*one.coefficients, "friction"])], delay) for one in (options[best], law)
        ]
        if options[best].earns_place(law) and dry[0].earns_place(dry[1]):
            law, kind = options[best], best
    return law, kind
