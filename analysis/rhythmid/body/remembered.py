"""Arrays that are computed once for the same numbers, as long as they do not fill the memory."""

import hashlib
from collections.abc import Callable, Hashable, Iterable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
MEMORY = 1e8  # bytes of the arrays that are kept: a body of six joints along 30 s at 1 kHz takes 1.4e6 for each link


class Remembered:
    """The latest arrays, by the numbers from which they follow; all are forgotten when they need more than `MEMORY`."""

    def __init__(self) -> None:
        self._known: dict[Hashable, Array] = {}

    def of(self, name: Hashable, numbers: Iterable[Array], compute: Callable[[], Array]) -> Array:
        """What `compute` gives, read-only: it depends on `name` and on these `numbers` alone."""
        digest = hashlib.blake2b(digest_size=16)
        for one in numbers:
            digest.update(np.ascontiguousarray(one, dtype=float).data)
        key = name, digest.digest()
        if (known := self._known.get(key)) is not None:
            return known
        made = compute()
        made.flags.writeable = False  # it is returned again
        if (len(self._known) + 1) * made.nbytes > MEMORY:
            self._known.clear()
        self._known[key] = made
        return made
