"""Packages that can be called like their main function: `rhythmid.identify(records)`.

`rhythmid.identify` is a package, and Python binds the name to it as soon as one of its modules is imported. So that the same name
is the function for users, the package itself can be called, and shows the function's signature and docstring.
"""

import sys
from collections.abc import Callable
from importlib import import_module
from types import ModuleType
from typing import Any

FUNCTIONS = {
    "rhythmid.batch": "rhythmid.batch.batch",
    "rhythmid.compare": "rhythmid.compare.compare",
    "rhythmid.design": "rhythmid.design.designer",
    "rhythmid.diagnose": "rhythmid.diagnose.diagnosis",
    "rhythmid.identify": "rhythmid.identify.identify",
}  # the module that holds a package's function, which has the package's own name


class CallablePackage(ModuleType):
    """A package whose call is that of its main function."""

    @property
    def __wrapped__(self) -> Callable[..., Any]:
        """The function; `inspect.signature` and `help` follow it."""
        return getattr(import_module(FUNCTIONS[self.__name__]), self.__name__.rpartition(".")[2])

    def __call__(self, *arguments: Any, **options: Any) -> Any:
        return self.__wrapped__(*arguments, **options)


def make_callable(name: str) -> None:
    """Make a package that is being imported callable; `name` is its `__name__`."""
    sys.modules[name].__class__ = CallablePackage
