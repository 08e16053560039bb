"""Comparison of a simulation's record with a real one; `rhythmid.compare(...)` calls `compare.compare.compare`."""

from rhythmid.callable_package import make_callable

make_callable(__name__)
