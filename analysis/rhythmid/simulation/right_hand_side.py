"""The right-hand side of a model's equations as source text: the kernels of its elements, called along the signal path."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

from rhythmid.elements.element import DISSIPATIVE, ELAPSED, STEP
from rhythmid.errors import InputError
from rhythmid.model import INERTIA, Term
from rhythmid.simulation.generated_history import PADE, DelayedSignal, rational_past

InputKind = Literal["force", "base_displacement", "base_acceleration", "reference"]
OutputKind = Literal["position", "velocity", "acceleration"]
DRIVES: tuple[InputKind, ...] = ("force", "reference")  # inputs that go through the command path


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


class RightHandSide:
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


def right_hand_side(terms: tuple[Term, ...], variant: Variant) -> RightHandSide:
    """Walk along the signal path. Raises InputError for terms that cannot act together or on this input."""
    excited = variant.excited
    if excited == "base_acceleration" and (room := [term for term in terms if term.against == "room"]):
        raise InputError(
            f"element {room[0].label!r} acts against the room, whose speed is unknown where only the base's acceleration is "
            "known; give its displacement, or leave out 'against: room'"
        )
    writer = RightHandSide(variant.rational)
    kernels = [term for term in terms if term.element.kernel is not None]
    force = [term for term in kernels if term.element.slot == "force"]
    relative = ["s0 - u", "s1 - du"] if excited == "base_displacement" else ["s0", "s1"]
    writer.lines.append("f = u" if excited in DRIVES else "f = 0.0")
    if excited in DRIVES:
        along_command(kernels, ["s0", "s1"], writer.call)
    writer.lines.append("f = f + w")
    for term in (term for term in force if term.element.acts == "drive"):
        if term.element.own:
            raise InputError(f"element {term.label!r}: a drive depends on time alone and cannot have states")
        writer.call(term, ["t"], "part")
        writer.drive += [writer.lines.pop(), "w = w + part"]
    for term in (term for term in kernels if term.element.slot == "actuator"):
        motion = relative if term.element.acts == "transducer" else []
        writer.call(term, ["f", *motion, "t"], "f")
    _forces(writer, force, relative)
    _acceleration(writer, [term for term in force if term.element.acts == "constraint"], relative, variant)
    writer.lines.append(
        {"position": "y = s0", "velocity": "y = s1", "acceleration": "y = absolute"}[variant.measured]
    )
    for term in (term for term in kernels if term.element.slot == "sensor"):
        writer.call(term, ["y", "t"], "y")
    return writer


def along_command(
    terms: Iterable[Term], seen: list[str], call: Callable[[Term, list[str], str], None]
) -> None:
    """Call the elements of the command path on `f`; controllers observe the motion `seen` and get the rest of `f` last."""
    command = [term for term in terms if term.element.slot == "command"]
    for term in (term for term in command if term.element.acts == "observation"):
        call(term, [*seen, "t"], "seen, speed")
        seen = ["seen", "speed"]
    others = [term for term in command if term.element.acts != "observation"]
    for term in sorted(others, key=lambda term: term.element.acts == "feedback"):
        call(term, ["f", *seen, "t"] if term.element.acts == "feedback" else ["f", "t"], "f")


def _forces(writer: RightHandSide, force: Sequence[Term], relative: list[str]) -> None:
    """The forces on leg and body; a transmission gets the load of the forces without losses."""
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


def _acceleration(
    writer: RightHandSide, constraints: list[Term], relative: list[str], variant: Variant
) -> None:
    """The absolute acceleration, with the force of a constraint on the acceleration that it would have without."""
    _refuse_constraints(constraints, variant.excited)
    total = "f + leg + body + d" if variant.disturbed else "f + leg + body"
    for term in constraints:
        free = f"({total}) / p0 - u" if variant.excited == "base_acceleration" else f"({total}) / p0"
        writer.call(term, [free, "1.0 / p0", *relative, "t", "f"], "part")
        writer.lines.append("body = body + part")
    writer.lines.append(f"absolute = ({total}) / p0")


def _refuse_constraints(constraints: list[Term], excited: InputKind) -> None:
    """Raise InputError for constraints with an unknown acceleration: on a moving base, and for two constraints that
    share it."""
    if len(constraints) > 1:
        raise InputError(
            f"{constraints[0].label!r} and {constraints[1].label!r} both depend on the acceleration that both change; leave out one"
        )
    if constraints and excited == "base_displacement":
        raise InputError(
            f"element {constraints[0].label!r} depends on the acceleration relative to the base, which a displacement of the base does "
            "not give; record its acceleration"
        )
