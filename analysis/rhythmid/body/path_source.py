"""Source text of the paths of all joints: their forces and damping for one step of the body.

At the start of a step every joint's path gives a force, which is held during the step. Damping and friction are
forces F(x, v) that oppose the motion. They are coupled by their secant: with D = (F(x, 0) - F(x, v)) / v >= 0 the
step takes F(x, 0) as force and D as the joint's damping, which MuJoCo integrates implicitly in the new velocity. So
they are stable for any size. Elements with states take one explicit step with their rates at its start. A
constraint is not part of a path here: MuJoCo includes it, see `soft_constraint`.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from rhythmid.elements.element import ELAPSED, STEP
from rhythmid.errors import InputError
from rhythmid.model import INERTIA, Model, Term
from rhythmid.simulation.kernel_source import kernel_module
from rhythmid.simulation.machine_code import Module
from rhythmid.simulation.right_hand_side import along_command

REST = 1e-9  # [rad/s or m/s] speed for the secant at lower speeds
TRANSPORT = ("input_delay", "measurement_delay")  # delays that a live run can include
COLUMNS = ("position", "velocity", "output", "effort")  # of each joint in a row of the result


@dataclass(frozen=True)
class Layout:
    """Positions in the arrays: `parameters[i]` is (joint, name, value where the path lacks it) of the parameter
    vector's entry i; `states` are (joint, "element.state"); `pasts` the signals whose past is stored."""

    parameters: tuple[tuple[str, str, float | None], ...]
    states: tuple[tuple[str, str], ...]
    pasts: int


@dataclass
class Writer:
    """Collects parameters, states and lines while walking along the joints' paths.

    The lines use: `qpos`, `qvel`, `damping`, `applied`, and the joints' indices `at_position`, `at_velocity` in
    them; `k` steps since the start, `h` their length, `t` the time; `command[row, joint]`, `out[row, …]`, and where
    a run is not `live`, `forcing` in the same form; `past`. A live run includes its transport delays: its arguments
    and results refer to the present time.
    """

    parameters: dict[tuple[str, str], float | None] = field(default_factory=dict)
    states: list[tuple[str, str]] = field(default_factory=list)
    memories: set[int] = field(default_factory=set)
    lines: list[str] = field(default_factory=list)
    pasts: int = 0
    joint: str = ""
    live: bool = False

    @property
    def layout(self) -> Layout:
        """Positions in the arrays."""
        parameters = tuple((joint, name, default) for (joint, name), default in self.parameters.items())
        return Layout(parameters, tuple(self.states), self.pasts)

    @property
    def before(self) -> list[str]:
        """Lines that read parameters and states from their arrays."""
        known = [f"p{i} = parameters[{i}]" for i in range(len(self.parameters))]
        return known + [f"s{i} = states[{i}]" for i in range(len(self.states))]

    @property
    def after(self) -> list[str]:
        """Lines that advance the states by one step."""
        return [
            f"s{i} = d{i}" if i in self.memories else f"s{i} = s{i} + h * d{i}"
            for i in range(len(self.states))
        ]

    def parameter(self, name: str, default: float | None = None) -> str:
        if name in (STEP, ELAPSED):  # a memory state is updated once per whole step
            return "h"
        known = self.parameters.setdefault((self.joint, name), default)
        if known is None or default is None:
            self.parameters[self.joint, name] = None
        return f"p{list(self.parameters).index((self.joint, name))}"

    def call(self, term: Term, arguments: list[str], result: str) -> None:
        """Evaluate an element at the start of the step; its states' rates are stored for the end."""
        element = term.element
        values = [self.parameter(f"{term.label}.{one.name}") for one in element.parameters]
        values += [self.parameter(source, default) for source, default in element.borrows.values()]
        first = len(self.states)
        for state in element.own:
            if state in element.memories:
                self.memories.add(len(self.states))
            self.states.append((self.joint, f"{term.label}.{state}"))
        own = [f"s{first + i}" for i in range(len(element.own))]
        rates = [f"d{first + i}" for i in range(len(element.own))]
        past = [
            self.past(term, value)
            for name, value in zip(element.leading, arguments)
            if name in element.history
        ]
        call = f"{element.name}({', '.join([*arguments, *values, *own, *past])})"
        self.lines.append(f"{', '.join([result, *rates])} = {call}")

    def past(self, term: Term, value: str) -> str:
        """A signal before the element's dead time, by linear interpolation between steps."""
        delay = self.parameter(f"{term.label}.{term.element.dead_time}")
        m, self.pasts = self.pasts, self.pasts + 1
        self.lines += [
            f"past[k % past.shape[0], {m}] = {value}",
            f"past{m} = earlier(past, {m}, k, {delay} / h)",
        ]
        return f"past{m}"

    def transport(self, model: Model, slot: str, value: str) -> None:
        """A signal after the delays of a slot, in a live run."""
        for term in (
            one for one in model.terms if one.element.slot == slot and one.element.name in TRANSPORT
        ):
            if self.live:
                delayed = replace(term.element, dead_time="delay")
                self.lines.append(f"{value} = {self.past(replace(term, element=delayed), value)}")


def _joint(writer: Writer, number: int, joint: str, model: Model) -> None:
    """Lines for one joint: from its command to the force and the damping on the body."""
    writer.joint = joint
    kernels = [term for term in model.terms if term.element.kernel is not None]
    lines = writer.lines
    lines += [f"x = qpos[at_position[{number}]]", f"v = qvel[at_velocity[{number}]]"]
    lines.append(f"f = command[row, {number}]")
    writer.transport(model, "command", "f")
    along_command(kernels, ["x", "v"], writer.call)
    if not writer.live:
        lines.append(f"f = f + forcing[row, {number}]")
    force = [term for term in kernels if term.element.slot == "force"]
    for term in (one for one in force if one.element.acts == "drive"):
        writer.call(term, ["t"], "part")
        lines.append("f = f + part")
    for term in (one for one in kernels if one.element.slot == "actuator"):
        motion = ["x", "v"] if term.element.acts == "transducer" else []
        writer.call(term, ["f", *motion, "t"], "f")
    _forces(writer, number, force)
    lines.append("y = x")
    for term in (one for one in kernels if one.element.slot == "sensor"):
        writer.call(term, ["y", "t"], "y")
    writer.transport(model, "sensor", "y")
    first = number * len(COLUMNS)
    lines += [f"out[row, {first + i}] = {name}" for i, name in enumerate(("x", "v", "y", "f"))]


def _forces(writer: Writer, number: int, force: list[Term]) -> None:
    """Forces along the joint; those without states are coupled by their secant."""
    lines = writer.lines
    whole = any(term.element.acts in ("modifier", "transmission") for term in force)
    plain = [one for one in force if one.element.acts in ("leg", "body")]
    lines += ["total = 0.0", "resting = 0.0", "rate = v"]
    lines += [f"if abs(rate) < {REST}:", f"    rate = {REST}"]
    for term in plain:
        if term.element.own or term.element.history or whole:
            writer.call(term, ["x", "v", "t", "f"], "part")
            lines += ["total = total + part", "resting = resting + part"]
        else:
            writer.call(term, ["x", "rate", "t", "f"], "part")
            lines.append("total = total + part")
            writer.call(term, ["x", "0.0", "t", "f"], "part")
            lines.append("resting = resting + part")
    for term in (one for one in force if one.element.acts == "transmission"):
        writer.call(term, ["total", "x", "v", "t", "f"], "part")
        lines += ["total = total + part", "resting = resting + part"]
    for term in (one for one in force if one.element.acts == "modifier"):
        writer.call(term, ["total", "x", "v", "t", "f"], "total")
        lines.append("resting = total")
    lines += [
        "secant = (resting - total) / rate",
        "if secant > 0.0:",
        f"    damping[at_velocity[{number}]] = secant",
        "    total = resting",
        "else:",
        f"    damping[at_velocity[{number}]] = 0.0",
        f"applied[at_velocity[{number}]] = f + total",
    ]


def written(paths: Mapping[str, Model], live: bool = False) -> tuple[Writer, dict[str, Module]]:
    """The lines for all paths, and by name the kernels that they call. Raises InputError for base motion as an input."""
    writer = Writer(live=live)
    for number, (joint, model) in enumerate(paths.items()):
        if room := [term for term in model.terms if term.against == "room"]:
            raise InputError(f"{joint}: {room[0].label} acts against the room, which a joint does not know")
        writer.joint = joint
        writer.parameter(INERTIA)
        _joint(writer, number, joint, model)
    kernels = {
        term.element.name: kernel_module(term.element)
        for model in paths.values()
        for term in model.terms
        if term.element.kernel is not None
    }
    return writer, kernels
