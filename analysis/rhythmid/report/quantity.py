"""Numbers for readers: value ± half-width of the 95 % interval, with its unit."""

import math
import re

from rhythmid.statistics import NORMAL_95

MINUS = "\u2212"
NONE = "—"
DECIMALS = 12  # digits printed at most: a double has no more near 1
RARE = 1e-3  # smaller probabilities are only stated to be below this
PREFIXES = ((1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n"), (1e-12, "p"))
PREFIXED = {"m", "s", "N", "rad", "V", "A", "Hz", "N*m"}
_SPELT = {
    "coulomb": "Coulomb",
    "stribeck": "Stribeck",
    "bouc wen": "Bouc-Wen",
    "lugre": "LuGre",
    "dc motor": "DC motor",
}
_SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def pretty_unit(unit: str) -> str:
    """The unit as printed: N·s/m², nothing for a pure number."""
    if unit in ("", "1", "-"):
        return ""
    for power in "23456":
        unit = unit.replace(f"^{power}", power.translate(_SUPERSCRIPT))
    return unit.replace("*", "·")


_OF_BODY = re.compile(r"\bbody\.([^\s,;]+?)\.(mass|inertia|payload|armature)\b")


def in_words(names: str) -> str:
    """Names of elements in words, surnames with capitals: "coulomb_friction" is "Coulomb friction".

    A body's value keeps the name that its file has for the link: "body.wrist_2_link.mass" is "the mass of wrist_2_link".
    """
    parts = _OF_BODY.split(names)
    said = [_spelt(parts[0])]
    for link, kind, rest in zip(parts[1::3], parts[2::3], parts[3::3], strict=True):
        said += [f"the {kind} of {link}", _spelt(rest)]
    return "".join(said)


def _spelt(names: str) -> str:
    words = names.replace("_", " ")
    for plain, spelt in _SPELT.items():
        words = re.sub(rf"\b{plain}\b", spelt, words)
    return words


def pretty_name(name: str) -> str:
    """An element's or parameter's name in words: "coulomb_friction.force" is "Coulomb friction: force"."""
    return in_words(name.replace(".", ": "))


def plain(text: str) -> str:
    """A line of the command's output for the page: names without underscores, with χ² and powers of ten."""
    text = re.sub(r"\b[a-z][a-z0-9]*(?:_[a-z0-9]+)+\b", lambda found: in_words(found[0]), text)
    text = re.sub(r"(?<=[a-z0-9])\.(?=[a-z])", ": ", text)
    text = re.sub(r"(?<=[A-Za-z])\*(?=[A-Za-z])", "·", text)  # units: N·s/m
    return re.sub(r"\b\d+(?:\.\d+)?e[+-]?\d+\b", lambda found: number(float(found[0])), text).replace(
        "chi2", "χ²"
    )


def sentence(text: str) -> str:
    """The text as a sentence: capital letter, full stop."""
    text = text.strip()
    return f"{text[:1].upper()}{text[1:].rstrip('.')}." if text else ""


def number(value: float | None, digits: int = 4) -> str:
    """A number with this many significant digits; very large and very small ones with a power of ten."""
    if value is None or math.isnan(value):
        return NONE
    if math.isinf(value):
        return "∞" if value > 0 else f"{MINUS}∞"
    if value == 0.0:
        return "0"
    exponent = int(f"{value:.{digits - 1}e}".partition("e")[2])
    if not -4 < exponent < max(digits, 6):
        return scientific(value, digits)
    text = f"{value:.{max(digits - 1 - exponent, 0)}f}"
    text = text.rstrip("0").rstrip(".") if "." in text else text
    return text.replace("-", MINUS)


def scientific(value: float, digits: int = 4) -> str:
    """A number with this many significant digits and a power of ten."""
    mantissa, _, power = f"{value:.{digits - 1}e}".partition("e")
    mantissa = mantissa.rstrip("0").rstrip(".") if "." in mantissa else mantissa
    return f"{mantissa} × 10{str(int(power)).translate(_SUPERSCRIPT)}".replace("-", MINUS)


def with_unit(text: str, unit: str) -> str:
    """The text, a narrow space and the printed unit."""
    return f"{text}\u202f{pretty_unit(unit)}" if pretty_unit(unit) else text


def with_written_unit(text: str, unit: str) -> str:
    """The text and the unit as it is written in files, plain text for a terminal; nothing for a pure number."""
    return f"{text} {unit}" if pretty_unit(unit) else text


def plus_minus(value: float, half: float) -> str:
    """value ± half, both to the second significant digit of half."""
    if not (math.isfinite(value) and math.isfinite(half)) or half <= 0.0:
        return number(value)
    size = max(abs(value), half)
    exponent = math.floor(math.log10(size))
    shift = exponent if exponent >= 6 or exponent < -3 else 0
    value, half = value / 10.0**shift, half / 10.0**shift
    places = decimals(half)
    if places < 0:
        value, half, places = round(value, places), round(half, places), 0
    places = min(places, DECIMALS)
    value = value if round(value, places) else 0.0  # no minus zero
    text = f"{value:.{places}f} ±\u00a0{half:.{places}f}".replace("-", MINUS)
    return f"({text}) × 10{str(shift).translate(_SUPERSCRIPT)}" if shift else text


def decimals(std: float) -> int:
    """Decimals up to the second significant digit of a standard deviation; negative ones are digits before the point."""
    return 1 - math.floor(math.log10(std))


def rounded(value: float, std: float | None) -> str:
    """A value to the second significant digit of its standard deviation, plain text for a terminal; four digits without one."""
    if std is None or not (math.isfinite(value) and math.isfinite(std)) or std <= 0.0:
        return f"{value:.4g}"
    places = min(decimals(std), DECIMALS)
    exponent = math.floor(math.log10(max(abs(value), std)))
    if exponent >= 6 or exponent < -4:
        return f"{value:.{max(exponent + places, 0)}e}" if value else "0"
    value = round(value, places)
    return f"{value if value else 0.0:.{max(places, 0)}f}"  # no minus zero


def with_std(value: float, std: float | None) -> str:
    """A value ± its standard deviation, plain text for a terminal; without one the value alone."""
    return rounded(value, std) + ("" if std is None else f" ± {rounded(std, std)}")


def written_percent(share: float | None) -> str:
    """A share in percent, plain text for a terminal; a dash where there is none."""
    return NONE if share is None else f"{number(100.0 * share, 3)} %"


def estimate(value: float | None, std: float | None, unit: str, factor: float = 1.0) -> str:
    """An estimate with its 95 % interval, both multiplied by `factor` to reach `unit`.

    `std` 0 is a number that was not estimated, None one that the records do not determine.
    """
    if value is None:
        return NONE
    if std == 0.0:
        return f"{with_unit(number(value * factor, 6), unit)} (fixed)"
    if std is None or not math.isfinite(std):
        return f"{with_unit(number(value * factor), unit)} (not determined)"
    return with_unit(plus_minus(value * factor, NORMAL_95 * std * factor), unit)


def percent(ratio: float | None, half: float | None = None) -> str:
    """A ratio in percent, with the half-width of its interval where known."""
    if ratio is None or math.isnan(ratio):
        return NONE
    if math.isinf(ratio):
        return "diverges"
    if half is not None and math.isfinite(half) and half > 0.0:
        return f"{plus_minus(100.0 * ratio, 100.0 * half)}\u202f%"
    return f"{number(100.0 * ratio, 3)}\u202f%"


def remaining_error(error: float, scoring: str) -> str:
    """The error of a model that lacks nothing, as a share of what is scored."""
    return f"the model misses {number(100.0 * error, 2)} % of the {'effort' if scoring == 'effort' else 'motion'}"


def probability(value: float | None) -> str:
    """A probability in percent. Evidence never gives exactly 0 or 1, so very small and very large probabilities are stated as bounds."""
    if value is None or math.isnan(value):
        return NONE
    if value < RARE:
        return f"below {percent(RARE)}"
    return f"above {percent(1.0 - RARE)}" if value > 1.0 - RARE else percent(value)


def scaled(size: float, unit: str) -> tuple[float, str]:
    """Factor and unit in which numbers of about this size read best: (1e6, "µm") for 3e-5 m."""
    if unit not in PREFIXED or not (math.isfinite(size) and size > 0.0):
        return 1.0, unit
    step, prefix = next(((s, p) for s, p in PREFIXES if size >= s), PREFIXES[-1])
    return 1.0 / step, f"{prefix}{unit}"


def averaged_words(count: int) -> str:
    """What an error refers to where `count` successive samples are averaged: single ones scatter more. Nothing where these are compared."""
    return f" (of means of {count} samples)" if count > 1 else ""
