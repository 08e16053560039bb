"""Progress of long work: whoever carries it out is handed a function that is told what begins."""

from collections.abc import Callable

Tell = Callable[[str], None]
