"""Units: a machine is translational (kg, m, N), rotational (kg*m^2, rad, N*m) or scaled otherwise (V, px, …).

Elements write their units for a translational machine. `Units` translates them and refuses what does not match:
nothing is converted silently, because a factor of 1000 in a model file is a mistake more often than a wish.
"""

import re
from dataclasses import dataclass
from functools import lru_cache

from rhythmid.errors import InputError


@lru_cache(maxsize=1)
def _registry():
    import pint  # half a second to import, and needed only when a unit is not spelled as we spell it

    return pint.UnitRegistry()


def _plain(unit: str) -> str:
    unit = unit.replace("·", "*").replace("**", "^").replace("²", "^2").replace("³", "^3").replace(" ", "")
    return "1" if unit in ("", "-", "1") else unit


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
            name = match.group(0)
            given = swap.get(name, name)
            return f"({given})" if given != name and re.search(r"[*/^]", given) else given

        return re.sub(r"[A-Za-z]+", one, unit)

    def check(self, given: str, expected: str, where: str) -> None:
        """Raise InputError unless `given` is the unit that this machine uses for `expected`."""
        wanted = self.of(expected)
        if _plain(given) == _plain(wanted):
            return
        problem = f"{where}: unit {given!r} where {wanted!r} is expected"
        if not {self.force, self.position, self.mass} <= {"N", "m", "kg", "N*m", "rad", "kg*m^2"}:
            raise InputError(problem)
        import pint

        registry = _registry()
        try:
            ratio = registry.Quantity(1.0, _plain(given)) / registry.Quantity(1.0, _plain(wanted))
            factor = ratio.to("dimensionless").magnitude if ratio.dimensionless else None
        except (pint.errors.PintError, AttributeError, TypeError, ValueError) as error:
            raise InputError(f"{problem} (it is not a unit that is known: {error})") from None
        if factor is None:
            raise InputError(f"{problem}: they measure different things")
        if abs(factor - 1.0) > 1e-12:
            raise InputError(f"{problem}: write the value in {wanted} (multiply it by {factor:.6g})")


TRANSLATIONAL = Units()
ROTATIONAL = Units(force="N*m", position="rad", mass="kg*m^2")
