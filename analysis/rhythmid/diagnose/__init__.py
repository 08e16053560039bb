"""Search for the physics that a model lacks; `rhythmid.diagnose(...)` calls `diagnose.diagnosis.diagnose`."""

from rhythmid.callable_package import make_callable

make_callable(__name__)
