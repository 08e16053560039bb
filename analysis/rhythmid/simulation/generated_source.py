"""The equations of a model as source text: element kernels combined in one Runge-Kutta loop.

The classical fourth-order Runge-Kutta method (E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential
Equations I, section II.1) with a fixed largest step. A step never crosses a sample time or a jump of the command,
so its order holds for held commands. Where a damper switches, the force is continuous and only its slope jumps.
This causes a local error of second order, in a step too short to matter (tested against an adaptive reference).
Memory states change at the two ends of a step; the second end takes one more evaluation.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from rhythmid.elements.element import DISSIPATIVE, ELAPSED, STEP
from rhythmid.errors import InputError
from rhythmid.model import INERTIA, Model, Term
from rhythmid.simulation.generated_history import PADE, DelayedSignal, HistoryLines, rational_past
from rhythmid.simulation.kernel_source import INNER, history_module, kernel_module, pieces_module
from rhythmid.simulation.machine_code import Module

InputKind = Literal["force", "base_displacement", "base_acceleration", "reference"]
OutputKind = Literal["position", "velocity", "acceleration"]
DRIVES: tuple[InputKind, ...] = ("force", "reference")  # inputs that go through the command path


@dataclass(frozen=True)
class Layout:
    """Positions in the compiled function's arrays.

    `parameters[i]` is the model parameter at index i of the parameter vector, with its value when the model lacks
    it. `states` names the state vector: position, velocity, then the elements' own states and memory states;
    `memories` are the indices of the latter. `history` is the width of the stored past, 0 where none is stored. An
    output row holds the states, the sensor's output, and the total actuator force.
    """

    parameters: tuple[tuple[str, float | None], ...]
    states: tuple[str, ...]
    memories: tuple[int, ...] = ()
    history: int = 0

    def vector(self, model: Model) -> NDArray[np.float64]:
        """Parameter vector of a model with this structure."""
        known = model.parameters
        return np.array(
            [known[name].value if name in known else default for name, default in self.parameters],
            dtype=float,
        )


class _Writer:
    """Collects parameters, states and the lines of the right-hand side while walking along the signal path."""

    def __init__(self, rational: bool) -> None:
        self.rational = rational
        self.parameters: dict[str, float | None] = {INERTIA: None}
        self.states = ["position", "velocity"]
        self.memories: list[int] = []
        self.lines: list[str] = []
        self.delayed: list[DelayedSignal] = []
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
        past = [
            self._past(term, name, value)
            for name, value in zip(element.leading, arguments)
            if name in element.history
        ]
        targets = ", ".join([result, *rates])
        self.lines.append(f"{targets} = {element.name}({', '.join([*arguments, *values, *states, *past])})")

    def _past(self, term: Term, name: str, value: str) -> str:
        """A signal before the term's dead time: the value from the loop, and the share of the present value."""
        delay = self._parameter(f"{term.label}.{term.element.dead_time}")
        if self.rational:
            first = len(self.states)
            self.states += [f"{term.label}.past_{name}_{k}" for k in range(PADE)]
            past, lines = rational_past(value, delay, self._parameter(STEP, 1e-3), first)
            self.lines += lines
            return past
        m = len(self.delayed)
        self.delayed.append(DelayedSignal(delay, jumps=name == "f"))
        self.lines += [f"now{m} = {value}", f"past{m} = old{m} + share{m} * (now{m} - old{m})"]
        return f"past{m}"


@dataclass(frozen=True)
class Variant:
    """Properties besides the terms that determine the code.

    `excited` is the kind of the command: a force on the mass; the reference of a controller in the command path;
    the displacement of the base on which the leg stands; or the base's acceleration, where position and velocity
    are relative to the base. `measured` is the quantity of the sensor; an acceleration is absolute, whatever the
    base does. Steps end at the command's knots, where a held command jumps, unless it is `smooth`. With `disturbed`
    the code takes a further, arbitrary force on the mass as a signal. With `rational` dead times are approximated
    by states, see `rational_past`.
    """

    excited: InputKind = "force"
    measured: OutputKind = "position"
    smooth: bool = False
    disturbed: bool = False
    rational: bool = False


def _right_hand_side(terms: tuple[Term, ...], variant: Variant) -> _Writer:
    excited, disturbed = variant.excited, variant.disturbed
    if excited == "base_acceleration" and (room := [term for term in terms if term.against == "room"]):
        raise InputError(
            f"element {room[0].label!r} acts against the room, whose speed is unknown where only the base's acceleration is "
            "known; give its displacement, or leave out 'against: room'"
        )
    writer = _Writer(variant.rational)
    kernels = [term for term in terms if term.element.kernel is not None]
    force = [term for term in kernels if term.element.slot == "force"]
    writer.lines.append("f = u" if excited in DRIVES else "f = 0.0")
    command = [term for term in kernels if term.element.slot == "command" and excited in DRIVES]
    relative = ["s0 - u", "s1 - du"] if excited == "base_displacement" else ["s0", "s1"]
    seen = ["s0", "s1"]  # by controllers
    for term in (term for term in command if term.element.acts == "observation"):
        writer.call(term, [*seen, "t"], "seen, speed")
        seen = ["seen", "speed"]
    command = [term for term in command if term.element.acts != "observation"]
    for term in sorted(
        command, key=lambda term: term.element.acts == "feedback"
    ):  # the controller gets the rest of u
        writer.call(term, ["f", *seen, "t"] if term.element.acts == "feedback" else ["f", "t"], "f")
    writer.lines.append("f = f + w")
    for term in (term for term in force if term.element.acts == "drive"):
        if term.element.own:
            raise InputError(f"element {term.label!r}: a drive depends on time alone and cannot have states")
        writer.call(term, ["t"], "part")
        writer.drive += [writer.lines.pop(), "w = w + part"]
    for term in (term for term in kernels if term.element.slot == "actuator"):
        motion = relative if term.element.acts == "transducer" else []
        writer.call(term, ["f", *motion, "t"], "f")
    carried = any(term.element.acts == "transmission" for term in force)
    writer.lines += ["leg = 0.0", "body = 0.0", *(["load = 0.0"] if carried else [])]
    for acts, sum_of, at in (
        ("leg", "leg", relative),
        ("body", "body", ["s0", "s1"]),
        ("transmission", "leg", ["load", *relative]),
    ):
        for term in (term for term in force if term.element.acts == acts):
            writer.call(term, [*at, "t", "f"], "part")
            writer.lines.append(f"{sum_of} = {sum_of} + part")
            if carried and term.element.family not in DISSIPATIVE:
                writer.lines.append("load = load + part")
    for term in (term for term in force if term.element.acts == "modifier"):
        writer.call(term, ["leg", *relative, "t", "f"], "leg")
    total = "f + leg + body + d" if disturbed else "f + leg + body"
    constraints = [term for term in force if term.element.acts == "constraint"]
    _refuse_constraints(constraints, excited)
    for term in constraints:
        free = f"({total}) / p0 - u" if excited == "base_acceleration" else f"({total}) / p0"
        writer.call(term, [free, "1.0 / p0", *relative, "t", "f"], "part")
        writer.lines.append("body = body + part")
    writer.lines.append(f"absolute = ({total}) / p0")
    writer.lines.append(
        {"position": "y = s0", "velocity": "y = s1", "acceleration": "y = absolute"}[variant.measured]
    )
    for term in (term for term in kernels if term.element.slot == "sensor"):
        writer.call(term, ["y", "t"], "y")
    return writer


def _refuse_constraints(constraints: list[Term], excited: InputKind) -> None:
    """Raise InputError for constraints with an unknown acceleration: on a moving base, and for two constraints that
    share it."""
    if len(constraints) > 1:
        raise InputError(
            f"{constraints[0].label!r} and {constraints[1].label!r} both depend on the acceleration that both change; leave out one"
        )
    if constraints and excited == "base_displacement":
        raise InputError(
            f"element {constraints[0].label!r} depends on the acceleration relative to the base, which a base's displacement does "
            "not tell; give its acceleration"
        )


def _indent(lines: list[str], depth: int) -> str:
    return "\n".join("    " * depth + line for line in lines)


def generate(terms: tuple[Term, ...], variant: Variant) -> tuple[Module, Layout]:
    """The module for this list of terms, and the layout of its arrays."""
    excited, disturbed = variant.excited, variant.disturbed
    writer = _right_hand_side(terms, variant)
    n, memories = len(writer.states), writer.memories
    smooth = variant.smooth
    history = HistoryLines(tuple(writer.delayed), smooth)
    p = ", ".join(f"p{i}" for i in range(len(writer.parameters)))
    p = ", ".join([p, *history.given])
    s = ", ".join(f"s{i}" for i in range(n))
    total = "absolute - u" if excited == "base_acceleration" else "absolute"
    known = ", ".join(
        ["t, u, w", *(["du"] if excited == "base_displacement" else []), *(["d"] if disturbed else [])]
    )
    rates = ", ".join(["s1", total, *(f"d{i}" for i in range(2, n))])
    kernels = {
        term.element.name: kernel_module(term.element) for term in terms if term.element.kernel is not None
    }
    imports = [f"from {module.name} import {name}" for name, module in kernels.items()]

    def inputs(at: str) -> list[str]:
        """Command u and forcing w at time `at`, within the pieces found before."""
        return [
            f"u = value_at(ku, cu, i, {at})",
            *([f"du = slope_at(ku, cu, i, {at})"] if excited == "base_displacement" else []),
            f"w = value_at(kw, cw, j, {at})",
            *(line.replace("(t,", f"({at},") for line in writer.drive),
            *([f"d = value_at(kd, cd, l, {at})"] if disturbed else []),
        ]

    def stage(number: int, time: str, weight: str, elapsed: str, state: str = "s") -> str:
        at = [
            f"s{i} + {weight} * a{number - 1}_{i}" if weight and i not in memories else f"{state}{i}"
            for i in range(n)
        ]
        targets = ", ".join([*(f"a{number}_{i}" for i in range(n)), "y", "f", *history.returned])
        arguments = ", ".join([time, *known.split(", ")[1:], *at])
        given = ", ".join(elapsed if name == ELAPSED else f"p{i}" for i, name in enumerate(writer.parameters))
        return f"{targets} = rhs({', '.join([arguments, given, *history.given])})"

    remember = [f"s{i} = a1_{i}" for i in memories]

    def following(at: str) -> list[str]:
        """Find the pieces of smooth signals at a time: no step ends at their knots."""
        return [
            f"j = piece_at(kw, j, {at})",
            *([f"i = piece_at(ku, i, {at})"] if smooth else []),
            *([f"l = piece_at(kd, l, {at})"] if disturbed else []),
        ]

    find = [*([] if smooth else ["i = piece_at(ku, i, t)"]), *following("t")]
    # the stages at the half step share their inputs, as do the end of a step and the start of the next
    step = [
        *history.look_up("t"),
        stage(1, "t", "", "0.0"),
        *history.keep(1),
        *remember,  # a jump of the command
        *following("t + half"),
        *inputs("t + half"),
        *history.look_up("t + half", within=True),
        stage(2, "t + half", "half", "half"),
        *history.keep(2),
        stage(3, "t + half", "half", "half"),
        *history.keep(3),
        "t = begin + (substep + 1) * h",
        *following("t"),
        *inputs("t"),
        *history.look_up("min(t, until)", within=True),
        stage(4, "t", "h", "h"),
        *history.keep(4),
        *(
            f"s{i} = s{i} + h / 6.0 * (a1_{i} + 2.0 * (a2_{i} + a3_{i}) + a4_{i})"
            for i in range(n)
            if i not in memories
        ),
        *([stage(1, "t", "", "h"), *remember] if memories else []),
        *history.next_row,
    ]
    record = [
        *find,
        *inputs("t"),
        *history.begun,
        *history.look_up("t"),
        stage(1, "t", "", "0.0"),
        *(f"out[k, {i}] = s{i}" for i in range(n)),
        f"out[k, {n}] = y",
        f"out[k, {n + 1}] = f",
    ]
    values = [
        f"p{i} = {'max_step' if name == STEP else f'parameters[{i}]'}"
        for i, name in enumerate(writer.parameters)
    ]
    before = history.before_the_start(
        n,
        memories,
        find,
        {at: [*following(at), *inputs(at)] for at in ("t", "t + half", "t + h")},
        stage(1, "at", "", "0.0", "z"),
    )
    kept = history.signals
    helpers = "began, earlier, jump_until, row_at, row_until, with_room"
    head = f"import numpy as np\nfrom {history_module().name} import {helpers}\n" if kept else ""
    signature = " float64[::1], float64[::1], float64, float64[:, ::1]" + (
        ", float64[:, ::1])" if kept else ")"
    )
    result = "Tuple((int64, float64[:, ::1]))" if kept else "int64"

    def returned(rows: str) -> str:
        return f"return {rows}, past[{history.oldest} : last + 1].copy()" if kept else f"return {rows}"

    text = f'''"""Generated by rhythmid: the right-hand side of one model structure and its Runge-Kutta loop."""
import math

from numba import njit
from {pieces_module().name} import piece_at, slope_at, value_at
{head}{chr(10).join(imports)}


@njit({INNER})
def rhs({known}, {s}, {p}):
{_indent(writer.lines, 1)}
    return {", ".join([rates, "y", "f", *history.returned])}


@njit(
    "{result}(float64[::1], float64[::1], float64[:, ::1], float64[::1], float64[:, ::1], float64[::1], float64[:, ::1],"
    "{signature}",
    cache=True, nogil=True, error_model="numpy",
)
def run(times, ku, cu, kw, cw, kd, cd, parameters, start, max_step, out{", past" if kept else ""}):
{_indent(values, 1)}
{_indent([f"s{i} = start[{i}]" for i in range(n)], 1)}
    i = 0
    j = 0
    l = 0
    t = times[0]
    k = 0
{_indent([*before, *record], 1)}
    for k in range(1, times.shape[0]):
        end = times[k]
        while t < end:
{_indent([*find, *history.begun], 3)}
            until = {"end" if smooth else "min(end, ku[i + 1])"}
{_indent([*history.stops, ""], 3)[:-12] if kept else ""}            substeps = int(math.ceil((until - t) / max_step * (1.0 - 1e-9)))
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
            {returned("k")}
    {returned("times.shape[0]")}
'''
    imports_of = (pieces_module(), *((history_module(),) if kept else ()), *kernels.values())
    layout = Layout(
        tuple(writer.parameters.items()), tuple(writer.states), tuple(memories), history.width if kept else 0
    )
    return Module(text, imports_of), layout


def generate_rates(terms: tuple[Term, ...], excited: InputKind = "force") -> tuple[Module, Layout]:
    """A module whose `run` evaluates the right-hand side at given points, with dead times as states, and its arrays' layout."""
    variant = Variant(excited, rational=True)
    (whole, layout), writer = generate(terms, variant), _right_hand_side(terms, variant)
    n, p = len(layout.states), len(layout.parameters)
    targets = ", ".join(f"out[k, {i}]" for i in range(n + 2))
    known = "t, u, w, 0.0" if excited == "base_displacement" else "t, u, w"
    arguments = ", ".join(
        [known, *(f"states[k, {i}]" for i in range(n)), *(f"parameters[{i}]" for i in range(p))]
    )
    values = [f"p{i} = parameters[{i}]" for i in range(p)]
    elapsed = [name for name, _ in layout.parameters].index(ELAPSED) if layout.memories else -1
    follow = [f"out[k, {i}] = (out[k, {i}] - states[k, {i}]) / p{elapsed}" for i in layout.memories]
    right_hand_side = whole.text.split("@njit(\n", 1)[0]
    text = f"""{right_hand_side}@njit(
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
"""
    return Module(text, whole.imports), layout
