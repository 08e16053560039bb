"""The equations of a model as source text: element kernels composed into one Runge-Kutta loop.

The classical fourth-order Runge-Kutta method (E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential
Equations I, section II.1) with a fixed largest step. A step never crosses a sample time or a jump of the command, so
its order holds for held commands; where a damper switches, the force is continuous and only its slope jumps, which
costs a local error of second order in a step too short to matter (tested against an adaptive reference). What elements
remember changes at the two ends of a step, the second of which takes one more evaluation.

The text of every kernel goes into the generated module as it stands in its file.
"""

import inspect
import textwrap
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from rhythmid.elements.element import ELAPSED, STEP, Element
from rhythmid.errors import InputError
from rhythmid.model import INERTIA, Model, Term

InputKind = Literal["force", "base_displacement", "base_acceleration", "reference"]
OutputKind = Literal["position", "velocity", "acceleration"]
DRIVES: tuple[InputKind, ...] = ("force", "reference")  # inputs that go through the command path


@dataclass(frozen=True)
class Layout:
    """Where everything stands in the compiled function's arrays.

    `parameters[i]` is the model parameter at index i of the parameter vector, with its value when the model lacks it;
    `states` names the state vector: position, velocity, then the elements' own states and memories; `memories` are the
    places of the latter. An output row holds the states, then the sensor's output, then the total actuator force.
    """

    parameters: tuple[tuple[str, float | None], ...]
    states: tuple[str, ...]
    memories: tuple[int, ...] = ()

    def vector(self, model: Model) -> NDArray[np.float64]:
        """Parameter vector of a model with this structure."""
        known = model.parameters
        return np.array(
            [known[name].value if name in known else default for name, default in self.parameters],
            dtype=float,
        )


@lru_cache(maxsize=256)
def _text_of(kernel: Callable[..., Any]) -> str:
    return textwrap.dedent(inspect.getsource(kernel))


def kernel_source(element: Element, name: str) -> str:
    """Source text of an element's kernel as a function called `name`. Raises InputError when it has none to read."""
    assert element.kernel is not None
    try:
        source = _text_of(element.kernel)
    except (OSError, TypeError) as error:
        raise InputError(
            f"element {element.name!r}: its kernel's source text cannot be read ({error})"
        ) from None
    if not source.lstrip().startswith("def "):
        raise InputError(f"element {element.name!r}: its kernel must be a plain function written with def")
    return source.replace(f"def {element.kernel.__name__}(", f"def {name}(", 1)


class _Writer:
    """Collects parameters, states and the lines of the right-hand side while walking along the signal path."""

    def __init__(self) -> None:
        self.parameters: dict[str, float | None] = {INERTIA: None}
        self.states = ["position", "velocity"]
        self.memories: list[int] = []
        self.lines: list[str] = []
        self.drive: list[str] = []  # depends on time alone, so it is computed once for equal times

    def _parameter(self, name: str, default: float | None = None) -> str:
        known = self.parameters.setdefault(name, default)
        if known is None or default is None:
            self.parameters[name] = None
        return f"p{list(self.parameters).index(name)}"

    def call(self, term: Term, arguments: list[str], result: str) -> None:
        element = term.element
        values = [self._parameter(f"{term.label}.{parameter.name}") for parameter in element.parameters]
        values += [self._parameter(source, default) for source, default in element.borrows.values()]
        states, rates = [], []
        for state in element.own:
            states.append(f"s{len(self.states)}")
            rates.append(f"d{len(self.states)}")
            if state in element.memories:
                self._parameter(ELAPSED, 1e-3)
                self.memories.append(len(self.states))
            self.states.append(f"{term.label}.{state}")
        targets = ", ".join([result, *rates])
        self.lines.append(f"{targets} = {element.name}({', '.join([*arguments, *values, *states])})")


def _right_hand_side(
    terms: tuple[Term, ...], excited: InputKind, disturbed: bool, measured: OutputKind
) -> _Writer:
    writer = _Writer()
    kernels = [term for term in terms if term.element.kernel is not None]
    force = [term for term in kernels if term.element.slot == "force"]
    writer.lines.append("f = u" if excited in DRIVES else "f = 0.0")
    command = [term for term in kernels if term.element.slot == "command" and excited in DRIVES]
    for term in sorted(
        command, key=lambda term: term.element.acts == "feedback"
    ):  # the controller gets what is left of u
        writer.call(term, ["f", "s0", "s1", "t"] if term.element.acts == "feedback" else ["f", "t"], "f")
    writer.lines.append("f = f + w")
    for term in (term for term in force if term.element.acts == "drive"):
        if term.element.own:
            raise InputError(f"element {term.label!r}: a drive depends on time alone and cannot have states")
        writer.call(term, ["t"], "part")
        writer.drive += [writer.lines.pop(), "w = w + part"]
    for term in (term for term in kernels if term.element.slot == "actuator"):
        writer.call(term, ["f", "t"], "f")
    writer.lines.append("leg = 0.0")
    writer.lines.append("body = 0.0")
    for acts in ("leg", "body"):
        for term in (term for term in force if term.element.acts == acts):
            moved = excited == "base_displacement" and acts == "leg"
            writer.call(term, ["s0 - u", "s1 - du", "t", "f"] if moved else ["s0", "s1", "t", "f"], "part")
            writer.lines.append(f"{acts} = {acts} + part")
    for term in (term for term in force if term.element.acts == "modifier"):
        at = ["s0 - u", "s1 - du"] if excited == "base_displacement" else ["s0", "s1"]
        writer.call(term, ["leg", *at, "t", "f"], "leg")
    writer.lines.append(
        "absolute = (f + leg + body + d) / p0" if disturbed else "absolute = (f + leg + body) / p0"
    )
    writer.lines.append(
        {"position": "y = s0", "velocity": "y = s1", "acceleration": "y = absolute"}[measured]
    )
    for term in (term for term in kernels if term.element.slot == "sensor"):
        writer.call(term, ["y", "t"], "y")
    return writer


def _indent(lines: list[str], depth: int) -> str:
    return "\n".join("    " * depth + line for line in lines)


def generate(
    terms: tuple[Term, ...],
    disturbed: bool = False,
    excited: InputKind = "force",
    smooth: bool = False,
    measured: OutputKind = "position",
) -> tuple[str, Layout]:
    """Source text of the module for this list of terms, and the layout of its arrays.

    `excited` says what the command is: a force on the mass; the reference of a controller in the command path; the
    displacement of the base that the leg stands on; or the base's acceleration, where position and velocity are
    relative to the base. Steps end at the command's knots, where a held command jumps, unless it is `smooth`.
    `measured` is what the sensor sees; an acceleration is the mass's own, whatever the base does.
    """
    writer = _right_hand_side(terms, excited, disturbed, measured)
    n, memories = len(writer.states), writer.memories
    p = ", ".join(f"p{i}" for i in range(len(writer.parameters)))
    s = ", ".join(f"s{i}" for i in range(n))
    total = "absolute - u" if excited == "base_acceleration" else "absolute"
    known = ", ".join(
        ["t, u, w", *(["du"] if excited == "base_displacement" else []), *(["d"] if disturbed else [])]
    )
    rates = ", ".join(["s1", total, *(f"d{i}" for i in range(2, n))])
    sources: dict[str, str] = {}
    for term in terms:
        if term.element.kernel is not None:
            sources[term.element.name] = "@njit(error_model='numpy')\n" + kernel_source(
                term.element, term.element.name
            )

    def inputs(at: str) -> list[str]:
        """Command u and forcing w at time `at`, within the pieces found before."""
        return [
            f"x = {at} - tu; u = ((c3 * x + c2) * x + c1) * x + c0",
            *(["du = (3.0 * c3 * x + 2.0 * c2) * x + c1"] if excited == "base_displacement" else []),
            f"x = {at} - tw; w = ((e3 * x + e2) * x + e1) * x + e0",
            *(line.replace("(t,", f"({at},") for line in writer.drive),
            *([f"x = {at} - td; d = ((g3 * x + g2) * x + g1) * x + g0"] if disturbed else []),
        ]

    def stage(number: int, time: str, weight: str, elapsed: str) -> str:
        at = [
            f"s{i} + {weight} * a{number - 1}_{i}" if weight and i not in memories else f"s{i}"
            for i in range(n)
        ]
        targets = ", ".join([*(f"a{number}_{i}" for i in range(n)), "y", "f"])
        arguments = ", ".join([time, *known.split(", ")[1:], *at])
        given = ", ".join(elapsed if name == ELAPSED else f"p{i}" for i, name in enumerate(writer.parameters))
        return f"{targets} = rhs({arguments}, {given})"

    remember = [f"s{i} = a1_{i}" for i in memories]
    piece_u = "tu = ku[i]; c0 = cu[0, i]; c1 = cu[1, i]; c2 = cu[2, i]; c3 = cu[3, i]"
    piece_w = "tw = kw[j]; e0 = cw[0, j]; e1 = cw[1, j]; e2 = cw[2, j]; e3 = cw[3, j]"
    piece_d = "td = kd[l]; g0 = cd[0, l]; g1 = cd[1, l]; g2 = cd[2, l]; g3 = cd[3, l]"

    def following(at: str) -> list[str]:
        """Find the pieces of smooth signals at a time: no step ends at their knots."""
        found = [f"while kw[j + 1] <= {at}:", "    j += 1", piece_w]
        if smooth:
            found += [f"while ku[i + 1] <= {at}:", "    i += 1", piece_u]
        if disturbed:
            found += [f"while kd[l + 1] <= {at}:", "    l += 1", piece_d]
        return found

    find = ["while ku[i + 1] <= t:", "    i += 1", piece_u, *following("t")]
    step = [  # the stages at the half step share their inputs, and so do the end of a step and the next one's begin
        stage(1, "t", "", "0.0"),
        *remember,  # a jump of the command
        *following("t + half"),
        *inputs("t + half"),
        stage(2, "t + half", "half", "half"),
        stage(3, "t + half", "half", "half"),
        "t = begin + (substep + 1) * h",
        *following("t"),
        *inputs("t"),
        stage(4, "t", "h", "h"),
        *(
            f"s{i} = s{i} + h / 6.0 * (a1_{i} + 2.0 * (a2_{i} + a3_{i}) + a4_{i})"
            for i in range(n)
            if i not in memories
        ),
        *([stage(1, "t", "", "h"), *remember] if memories else []),
    ]
    record = [
        *find,
        *inputs("t"),
        stage(1, "t", "", "0.0"),
        *(f"out[k, {i}] = s{i}" for i in range(n)),
        f"out[k, {n}] = y",
        f"out[k, {n + 1}] = f",
    ]
    values = [
        f"p{i} = {'max_step' if name == STEP else f'parameters[{i}]'}"
        for i, name in enumerate(writer.parameters)
    ]
    text = f'''"""Generated by rhythmid: the right-hand side of one model structure and its Runge-Kutta loop."""
import math

from numba import njit

{chr(10).join(sources.values())}

@njit(error_model="numpy")
def rhs({known}, {s}, {p}):
{_indent(writer.lines, 1)}
    return {rates}, y, f


@njit(
    "int64(float64[::1], float64[::1], float64[:, ::1], float64[::1], float64[:, ::1], float64[::1], float64[:, ::1],"
    " float64[::1], float64[::1], float64, float64[:, ::1])",
    cache=True, nogil=True, error_model="numpy",
)
def run(times, ku, cu, kw, cw, kd, cd, parameters, start, max_step, out):
{_indent(values, 1)}
{_indent([f"s{i} = start[{i}]" for i in range(n)], 1)}
    i = 0
    j = 0
    l = 0
    t = times[0]
    k = 0
{_indent(record, 1)}
    for k in range(1, times.shape[0]):
        end = times[k]
        while t < end:
{_indent(find, 3)}
            until = {"end" if smooth else "min(end, ku[i + 1])"}
            substeps = int(math.ceil((until - t) / max_step * (1.0 - 1e-9)))
            if substeps < 1:
                substeps = 1
            begin = t
            h = (until - begin) / substeps
            half = 0.5 * h
{_indent(inputs("t"), 3)}
            for substep in range(substeps):
{_indent(step, 4)}
            t = until
{_indent(record, 2)}
        if not math.isfinite(s0):
            return k
    return times.shape[0]
'''
    return text, Layout(tuple(writer.parameters.items()), tuple(writer.states), tuple(memories))


def generate_rates(terms: tuple[Term, ...], excited: InputKind = "force") -> tuple[str, Layout]:
    """Source text of a module whose `run` evaluates the right-hand side at given points, and the layout of its arrays."""
    text, layout = generate(terms, False, excited)
    writer = _right_hand_side(terms, excited, False, "position")
    n, p = len(layout.states), len(layout.parameters)
    targets = ", ".join(f"out[k, {i}]" for i in range(n + 2))
    known = "t, u, w, 0.0" if excited == "base_displacement" else "t, u, w"
    arguments = ", ".join(
        [known, *(f"states[k, {i}]" for i in range(n)), *(f"parameters[{i}]" for i in range(p))]
    )
    values = [f"p{i} = parameters[{i}]" for i in range(p)]
    elapsed = [name for name, _ in layout.parameters].index(ELAPSED) if layout.memories else -1
    follow = [f"out[k, {i}] = (out[k, {i}] - states[k, {i}]) / p{elapsed}" for i in layout.memories]
    right_hand_side = text.split("@njit(\n", 1)[0]
    return (
        f"""{right_hand_side}@njit(
    "int64(float64[::1], float64[::1], float64[::1], float64[:, ::1], float64[::1], float64[:, ::1])",
    cache=True, nogil=True, error_model="numpy",
)
def run(times, command, forcing, states, parameters, out):
{_indent(values, 1)}
    for k in range(times.shape[0]):
        t = times[k]
        u = command[k]
        w = forcing[k]
{_indent(writer.drive, 2)}
{_indent([f"{targets} = rhs({arguments})", *follow], 2)}
    return times.shape[0]
""",
        layout,
    )
