"""Estimation of parameters, delays and transfer functions; `rhythmid.identify(...)` calls `identify.identify.identify`."""

from rhythmid.callable_package import make_callable

make_callable(__name__)
