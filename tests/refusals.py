"""What a refusal says."""

from collections.abc import Callable

import pytest

from rhythmid.errors import InputError


def refusal(read: Callable[[], object]) -> str:
    with pytest.raises(InputError) as caught:
        read()
    return str(caught.value)
