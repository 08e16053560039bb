"""rhythmid finds out why a simulation disagrees with a robot: missing physics, parameters, delays and transfer functions, from recordings.

Start with `load`, `Model.load`, `identify` and `diagnose`; docs/python.md shows how they work together. Every name is imported when it is
first used, so that `import rhythmid` itself is fast.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rhythmid import mujoco
    from rhythmid.batch.batch import Batch, batch
    from rhythmid.compare.compare import Comparison, compare
    from rhythmid.design.designer import Design, design
    from rhythmid.design.requirements import Requirements
    from rhythmid.diagnose.diagnosis import Answer, diagnose
    from rhythmid.elements.catalogue import load_catalogue
    from rhythmid.errors import InputError
    from rhythmid.experiment import Experiment
    from rhythmid.identify.identification import Identification
    from rhythmid.identify.identify import identify, paper_hopper
    from rhythmid.model import Model
    from rhythmid.offline_run import OfflineRun, simulate
    from rhythmid.record.load import load
    from rhythmid.record.record import Record

__version__ = "0.1.0"
__all__ = [
    "Answer",
    "Batch",
    "Comparison",
    "Design",
    "Experiment",
    "Identification",
    "InputError",
    "Model",
    "OfflineRun",
    "Record",
    "Requirements",
    "__version__",
    "batch",
    "compare",
    "design",
    "diagnose",
    "identify",
    "load",
    "load_catalogue",
    "mujoco",
    "paper_hopper",
    "simulate",
]

_MODULES = {
    "Answer": "rhythmid.diagnose.diagnosis",
    "Batch": "rhythmid.batch.batch",
    "Comparison": "rhythmid.compare.compare",
    "Design": "rhythmid.design.designer",
    "Experiment": "rhythmid.experiment",
    "Identification": "rhythmid.identify.identification",
    "InputError": "rhythmid.errors",
    "Model": "rhythmid.model",
    "OfflineRun": "rhythmid.offline_run",
    "Record": "rhythmid.record.record",
    "Requirements": "rhythmid.design.requirements",
    "load": "rhythmid.record.load",
    "load_catalogue": "rhythmid.elements.catalogue",
    "paper_hopper": "rhythmid.identify.identify",
    "simulate": "rhythmid.offline_run",
}
_PACKAGES = (
    "batch",
    "compare",
    "design",
    "diagnose",
    "identify",
    "mujoco",
)  # all but the last can be called: see callable_package.py


def __getattr__(name: str) -> Any:
    if name in _PACKAGES:
        return import_module(f"rhythmid.{name}")
    if name not in _MODULES:
        raise AttributeError(f"module 'rhythmid' has no attribute {name!r}")
    found = globals()[name] = getattr(import_module(_MODULES[name]), name)
    return found


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
