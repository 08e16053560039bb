"""The equations of a model as source text: element kernels combined in one Runge-Kutta loop.

The classical fourth-order Runge-Kutta method (E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential
Equations I, section II.1) with a fixed largest step. A step never crosses a sample time or a jump of the command,
so its order holds for held commands. Where a damper switches, the force is continuous and only its slope jumps.
This causes a local error of second order, in a step too short to matter (tested against an adaptive reference).
Memory states change at the two ends of a step; the second end takes one more evaluation.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhythmid.elements.element import ELAPSED, STEP
from rhythmid.model import Model, Term
from rhythmid.simulation.generated_history import HistoryLines
from rhythmid.simulation.kernel_source import INNER, history_module, kernel_module, pieces_module
from rhythmid.simulation.machine_code import Module
from rhythmid.simulation.right_hand_side import InputKind, RightHandSide, Variant, right_hand_side


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


@dataclass(frozen=True)
class _Lines:
    """The lines around a right-hand side: `p0`, … are its parameters, `s0`, … its states, `a1_0`, … rates of stage 1."""

    side: RightHandSide
    variant: Variant
    kernels: Mapping[str, Module]

    @property
    def n(self) -> int:
        """Number of states."""
        return len(self.side.states)

    @property
    def history(self) -> HistoryLines:
        """Lines for past signals."""
        return HistoryLines(tuple(self.side.delayed), self.variant.smooth)

    def _of_base(self, line: str) -> list[str]:
        return [line] if self.variant.excited == "base_displacement" else []

    def _of_disturbance(self, line: str) -> list[str]:
        return [line] if self.variant.disturbed else []

    @property
    def _signals(self) -> list[str]:
        """Arguments of the right-hand side after the time."""
        return ["u", "w", *self._of_base("du"), *self._of_disturbance("d")]

    def inputs(self, at: str) -> list[str]:
        """Command u and forcing w at time `at`, within the pieces found before."""
        return [
            f"u = value_at(ku, cu, i, {at})",
            *self._of_base(f"du = slope_at(ku, cu, i, {at})"),
            f"w = value_at(kw, cw, j, {at})",
            *(line.replace("(t,", f"({at},") for line in self.side.drive),
            *self._of_disturbance(f"d = value_at(kd, cd, l, {at})"),
        ]

    def following(self, at: str) -> list[str]:
        """Find the pieces of smooth signals at a time: no step ends at their knots."""
        return [
            f"j = piece_at(kw, j, {at})",
            *([f"i = piece_at(ku, i, {at})"] if self.variant.smooth else []),
            *self._of_disturbance(f"l = piece_at(kd, l, {at})"),
        ]

    @property
    def find(self) -> list[str]:
        """Find the pieces of all signals at the time t."""
        return [*([] if self.variant.smooth else ["i = piece_at(ku, i, t)"]), *self.following("t")]

    def stage(self, number: int, time: str, weight: str, elapsed: str, state: str = "s") -> str:
        """Evaluate the right-hand side at the states moved by `weight` times the rates of the stage before."""
        at = [
            f"s{i} + {weight} * a{number - 1}_{i}"
            if weight and i not in self.side.memories
            else f"{state}{i}"
            for i in range(self.n)
        ]
        targets = [*(f"a{number}_{i}" for i in range(self.n)), "y", "f", *self.history.returned]
        given = [elapsed if name == ELAPSED else f"p{i}" for i, name in enumerate(self.side.parameters)]
        arguments = [time, *self._signals, *at, *given, *self.history.given]
        return f"{', '.join(targets)} = rhs({', '.join(arguments)})"

    @property
    def step(self) -> list[str]:
        """One step; the stages at its middle share their inputs, as do its end and the start of the next."""
        history, memories = self.history, self.side.memories
        remember = [f"s{i} = a1_{i}" for i in memories]
        return [
            *history.look_up("t"),
            self.stage(1, "t", "", "0.0"),
            *history.keep(1),
            *remember,  # a jump of the command
            *self.following("t + half"),
            *self.inputs("t + half"),
            *history.look_up("t + half", within=True),
            self.stage(2, "t + half", "half", "half"),
            *history.keep(2),
            self.stage(3, "t + half", "half", "half"),
            *history.keep(3),
            "t = begin + (substep + 1) * h",
            *self.following("t"),
            *self.inputs("t"),
            *history.look_up("min(t, until)", within=True),
            self.stage(4, "t", "h", "h"),
            *history.keep(4),
            *(
                f"s{i} = s{i} + h / 6.0 * (a1_{i} + 2.0 * (a2_{i} + a3_{i}) + a4_{i})"
                for i in range(self.n)
                if i not in memories
            ),
            *([self.stage(1, "t", "", "h"), *remember] if memories else []),
            *history.next_row,
        ]

    @property
    def record(self) -> list[str]:
        """Write an output row at a sample time."""
        return [
            *self.find,
            *self.inputs("t"),
            *self.history.begun,
            *self.history.look_up("t"),
            self.stage(1, "t", "", "0.0"),
            *(f"out[k, {i}] = s{i}" for i in range(self.n)),
            f"out[k, {self.n}] = y",
            f"out[k, {self.n + 1}] = f",
        ]

    @property
    def before(self) -> list[str]:
        """The past before the first sample."""
        return self.history.before_the_start(
            self.n,
            self.side.memories,
            self.find,
            {at: [*self.following(at), *self.inputs(at)] for at in ("t", "t + half", "t + h")},
            self.stage(1, "at", "", "0.0", "z"),
        )

    @property
    def right_hand_side(self) -> str:
        """The text before the loop: imports, and the right-hand side as a function."""
        total = "absolute - u" if self.variant.excited == "base_acceleration" else "absolute"
        rates = ["s1", total, *(f"d{i}" for i in range(2, self.n))]
        states = [f"s{i}" for i in range(self.n)]
        parameters = [f"p{i}" for i in range(len(self.side.parameters))]
        helpers = "began, earlier, jump_until, row_at, row_until, with_room"
        past = f"import numpy as np\nfrom {history_module().name} import {helpers}\n"
        imports = "\n".join(f"from {module.name} import {name}" for name, module in self.kernels.items())
        return f'''"""Generated by rhythmid: the right-hand side of one model structure and its Runge-Kutta loop."""
import math

from numba import njit
from {pieces_module().name} import piece_at, slope_at, value_at
{past if self.history.signals else ""}{imports}


@njit({INNER})
def rhs({", ".join(["t", *self._signals, *states, *parameters, *self.history.given])}):
{_indent(self.side.lines, 1)}
    return {", ".join([*rates, "y", "f", *self.history.returned])}


'''

    @property
    def loop(self) -> str:
        """The text of the loop over samples and steps."""
        smooth, history = self.variant.smooth, self.history
        kept = bool(history.signals)
        result = "Tuple((int64, float64[:, ::1]))" if kept else "int64"
        rest = f", past[{history.oldest} : last + 1].copy()" if kept else ""
        until = "until = end" if smooth else "until = min(end, ku[i + 1])"
        values = [
            f"p{i} = {'max_step' if name == STEP else f'parameters[{i}]'}"
            for i, name in enumerate(self.side.parameters)
        ]
        return f'''@njit(
    "{result}(float64[::1], float64[::1], float64[:, ::1], float64[::1], float64[:, ::1], float64[::1], float64[:, ::1],"
    " float64[::1], float64[::1], float64, float64[:, ::1]{", float64[:, ::1]" if kept else ""})",
    cache=True, nogil=True, error_model="numpy",
)
def run(times, ku, cu, kw, cw, kd, cd, parameters, start, max_step, out{", past" if kept else ""}):
{_indent(values, 1)}
{_indent([f"s{i} = start[{i}]" for i in range(self.n)], 1)}
    i = 0
    j = 0
    l = 0
    t = times[0]
    k = 0
{_indent([*self.before, *self.record], 1)}
    for k in range(1, times.shape[0]):
        end = times[k]
        while t < end:
{_indent([*self.find, *history.begun, until, *(history.stops if kept else [])], 3)}
            substeps = int(math.ceil((until - t) / max_step * (1.0 - 1e-9)))
            if substeps < 1:
                substeps = 1
            begin = t
            h = (until - begin) / substeps
            half = 0.5 * h
{_indent(self.inputs("t"), 3)}
            for substep in range(substeps):
{_indent(self.step, 4)}
            t = until
{_indent(self.record, 2)}
        if not math.isfinite(s0):
            return k{rest}
    return times.shape[0]{rest}
'''


def _indent(lines: list[str], depth: int) -> str:
    return "\n".join("    " * depth + line for line in lines)


def _lines(terms: tuple[Term, ...], variant: Variant) -> _Lines:
    side = right_hand_side(terms, variant)
    kernels = {
        term.element.name: kernel_module(term.element) for term in terms if term.element.kernel is not None
    }
    return _Lines(side, variant, kernels)


def generate(terms: tuple[Term, ...], variant: Variant) -> tuple[Module, Layout]:
    """The module for this list of terms, and the layout of its arrays."""
    lines = _lines(terms, variant)
    side, history = lines.side, lines.history
    kept = bool(history.signals)
    imports = (pieces_module(), *((history_module(),) if kept else ()), *lines.kernels.values())
    layout = Layout(
        tuple(side.parameters.items()), tuple(side.states), tuple(side.memories), history.width if kept else 0
    )
    return Module(lines.right_hand_side + lines.loop, imports), layout


def generate_rates(terms: tuple[Term, ...], excited: InputKind = "force") -> tuple[Module, Layout]:
    """A module whose `run` evaluates the right-hand side at given points, with dead times as states, and its arrays' layout."""
    variant = Variant(excited, rational=True)
    (whole, layout), lines = generate(terms, variant), _lines(terms, variant)
    n, p = lines.n, len(layout.parameters)
    targets = ", ".join(f"out[k, {i}]" for i in range(n + 2))
    known = "t, u, w, 0.0" if excited == "base_displacement" else "t, u, w"
    arguments = ", ".join(
        [known, *(f"states[k, {i}]" for i in range(n)), *(f"parameters[{i}]" for i in range(p))]
    )
    values = [f"p{i} = parameters[{i}]" for i in range(p)]
    elapsed = list(lines.side.parameters).index(ELAPSED) if layout.memories else -1
    follow = [f"out[k, {i}] = (out[k, {i}] - states[k, {i}]) / p{elapsed}" for i in layout.memories]
    text = f"""{lines.right_hand_side}@njit(
    "int64(float64[::1], float64[::1], float64[::1], float64[:, ::1], float64[::1], float64[:, ::1])",
    cache=True, nogil=True, error_model="numpy",
)
def run(times, command, forcing, states, parameters, out):
{_indent(values, 1)}
    for k in range(times.shape[0]):
        t = times[k]
        u = command[k]
        w = forcing[k]
{_indent(lines.side.drive, 2)}
{_indent([f"{targets} = rhs({arguments})", *follow], 2)}
    return times.shape[0]
"""
    return Module(text, whole.imports), layout
