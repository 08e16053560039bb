"""Words with a sign bit: a servo's speed of -300 recorded as 32768 + 300, or its load of -32 as 1024 + 32.

Such a number is sign and magnitude in one word. It is not wrapped: near zero it jumps between 0 and the bit's value.
"""

import numpy as np
from numpy.typing import NDArray

BITS = range(7, 32)  # places of the sign that are looked for
LEVELS = 5  # least number of distinct values on either side, beside which a bit is no flag
# largest ratio of the variation of the signed values to that of the words: those jump by the bit at each change of sign
SMOOTHER = 0.5
CHANGES = 3  # least number of changes of the sign


def sign_bit_of(value: NDArray[np.float64]) -> int | None:
    """The place, counted from 0, of the bit that is the sign of the recorded words (n,); None where none is."""
    told = value[np.isfinite(value)]
    if len(told) < 2 or told.min() < 0.0 or np.any(told != np.floor(told)):
        return None
    top = float(told.max())
    bit = int(np.log2(top)) if top >= 1.0 else 0
    if bit not in BITS:
        return None
    negative = told >= 2.0**bit
    sides = (told[~negative], told[negative] - 2.0**bit)
    if any(len(np.unique(side)) < LEVELS for side in sides) or np.count_nonzero(np.diff(negative)) < CHANGES:
        return None
    varied = float(np.abs(np.diff(signed(told, bit))).sum())
    return bit if varied <= SMOOTHER * float(np.abs(np.diff(told)).sum()) else None


def signed(value: NDArray[np.float64], bit: int | None) -> NDArray[np.float64]:
    """Words (n,) with the sign in this bit as signed numbers (n,); ordinary numbers, without a bit, as they are."""
    if bit is None:
        return value
    size = 2.0**bit
    return np.where(value >= size, size - value, value)
