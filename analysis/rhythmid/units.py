"""Units: a machine is translational (kg, m, N), rotational (kg*m^2, rad, N*m) or scaled otherwise (V, px, …).

Elements declare their units for a translational machine. `Units` translates them and refuses units that do not match.
Nothing is converted silently, because a factor of 1000 in a model file is usually a mistake.
"""

import re
from dataclasses import dataclass
from functools import lru_cache

from rhythmid.errors import InputError
from rhythmid.record.heading import NOT_SI
from rhythmid.unit_powers import are_same, is_product, reduced


@lru_cache(maxsize=1)
def _registry():
    import pint  # half a second to import, and needed only for other spellings of a unit

    return pint.UnitRegistry()


def _plain(unit: str) -> str:
    unit = unit.strip().replace("·", "*").replace("**", "^").replace("²", "^2").replace("³", "^3")
    unit = re.sub(r"(?<=[\w)]) +(?=[\w(])", "*", unit).replace(" ", "")  # N s/m is N*s/m
    return "1" if unit in ("", "-", "1") else reduced(unit)


@dataclass(frozen=True)
class Units:
    """Units of force, position and mass of one machine."""

    force: str = "N"
    position: str = "m"
    mass: str = "kg"

    def of(self, unit: str) -> str:
        """The unit of a parameter that is `unit` on a translational machine."""
        swap = {"N": self.force, "m": self.position, "kg": self.mass}

        def one(match: re.Match[str]) -> str:
            divided, name, power = match.groups()
            given = swap.get(name, name)
            whole = f"({given})" if (divided or power) and re.search(r"[*/^]", given) else given
            return divided + whole + power

        return reduced(re.sub(r"(/?)([A-Za-z]+)(\^?)", one, unit))

    def check(self, given: str, expected: str, where: str) -> None:
        """Raise InputError unless `given` is the unit that this machine uses for `expected`."""
        wanted = self.of(expected)
        if are_same(_plain(given), _plain(wanted)):
            return
        problem = f"{where}: unit {given!r} where {wanted!r} is expected"
        if not {self.force, self.position, self.mass} <= {"N", "m", "kg", "N*m", "rad", "kg*m^2"}:
            raise InputError(problem)
        try:
            given_unit, wanted_unit = (_registry().Quantity(1.0, _plain(unit)) for unit in (given, wanted))
            ratio = given_unit / wanted_unit
            factor = float(ratio.m_as("dimensionless")) if ratio.dimensionless else None
        except Exception:  # the parser fails in many ways for text that is not a unit
            raise InputError(f"{problem} (it is not a unit that is known)") from None
        if factor is None:
            raise InputError(f"{problem}: they measure different things")
        if abs(factor - 1.0) > 1e-12:
            raise InputError(f"{problem}: write the value in {wanted} (multiply it by {factor:.6g})")


def mass_unit(force: str, position: str) -> str:
    """The unit of an inertia: that of force divided by that of acceleration."""
    return reduced(f"{force}*s^2/{position}")


def multiple_of_si(unit: str) -> tuple[float, str] | None:
    """Factor and SI unit of a multiple of an SI unit, such as mm or deg; None for any other unit.

    A machine's own unit is no multiple of one: V, px, duty, and also %, the share of a whole that no unit states.
    """
    found = NOT_SI.get(unit)
    return None if found is None or found[1] == "1" else found


def is_readable(unit: str) -> bool:
    """Whether a text can be a unit: a product of powers of names, of which any may be a machine's own (px, duty, inH2O)."""
    return is_product(re.sub(r"(?<=[^\W\d_])-?\d+", "", _plain(unit)))


TRANSLATIONAL = Units()
ROTATIONAL = Units(force="N*m", position="rad", mass="kg*m^2")
