"""Commands of several joints that are not renewed: forces fade to zero, references are held."""

import numpy as np
from numpy.typing import NDArray

from rhythmid.body.body import Array
from rhythmid.simulation.command_hold import CommandHold


class JointHold:
    """The commands in force, with the methods of `CommandHold`; `fading` (joints,) marks those that are forces."""

    def __init__(self, timeout: float, ramp: float, period_ns: int, fading: NDArray[np.bool_]) -> None:
        self._share = CommandHold(timeout, ramp, period_ns)
        self._fading = fading
        self._given = np.zeros(len(fading))

    @property
    def lapses(self) -> int:
        """Number of times that commands were not renewed in time."""
        return self._share.lapses

    def renew(self, stamp_ns: int, command: Array) -> None:
        """Commands (joints,) that hold from `stamp_ns` on."""
        self._given = np.array(command, dtype=float)
        self._share.renew(stamp_ns, 1.0)

    def until(self, stamp_ns: int) -> list[tuple[int, Array]]:
        """The steps of the ramp up to `stamp_ns` that have not been returned yet."""
        return [(at, self.faded(share)) for at, share in self._share.until(stamp_ns)]

    def fill(self, stamp_ns: NDArray[np.int64], command: Array) -> tuple[NDArray[np.int64], Array]:
        """Commands (n, joints) with increasing stamps (n,), with the steps of the ramp added where they pause too
        long."""
        stamps: list[int] = []
        rows: list[Array] = []
        for at, row in zip(stamp_ns.tolist(), command):
            for down, value in self.until(at - 1):
                stamps.append(down)
                rows.append(value)
            stamps.append(at)
            rows.append(row)
            self.renew(at, row)
        return np.array(stamps, dtype=np.int64), np.array(rows).reshape(len(stamps), len(self._fading))

    def faded(self, share: float = 0.0) -> Array:
        """Faded commands: this share of the forces, and the references unchanged."""
        return np.where(self._fading, share * self._given, self._given)
