"""Design of experiments; `rhythmid.design(...)` calls `design.designer.design`."""

from rhythmid.callable_package import make_callable

make_callable(__name__)
