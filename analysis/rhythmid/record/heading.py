"""Units in the headings of table columns, as in `q [rad]`, `tau (Nm)`, `pos_deg`."""

import math
import re
from dataclasses import dataclass

NOT_SI = {
    "mm": (1e-3, "m"), "cm": (1e-2, "m"), "um": (1e-6, "m"), "µm": (1e-6, "m"), "km": (1e3, "m"), "in": (0.0254, "m"),
    "mm/s": (1e-3, "m/s"), "cm/s": (1e-2, "m/s"), "deg": (math.pi / 180, "rad"), "deg/s": (math.pi / 180, "rad/s"),
    "rpm": (math.pi / 30, "rad/s"), "mN": (1e-3, "N"), "kN": (1e3, "N"), "lbf": (4.4482216152605, "N"),
    "mNm": (1e-3, "N*m"), "g": (9.80665, "m/s^2"), "mm/s^2": (1e-3, "m/s^2"), "in/s": (0.0254, "m/s"), "in/s^2": (0.0254, "m/s^2"),
    "ft": (0.3048, "m"), "ft/s": (0.3048, "m/s"), "ft/s^2": (0.3048, "m/s^2"), "kip": (4448.2216152605, "N"),
    "cm/s^2": (1e-2, "m/s^2"), "km/h": (1.0 / 3.6, "m/s"), "%": (1e-2, "1"),
}  # fmt: skip
FURTHER = {
    "mrad": (1e-3, "rad"), "rev": (2 * math.pi, "rad"), "deg/s^2": (math.pi / 180, "rad/s^2"), "Ncm": (1e-2, "N*m"),
    "mA": (1e-3, "A"), "mV": (1e-3, "V"), "mrad/s": (1e-3, "rad/s"), "rps": (2 * math.pi, "rad/s"), "Nmm": (1e-3, "N*m"),
    "rev/s": (2 * math.pi, "rad/s"), "lbf*ft": (1.3558179483314, "N*m"), "lbf*in": (0.1129848290276, "N*m"),
    "ms": (1e-3, "s"), "us": (1e-6, "s"), "ns": (1e-9, "s"), "min": (60.0, "s"),
}  # fmt: skip
SI = ("s", "m", "rad", "N", "N*m", "m/s", "rad/s", "m/s^2", "rad/s^2", "A", "V", "kg")
SPELLINGS = {
    "°": "deg", "degree": "deg", "degrees": "deg", "degs": "deg", "dps": "deg/s", "sec": "s", "secs": "s", "seconds": "s",
    "second": "s", "msec": "ms", "millis": "ms", "millisec": "ms", "millisecs": "ms", "usec": "us", "micros": "us",
    "microsec": "us", "microsecs": "us", "nanosec": "ns", "nanosecs": "ns", "µs": "us", "nsec": "ns", "nanos": "ns",
    "nanoseconds": "ns", "milliseconds": "ms", "microseconds": "us", "radians": "rad", "radian": "rad", "newtons": "N", "newtonmeters": "Nm", "newtonmeter": "Nm", "meter": "m",
    "meters": "m", "metre": "m", "metres": "m", "newton": "N", "amp": "A", "amps": "A", "volt": "V", "volts": "V",
    "rads": "rad/s", "mps": "m/s", "radps": "rad/s", "degps": "deg/s", "r/min": "rpm", "1/min": "rpm", "rev/min": "rpm",
    "inch": "in", "inches": "in", "feet": "ft", "foot": "ft", "kips": "kip", "klbf": "kip", "lbs": "lbf", "lb": "lbf", "kmh": "km/h",
    "percent": "%", "pct": "%", "ftlb": "lbf*ft", "ftlbf": "lbf*ft", "lbft": "lbf*ft", "lbfft": "lbf*ft", "inlb": "lbf*in", "inlbf": "lbf*in",
    "lbin": "lbf*in", "lbfin": "lbf*in",
    "rpm": "rpm", "deg": "deg", "rad": "rad",  # in any case: RPM, Deg
}  # fmt: skip
# after an underscore, in any case; without those that are also words or other quantities: _in, _g, _min, _rev
SUFFIXES = (
    "deg_per_s", "rad_per_s", "m_per_s", "mm_per_s", "deg_s", "rad_s", "mm_s", "m_s2", "m_s", "rad_s2", "deg", "degrees", "rad",
    "radians", "rads", "radps", "degps", "dps", "rpm", "mps", "mm", "cm", "mrad", "nm", "mnm", "n", "m", "ma", "a", "v", "mv", "msec",
    "ms", "usec", "us", "nsec", "ns", "nanoseconds", "milliseconds", "seconds", "secs", "sec", "s",
)  # fmt: skip
COUNTERS = ("millis", "micros", "nanos")  # names of Arduino's clock functions, which are units
WORDS = ("rpm", "deg", "degrees", "radians", "dps")  # unambiguous units, anywhere in a name
LETTERS = {  # a single letter is a unit only after a suitable word: pos_a is no current
    "s": "t time timestamp stamp elapsed", "m": "pos position x y z height displacement disp length travel stroke",
    "n": "f force load thrust", "a": "i iq current cur", "v": "u voltage volt supply",
}  # fmt: skip
# units that may follow a name directly, with the names that they suit: "yrad" has one; "grad" and "thread" are words
GLUED = {
    "deg rad mrad": "x y q ang angle pos position theta phi psi alpha beta gamma roll pitch yaw tilt enc encoder",
    "mm": "x y z pos position height disp displacement dist distance length travel stroke",
    # "xcm" is the position of a centre of mass
    "cm": "pos position height disp displacement dist distance length travel stroke",
    "rpm rads radps degps dps": "w n vel velocity speed omega rate",
    "ms us ns msec usec nsec sec secs": "t time timestamp stamp elapsed", "nm mnm": "tau torque moment trq", "ma": "cur current curr iq",
    "mv": "volt voltage",
}  # fmt: skip
_GLUED = {
    stem + unit: unit for units, stems in GLUED.items() for unit in units.split() for stem in stems.split()
}
# capitalised units after any name; without those with other meanings, as in velMa, xCm and velMs
CAPITALS = frozenset("deg degrees rad radians mrad rads radps degps dps rpm mm nm mnm".split())
_CAPITAL = re.compile(r"(?<=[a-z0-9])(?=[A-Z])")  # start of a word in kneePosRad
_BRACKETS = re.compile(r"^(.*?)\s*[\[({<]\s*([^\[\](){}<>]*?)\s*[\])}>]\s*$")
_SLASH = re.compile(r"^(.+?)\s+(?:/|in)\s+(\S+)$")  # "angle / deg", "angle in deg"


@dataclass(frozen=True)
class Heading:
    """A column's heading: the `name` without the unit, the SI `unit`, and the `scale` of the column's numbers in
    that unit.

    `unit` is empty where none is given; `written` is the unit as spelled in the heading.
    """

    name: str
    unit: str = ""
    scale: float = 1.0
    written: str = ""

    @property
    def converted(self) -> bool:
        """Whether the heading has a unit that is not SI."""
        return self.scale != 1.0


def heading_of(column: str) -> Heading:
    """Parse the heading `column`: a unit in brackets, after a slash, a quotient of units as its last word, a suffix
    after an underscore or with a capital, directly after a name that it suits, or as a word of the name."""
    column = column.strip()
    if column.lower() in COUNTERS and (known := unit_of(column)) is not None:
        return Heading(column, *known, column)
    for pattern in (_BRACKETS, _SLASH):
        if (match := pattern.match(column)) and (known := unit_of(match[2])) is not None:
            return Heading(match[1].strip() or column, *known, match[2])
    last = re.split(r"[\s_.]", column)[-1]
    if "/" in last and (known := unit_of(last)) is not None:
        return Heading(column[: -len(last)].strip(" _.") or column, *known, last)
    suffix = _glued(column)
    if suffix and (known := unit_of(_spelled(suffix))) is not None:
        return Heading(column[: -len(suffix)], *known, column[-len(suffix) :])
    lowered = column.lower()
    for suffix in SUFFIXES:
        if lowered.endswith("_" + suffix) and len(column) > len(suffix) + 1:
            if len(suffix) == 1 and lowered[:-2].rsplit("_", 1)[-1] not in LETTERS[suffix].split():
                break
            known = unit_of(_spelled(suffix))
            assert known is not None
            return Heading(column[: -len(suffix) - 1], *known, column[-len(suffix) :])
    return _with_word(column)


def _with_word(column: str) -> Heading:
    """Parse a heading with a unit as one of its words, as in `rpm`, `rpm_left` and `Motor RPM 2`."""
    words = [match for match in re.finditer(r"[A-Za-z]+", column) if match[0].lower() in WORDS]
    if len(words) != 1 or (known := unit_of(words[0][0])) is None:
        return Heading(column)
    before, after = column[: words[0].start()].rstrip(" ._"), column[words[0].end() :]
    return Heading((before + after).strip(" ._") or column, *known, words[0][0])


def _glued(column: str) -> str:
    """The unit directly at the end of a name, in lower case; empty where there is none."""
    *before, last = _CAPITAL.split(re.split(r"[\s_.]", column)[-1])
    if before and last.lower() in CAPITALS:
        return last.lower()
    return _GLUED.get(last.lower()) or (_GLUED.get((before[-1] + last).lower(), "") if before else "")


def is_unit(text: str) -> bool:
    """Whether a cell below a column's name can be its unit: a known unit, a dash or an empty cell."""
    bare = bare_unit(text)
    return bare in ("", "-", "1", "%") or unit_of(bare) is not None


def bare_unit(text: str) -> str:
    """A unit without the brackets around it."""
    return text.strip().strip("[](){}").strip()


def unit_of(text: str) -> tuple[str, float] | None:
    """SI unit and factor of a written unit; None where it is unknown."""
    text = text.strip().replace(" per ", "/").replace("²", "^2").replace("^2", "²").replace("**2", "²")
    text = re.sub(r"(?<=s)2$", "²", text)
    parts = [re.sub(r"[\s·*⋅.-]", "", part) for part in text.split("/")]
    parts = [SPELLINGS.get(part, SPELLINGS.get(part.lower(), part)) for part in parts]
    plain = "/".join(parts).replace("²", "^2")
    plain = SPELLINGS.get(plain, SPELLINGS.get(plain.lower(), plain))
    plain = {"nm": "Nm", "NM": "Nm", "n": "N"}.get(plain, plain)  # no robot is measured in nanometres
    plain = "N*m" if plain == "Nm" else plain
    if plain in SI:
        return plain, 1.0
    found = NOT_SI.get(plain) or FURTHER.get(plain)
    return None if found is None else (found[1], found[0])


def _spelled(suffix: str) -> str:
    """The unit that a suffix stands for."""
    special = {"nm": "Nm", "mnm": "mNm", "n": "N", "ma": "mA", "a": "A", "v": "V", "mv": "mV"}
    if suffix in special:
        return special[suffix]
    per = re.fullmatch(r"(deg|rad|mm|m)_(?:per_)?s(2?)", suffix)
    return f"{per[1]}/s{'^2' if per[2] else ''}" if per else suffix
