"""Effect of an element along a known trajectory: its force, or its change of a signal.

The trajectory is not changed. That is exact to first order in the size of the effect, which is enough to select the
elements that need a full simulation. Compiled once per element, for all models.
"""

from collections.abc import Callable, Hashable, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rhythmid.elements.element import DISSIPATIVE, ELAPSED, LEADING, STEP, Element
from rhythmid.errors import InputError
from rhythmid.model import Model
from rhythmid.simulation.kernel_source import kernel_module
from rhythmid.simulation.machine_code import Module, load_run

Array = NDArray[np.float64]
# further inputs of the kernel by the element's kind of action
FURTHER = {"transmission": ("load",), "constraint": ("acceleration",)}
MAX_STEP = 2.5e-4  # [s] for the element's own states; memory states take one step per sample


@dataclass(frozen=True)
class Path:
    """A trajectory: arrays (n,) of time [s], position, velocity, actuator force, leg force, and the input signal of
    a command, actuator or sensor element.

    `load` is the load of a gear besides the actuator force; where it is not given, it is computed from the model's
    forces along the path. Where no `acceleration` is given, it is the derivative of the velocity.
    """

    time: Array
    position: Array
    velocity: Array
    effort: Array
    leg: Array
    signal: Array
    load: Array | None = None
    acceleration: Array | None = None

    @property
    def slope(self) -> Array:
        """The acceleration (n,)."""
        return np.gradient(self.velocity, self.time) if self.acceleration is None else self.acceleration


@dataclass(frozen=True)
class _Lines:
    """Lines that evaluate one element along a trajectory; `s` are its states, of which the first ones are `flowing`."""

    element: Element

    @property
    def p(self) -> list[str]:
        return [f"p{i}" for i in range(len(self.element.parameters) + len(self.element.borrows))]

    @property
    def s(self) -> list[str]:
        return [f"s{i}" for i in range(len(self.element.own))]

    @property
    def flowing(self) -> int:
        return len(self.element.states)

    @property
    def rows(self) -> list[str]:
        """Names of the path's rows."""
        return ["x", "v", "f", "leg", "z", *FURTHER.get(self.element.acts, ())]

    @property
    def change(self) -> str:
        """What the element changes, given its `value`."""
        if self.element.slot == "force":
            return "value - leg" if self.element.acts == "modifier" else "value"
        return "value - z"

    def call(self, at: str, number: int, states: list[str], elapsed: str) -> list[str]:
        """Evaluate the element at this share of the way to the next sample."""
        element = self.element
        signal = {"force": "", "command": "f", "actuator": "f"}.get(element.slot, "y")
        arguments = ["z" if name == signal else name for name in LEADING[element.slot, element.acts]]
        sources = [
            *(parameter.name for parameter in element.parameters),
            *(source for source, _ in element.borrows.values()),
        ]
        given = [elapsed if source == ELAPSED else name for name, source in zip(self.p, sources)]
        targets = ", ".join(["value", *(f"a{number}_{i}" for i in range(len(self.s)))])
        return [
            "; ".join(f"{name} = {name}0 + {at} * ({name}1 - {name}0)" for name in self.rows),
            f"t = begin + {at} * width",
            f"{targets} = kernel({', '.join([*arguments, *given, *states])})",
        ]

    def _moved(self, weight: str, number: int) -> list[str]:
        return [
            f"{name} + {weight} * a{number}_{i}" if i < self.flowing else name
            for i, name in enumerate(self.s)
        ]

    @property
    def substep(self) -> list[str]:
        """One step of the states: Runge-Kutta for the flowing ones, then the memories."""
        call, s = self.call, self.s
        lines = [
            "at = substep / substeps", *call("at", 1, s, "0.0"),
            "at = (substep + 0.5) / substeps",
            *call("at", 2, self._moved("0.5 * h", 1), "0.5 * h"), *call("at", 3, self._moved("0.5 * h", 2), "0.5 * h"),
            "at = (substep + 1.0) / substeps", *call("at", 4, self._moved("h", 3), "h"),
            *(f"{n} = {n} + h / 6.0 * (a1_{i} + 2.0 * (a2_{i} + a3_{i}) + a4_{i})" for i, n in enumerate(s[: self.flowing])),
        ] if self.flowing else ["at = 1.0"]  # fmt: skip
        if self.element.memories:
            lines += [*call("at", 1, s, "h"), *(f"s{i} = a1_{i}" for i in range(self.flowing, len(s)))]
        return lines

    @property
    def steps(self) -> list[str]:
        """All steps of the states to the next sample."""
        if not self.s:
            return []
        number = "max(1, int(math.ceil(width / max_step * (1.0 - 1e-9))))" if self.flowing else "1"
        return [
            f"substeps = {number}",
            "h = width / substeps",
            "for substep in range(substeps):",
            *(f"    {line}" for line in self.substep),
        ]

    @property
    def first(self) -> list[str]:
        """The change at the first sample."""
        return [
            "begin = time[0]; width = 0.0",
            *(f"{name}0 = path[{i}, 0]; {name}1 = path[{i}, 0]" for i, name in enumerate(self.rows)),
            *self.call("0.0", 1, self.s, "0.0"),
            f"out[0] = {self.change}",
        ]

    @property
    def next(self) -> list[str]:
        """The change at the sample k."""
        return [
            "begin = time[k - 1]; width = time[k] - time[k - 1]",
            *(f"{name}0 = path[{i}, k - 1]; {name}1 = path[{i}, k]" for i, name in enumerate(self.rows)),
            *self.steps,
            *self.call("1.0", 1, self.s, "0.0"),
            f"out[k] = {self.change}",
        ]


def _module(element: Element) -> Module:
    kernel, lines = kernel_module(element), _Lines(element)
    text = "\n".join(
        [
            '"""Generated by rhythmid: one element along a given trajectory."""',
            "import math",
            "",
            "from numba import njit",
            f"from {kernel.name} import {element.name} as kernel",
            "",
            '@njit("void(float64[::1], float64[:, ::1], float64[::1], float64[::1], float64, float64[::1])",',
            '      cache=True, nogil=True, error_model="numpy")',
            "def run(time, path, parameters, states, max_step, out):",
            *(f"    {name} = parameters[{i}]" for i, name in enumerate(lines.p)),
            *(["    yielding = 0.0"] if element.acts == "constraint" else []),
            *(f"    {name} = states[{i}]" for i, name in enumerate(lines.s)),
            *(f"    {line}" for line in lines.first),
            "    for k in range(1, time.shape[0]):",
            *(f"        {line}" for line in lines.next),
            "",
        ]
    )
    return Module(text, (kernel,))


@dataclass(frozen=True, eq=False)
class _Any:
    """An element that is not part of the cache's key: elements that differ in names and bounds share one compiled
    function."""

    element: Element

    def __hash__(self) -> int:
        return 0

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Any)


@lru_cache(maxsize=256)
def _run(key: Hashable, one: _Any) -> Callable[..., Any]:
    return load_run(_module(one.element))


def _run_of(element: Element) -> Callable[..., Any]:
    """The compiled function of an element; kernels are compared by the content of their code, borrowed parameters
    by name."""
    key = (
        element.name, element.slot, element.acts, element.states, element.memories, tuple(element.borrows.items()),
        tuple(parameter.name for parameter in element.parameters), getattr(element.kernel, "__code__", None),
    )  # fmt: skip
    return _run(key, _Any(element))


def effect_along(
    element: Element, values: Mapping[str, float], model: Model, path: Path, max_step: float = MAX_STEP
) -> Array:
    """Force (n,) that the element adds on the mass along the path; for a command, actuator or sensor element the
    change of its signal.

    An element's own states take steps of at most `max_step` [s]. Parameters that the element borrows come from
    `model`. Raises InputError when the model lacks one, when one of the element's own has no value, and for an
    element that depends on the past, which needs a simulation.
    """
    if element.history:
        raise InputError(
            f"element {element.name!r} acts on the past of a signal: it is simulated, not read off a motion"
        )
    borrowed = {
        name: max_step if source == STEP else model.borrowed(source, default)
        for name, (source, default) in element.borrows.items()
    }
    missing = [element.borrows[name][0] for name, value in borrowed.items() if value is None]
    if missing:
        raise InputError(f"element {element.name!r} needs {missing[0]!r}, which the model does not have")
    parameters = []
    for parameter in element.parameters:
        value = values.get(parameter.name, parameter.default)
        if value is None:
            raise InputError(f"element {element.name!r}: parameter {parameter.name!r} needs a value")
        parameters.append(value)
    states = np.zeros(len(element.own))
    if element.own and element.initial is not None:
        first = path.signal[0] if element.slot == "sensor" else path.position[0]
        given = {p.name: v for p, v in zip(element.parameters, parameters, strict=True)} | borrowed
        signal = path.effort[0] if element.slot == "force" else path.signal[0]
        states[:] = element.initial(float(first), float(path.velocity[0]), float(signal), **given)
    known = [path.position, path.velocity, path.effort, path.leg, path.signal]
    if element.acts == "transmission":
        known.append(load_along(model, path))
    elif element.acts == "constraint":
        known.append(path.slope)
    rows = np.array(known, dtype=float)
    out = np.empty(len(path.time))
    _run_of(element)(
        np.ascontiguousarray(path.time), rows, np.array([*parameters, *borrowed.values()], dtype=float), states,
        max_step, out,
    )  # fmt: skip
    return out


def past_modifiers(force: Array, model: Model, path: Path) -> Array:
    """The part (n,) of a further leg force that reaches the mass: modifiers of the model, such as a loss of contact, act on it, too.

    Exact for modifiers that are affine in the leg's force, to first order for others.
    """
    without, beside = path.leg, path.leg + force
    for term in model.terms:
        if term.element.slot == "force" and term.element.acts == "modifier":
            without, beside = (
                leg + effect_along(term.element, term.numbers, model, replace(path, leg=leg))
                for leg in (without, beside)
            )
    return beside - without


def load_along(model: Model, path: Path) -> Array:
    """The load (n,) of a gear besides the actuator force: that of the path, else the sum of the model's forces
    along it without losses."""
    if path.load is not None:
        return path.load
    total = np.zeros(len(path.time))
    for term in model.terms:
        element = term.element
        if element.slot != "force" or element.kernel is None or element.family in DISSIPATIVE:
            continue
        if element.acts in ("leg", "body"):
            values = term.numbers
            total += effect_along(element, values, model, path)
    return total
