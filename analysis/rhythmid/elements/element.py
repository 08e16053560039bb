"""The common form of all elements: one physical effect in one file, with all information that other modules need.

A file in `elements/<slot>/` defines one `ELEMENT`. Exactly one of these functions defines the effect:

- `kernel`   a pure numeric function of one instant, compiled into the simulator. Its arguments by slot:
               command, actuator   (f, t, <parameters>, <borrowed>, <states>, <memories>) -> new f
               command, `acts="feedback"`    (f, x, v, t, <parameters>, …)               -> force, of a controller
               command, `acts="observation"` (x, v, t, <parameters>, …)                  -> x, v as controllers see them
               actuator, `acts="transducer"` (f, x, v, t, <parameters>, …)               -> new f, which depends on the motion
               force               (x, v, t, f, <parameters>, …)                         -> force on the mass
               force, `acts="transmission"`  (load, x, v, t, f, <parameters>, …)         -> force on the mass
               force, `acts="modifier"`      (leg, x, v, t, f, <parameters>, …)          -> new sum of the leg's forces
               force, `acts="constraint"`    (acceleration, yielding, x, v, t, f, <parameters>, …) -> force on the mass
               force, `acts="drive"`         (t, <parameters>, …)                        -> added to f before the actuator
               sensor              (y, t, <parameters>, …)                               -> new y
             Where the input displaces the base, `acts` says which motion x and v are: that of the mass relative to the base
             ("leg", the default, "transmission", "modifier", "constraint", "transducer"), or in the room ("body"). "load" is the
             sum of the forces on the mass without the actuator's and without friction and damping: the load of a gear besides f.
             A constraint's force depends on an acceleration to which it contributes. In a simulation it is given the
             `acceleration` without it and the `yielding`, the change of the acceleration per unit of its force. Along a measured
             motion it is given the whole acceleration, and a yielding of 0.
             A kernel with states or memories returns (result, dstate/dt, …, new memory, …). It may use only `math`. A memory is
             the memory state of an operator (play, rate limit): it takes the kernel's new value at the start and at the end of an
             integration step, and is constant between. `ELAPSED` is the time since the step's start.
             A kernel with a `history` is given last, for each signal named there, its value a `dead_time` earlier.
- `delay`    (stamps, **parameters) -> seconds; delay of a command's action, or age of a measurement, relative to its stamp.
             Shapes (n,) -> (n,).
- `sampler`  (rng, **parameters) -> f(stamps, samples) -> samples; an operation on successive samples (noise, rounding). It
             may have a memory; the result must be the same for chunks and for the whole.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from math import inf, isinf, pi
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from rhythmid.elements.first_guess import generic_guesses

Slot = Literal["command", "actuator", "force", "sensor", "timing"]
# borrowed under this name: the largest integration step [s], the lower limit for the time scale of an effect
STEP = "simulation.step"
LONGEST_DEAD_TIME = 1.0  # [s] of an element with a history: the stored past grows with it
ELAPSED = "simulation.elapsed"  # borrowed under this name: the time [s] since the integration step began
SLOTS: tuple[Slot, ...] = ("command", "actuator", "force", "sensor", "timing")
Acts = Literal[
    "body", "leg", "transmission", "modifier", "constraint", "drive", "feedback", "observation", "transducer"
]
Against = Literal["base", "room"]
DISSIPATIVE = ("friction", "damping")  # families whose forces are losses, not a load of a gear
LEADING: Mapping[tuple[Slot, Acts], tuple[str, ...]] = {  # a kernel's arguments before its parameters
    ("command", "leg"): ("f", "t"),
    ("command", "feedback"): ("f", "x", "v", "t"),
    ("command", "observation"): ("x", "v", "t"),
    ("actuator", "leg"): ("f", "t"),
    ("actuator", "transducer"): ("f", "x", "v", "t"),
    ("force", "leg"): ("x", "v", "t", "f"),
    ("force", "body"): ("x", "v", "t", "f"),
    ("force", "transmission"): ("load", "x", "v", "t", "f"),
    ("force", "modifier"): ("leg", "x", "v", "t", "f"),
    ("force", "constraint"): ("acceleration", "yielding", "x", "v", "t", "f"),
    ("force", "drive"): ("t",),
    ("sensor", "leg"): ("y", "t"),
}
Sampler = Callable[[NDArray[np.float64], NDArray[np.float64]], NDArray[np.float64]]


@dataclass(frozen=True)
class Parameter:
    """A parameter of an element.

    `unit` is written for a translational machine (kg, m, s, N); a rotational or otherwise scaled model translates
    it. `default` is used where a model file gives no value; None makes the parameter mandatory. A `fixed` parameter
    is not estimated unless a model file says `fixed: false`: a seed, a side, an exponent. A `turn` is the period of
    a parameter with a periodic effect, such as a phase.
    """

    name: str
    unit: str
    description: str
    bounds: tuple[float, float] = (-inf, inf)
    default: float | None = None
    fixed: bool = False
    turn: float = inf


# changes of the drive through the same level in the same direction that show whether what it passes through changes with
# time: one tells how it is, two that it is no longer the same
OFTEN_ENOUGH = 2


@dataclass(frozen=True)
class Scales:
    """Scales of a record in the model's units, used for first guesses of parameters."""

    position: float  # standard deviation of the measured position
    velocity: float  # of its rate
    effort: float  # of the actuator force
    centre: float  # mean position
    low: float  # smallest and
    high: float  # largest position
    mass: float
    stiffness: float  # mass * (dominant angular frequency)^2 where the model has no spring
    frequency: float  # [Hz] dominant frequency of the motion
    duration: float  # [s] longest record
    period: float  # [s] sample period
    forcing_frequency: float = 0.0  # [Hz] pumping frequency, 0 where there is none
    # [Hz] strongest line that the nominal model leaves unexplained, 0 where unknown
    residual_frequency: float = 0.0
    # strongest lines over position that the nominal model leaves unexplained
    residual_wavelengths: tuple[float, ...] = ()
    reference: float = 0.0  # standard deviation of a controller's reference, 0 where there is none
    peak_effort: float = 0.0  # largest actuator force, 0 where unknown
    rest: float | None = None  # position at which the model's linear spring is at rest, where that is known
    displaced_base: bool = False  # whether the input displaces the base that the leg stands on
    idle: bool = False  # whether no command, forcing or controller drives the machine: it moves freely
    # times at which the recorded drive passes through one level in the same direction in one record, at most `OFTEN_ENOUGH`: 0 for
    # another level in each record, 1 for a step with which the records begin
    changes: int = OFTEN_ENOUGH
    swings: tuple[float, float] = (0.0, 0.0)  # [Hz] lowest and highest frequency of a free oscillation
    comes_back: bool = True  # whether the position moves back and forth in some record
    pressed: bool = True  # whether some record holds the machine at an end of its travel against its drive
    once: bool = False  # whether every record passes through each of its speeds only once, as a machine that coasts down
    # smallest, mean and largest value and standard deviation of what the sensor measures, where that is not the position of
    # the mass that the forces act on: its speed, or its position beside that relative to a moving base
    signal: tuple[float, float, float, float] | None = None

    def seen_in(self, slot: Slot) -> "Scales":
        """The scales for elements of a slot: the position of a sensor element is what the sensor measures."""
        if slot != "sensor" or self.signal is None:
            return self
        low, centre, high, spread = self.signal
        return replace(self, low=low, centre=centre, high=high, position=spread)

    @property
    def force(self) -> float:
        """Typical force of the leg, stiffness times displacement."""
        return self.stiffness * self.position

    @property
    def inside(self) -> tuple[float, float]:
        """The travel without a twentieth of it at either end: a kink further out is only an offset of the rest
        position."""
        margin = 0.05 * (self.high - self.low)
        return self.low + margin, self.high - margin

    @property
    def turning(self) -> tuple[float, float]:
        """Transition speeds for dry friction: where the motion stays within them, the friction is only a damper."""
        return 0.0, 2.0 * self.velocity

    @property
    def damping(self) -> float:
        """The damping coefficient sqrt(k m), half the critical one."""
        return (self.stiffness * self.mass) ** 0.5

    @property
    def natural_frequency(self) -> float:
        """Frequency [Hz] of the mass on the spring."""
        return (self.stiffness / self.mass) ** 0.5 / (2.0 * pi)


@dataclass(frozen=True)
class Element:
    """One physical effect.

    `borrows` maps a kernel argument to (parameter of another element, value when the model has no such element;
    None makes that element a condition for using this one). `STEP` and `ELAPSED` are always available. `size` names
    the parameter that scales the effect: at its value `absent` the model behaves as without the element, whatever
    its other parameters. A `rigid` effect is reported whatever its size: a stop may be too stiff for its stiffness
    to be identifiable. `starts` proposes first guesses from the record's scales, several where the shape matters.
    `special_case_of` names more general elements that contain this one, exactly or in a limit of their parameters.
    `confusable` maps another element's name to an experiment or property that distinguishes the two. A `rotational`
    effect needs an angle for x, a `controlled` one a controller in the model, one of a `displaced_base` an input
    that moves the base. A `reversing` one is told from dry friction by what follows a reversal of the motion alone. A `placed`
    one changes with the position by a slow law, as every stiffness does. One that `stops` the machine at a place is told from
    friction where it throws the machine back or its drive presses it on. `ranges` limits parameters, by the record's scales, to values for which the element's name
    applies: a ripple repeats within the travel, otherwise it is only another spring. `hops` is the largest distance
    of the local minima of a fit in a parameter. `needless_with` names elements, or as "element.parameter" estimated
    parameters, beside which this element adds nothing to another candidate or to the nominal model. `against` says
    whether a friction or a damper acts between mass and base or between mass and room; None where there is no
    choice. `takes` is the unit of an actuator's input signal, where that is not a force. `clock` names the
    parameter that is the period of an independent clock. No descent finds it: a fit searches it on a grid as fine
    as the ticks in the last second of a record require. `width` names the parameter of a resonance that is its
    relative bandwidth. `history` names signals of which a kernel also needs the value a time `dead_time` earlier
    (the name of a parameter). Before a simulation's start these follow from command and forcing, with the machine's
    states extrapolated back along their first rates. `switches` says where the force changes form: at the value of
    a parameter, its own or a borrowed one, of position "x" or velocity "v"; "" means zero. A machine may have an
    element that `repeats` several times, each with its own parameters.
    """

    name: str
    slot: Slot
    title: str
    equation: str
    parameters: tuple[Parameter, ...]
    reference: str
    kernel: Callable[..., Any] | None = None
    delay: Callable[..., NDArray[np.float64]] | None = None
    sampler: Callable[..., Sampler] | None = None
    acts: Acts = "leg"
    states: tuple[str, ...] = ()
    memories: tuple[str, ...] = ()
    history: tuple[str, ...] = ()
    dead_time: str = ""
    # (x, v, f, **parameters) -> `own` at the start; default 0
    initial: Callable[..., tuple[float, ...]] | None = None
    borrows: Mapping[str, tuple[str, float | None]] = field(default_factory=dict)
    also_known_as: tuple[str, ...] = ()
    family: str = ""
    special_case_of: tuple[str, ...] = ()
    confusable: Mapping[str, str] = field(default_factory=dict)
    size: str = ""
    absent: float = 0.0
    rigid: bool = False
    candidate: bool = True  # used in the search for missing effects
    needless_with: tuple[str, ...] = ()
    # effects that together are the law where a parameter is at the end of its range
    beyond: tuple[str, ...] = ()
    same_as: tuple[str, ...] = ()  # elements that give the same model with other parameters
    # equivalences that hold beside another element
    same_beside: Mapping[str, str] = field(default_factory=dict)
    rotational: bool = False  # applies only where the position is an angle
    controlled: bool = False  # applies only where a controller in the command path closes the loop
    displaced_base: bool = False  # differs from another element only where the input displaces the base
    driven: bool = False  # has no effect without an actuator force, as commands and actuators
    # (**parameters) -> names and sizes of other elements that together give the same force while the machine moves
    moving_as: Callable[..., tuple[tuple[str, float], ...]] | None = None
    reversing: bool = False  # is told from dry friction by the way after a reversal of the motion alone
    placed: bool = False  # follows a slow law of the position, though it is no stiffness
    stops: bool = False  # stops the machine at a place, as friction does anywhere
    # changes with time what the drive passes through: a gain that fades, a clock, a delay
    drifts: bool = False
    starts: Callable[[Scales], list[dict[str, float]]] | None = None
    # fields that differ at a joint of a machine, whose inertia and weight are known from the body
    at_joint: Mapping[str, Any] = field(default_factory=dict)
    ranges: Callable[[Scales], Mapping[str, tuple[float, float]]] | None = None
    hops: Callable[[Scales], Mapping[str, float]] | None = None
    against: Against | None = None
    takes: str = ""
    clock: str = ""
    width: str = ""
    switches: tuple[Literal["x", "v"], str] | None = None
    repeats: bool = False
    source: str = ""  # file that defines it

    def __post_init__(self) -> None:
        given = [name for name in ("kernel", "delay", "sampler") if getattr(self, name) is not None]
        if len(given) != 1:
            raise TypeError(f"element {self.name}: needs exactly one of kernel, delay, sampler; has {given}")
        if self.slot not in SLOTS:
            raise TypeError(f"element {self.name}: slot {self.slot!r} is none of {', '.join(SLOTS)}")
        if self.kernel is not None and (self.slot, self.acts) not in LEADING:
            known = ", ".join(acts for slot, acts in LEADING if slot == self.slot)
            raise TypeError(
                f"element {self.name}: acts={self.acts!r} is for slot {self.slot!r} none of {known}"
            )

        if unknown := [name for name in self.history if name not in self.leading or name == "t"]:
            raise TypeError(
                f"element {self.name}: history names {unknown[0]!r}, which its kernel is not given"
            )
        lasting = [parameter.bounds for parameter in self.parameters if parameter.name == self.dead_time]
        if self.history and not (lasting and 0.0 <= lasting[0][0] <= lasting[0][1] <= LONGEST_DEAD_TIME):
            raise TypeError(
                f"element {self.name}: a history needs a parameter that is its dead_time, with bounds from 0 to at most "
                f"{LONGEST_DEAD_TIME:g} s"
            )

    @property
    def leading(self) -> tuple[str, ...]:
        """Signals that are the first arguments of its kernel; empty without a kernel."""
        return LEADING[self.slot, self.acts] if self.kernel is not None else ()

    @property
    def arguments(self) -> tuple[str, ...]:
        """Names of its kernel's arguments, in order."""
        own = (parameter.name for parameter in self.parameters)
        return (*self.leading, *own, *self.borrows, *self.own, *(f"past_{name}" for name in self.history))

    def acting_against(self, side: Against) -> "Element":
        """The same friction or damper between the mass and the moving base, or between the mass and the room."""
        return replace(self, against=side, acts="body" if side == "room" else "leg")

    @property
    def own(self) -> tuple[str, ...]:
        """Its entries in the state vector: its states, then its memories."""
        return (*self.states, *self.memories)

    def parameter(self, name: str) -> Parameter:
        """The parameter called `name`; KeyError if there is none."""
        for parameter in self.parameters:
            if parameter.name == name:
                return parameter
        raise KeyError(name)

    def scaled(self, values: Mapping[str, float], factor: float) -> dict[str, float]:
        """The values with the effect scaled by a factor; the size of a limit, which is absent at infinity, is divided by it."""
        value = values[self.size]
        size = value / factor if isinf(self.absent) else self.absent + factor * (value - self.absent)
        return {**values, self.size: size}

    def forbids(self, values: Mapping[str, float], factor: float) -> bool:
        """Whether `factor` times the effect with these values has a physically impossible sign: the size would be
        beyond a bound that restricts it to one sign."""
        if not self.size:
            return False
        if isinf(self.absent):
            return factor < 0.0
        low, high = self.parameter(self.size).bounds
        size = self.scaled(values, factor)[self.size]
        return (size < low and low >= self.absent) or (size > high and high <= self.absent)

    def within(self, scales: Scales) -> "Element":
        """The element with its parameters' bounds, and its first guesses, narrowed to its `ranges` for these scales."""
        if self.ranges is None:
            return self
        ranges, propose = self.ranges(scales.seen_in(self.slot)), self.starts

        def narrowed(parameter: Parameter) -> Parameter:
            (low, high), (least, most) = parameter.bounds, ranges.get(parameter.name, (-inf, inf))
            return replace(parameter, bounds=(max(low, least), min(high, most)))

        def inside(start: dict[str, float]) -> bool:
            return all(low <= start.get(name, low) <= high for name, (low, high) in ranges.items())

        return replace(
            self,
            parameters=tuple(narrowed(parameter) for parameter in self.parameters),
            starts=propose and (lambda sizes: [start for start in propose(sizes) if inside(start)]),
        )

    def first_guesses(self, scales: Scales) -> list[dict[str, float]]:
        """First guesses of `starts` for these scales; without `starts`, guesses from the parameters' units and bounds.

        Empty where the motion does not show the effect. Raises NoGuess with the reason where no guess is possible.
        """
        seen = scales.seen_in(self.slot)
        return self.starts(seen) if self.starts is not None else generic_guesses(self, seen)
