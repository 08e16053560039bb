"""The effects that the proof conceals, as plain equations: one entry for each effect, written without the catalogue.

No code is shared with the fitted model. Dry friction changes its sign by an algebraic sigmoid over a tenth of a millimetre a second
(for a hopper; about a thousandth of the usual speed of other machines). Play and rate limit are exact operators, whose memory is
updated between accepted steps. Jumps are exact and are left to the step-size control. Every function changes the value of a signal
at its place on the path

    command u -> [command] -> + forcing -> [actuator] -> f,   spring and damper -> [leg] -> [contact],   f + leg -> [body]
    position -> [sensor] -> measured position

and has the arguments (value, t, x, v, f, m, p, s, ds, held, accepted): time [s], position [m], velocity [m/s], actuator
force [N], the machine's constants, the effect's parameters in the order declared, its states and (to be written) their
rates, and memory that may be written only in a step that has been `accepted`. On a moved base, x and v of effects in the leg and
its contact are relative to the base. Under a controller the command is its reference.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from numba import njit

# indices of the constants m, see rhythmid.proof.machine.Machine
(
    MASS, STIFFNESS, DAMPING, REST_LENGTH, GRAVITY, AMPLITUDE, FREQUENCY, PHASE,
    RETURN, MOMENT, HANGING, PROPORTIONAL, DERIVATIVE, INTEGRAL, SLIDING, SENSED,
) = range(16)  # fmt: skip
PLACES = ("command", "actuator", "leg", "contact", "body", "sensor")
SWITCHING = 2e-4  # half the speed range over which a damper with a threshold sets in [m/s]


@dataclass(frozen=True)
class Equation:
    """An effect's equation.

    `place` is its place on the path, `parameters` their names. `states` says whether each state starts at the position (1) or at
    zero (0). `held` is the number of stored values.
    """

    place: str
    function: Callable[..., Any]
    parameters: tuple[str, ...]
    states: tuple[float, ...]
    held: int


EQUATIONS: dict[str, Equation] = {}


def equation(place: str, *parameters: str, states: tuple[float, ...] = (), held: int = 0) -> Callable:
    """Register a function under its own name."""

    def enter(function: Callable) -> Callable:
        EQUATIONS[function.__name__] = Equation(place, function, parameters, states, held)
        return function

    return enter


@njit(cache=True)
def sgn(v, m):
    return v / math.sqrt(v * v + m[SLIDING] * m[SLIDING])


@njit(cache=True)
def clip(value, low, high):
    return min(max(value, low), high)


# command: before the forcing joins


@equation("command", "time_constant", states=(0.0,))
def command_lag(value, t, x, v, f, m, p, s, ds, held, accepted):
    ds[0] = (value - s[0]) / p[0]
    return s[0]


@equation("command", "rate", held=2)
def reference_rate_limit(value, t, x, v, f, m, p, s, ds, held, accepted):
    reach = p[0] * max(t - held[1], 0.0)
    reached = clip(value, held[0] - reach, held[0] + reach)
    if accepted:
        held[0] = reached
        held[1] = t
    return reached


# actuator: forcing and command


@equation("actuator", "time_constant", states=(0.0,))
def actuator_lag(value, t, x, v, f, m, p, s, ds, held, accepted):
    ds[0] = (value - s[0]) / p[0]
    return s[0]


@equation("actuator", "limit")
def actuator_saturation(value, t, x, v, f, m, p, s, ds, held, accepted):
    return clip(value, -p[0], p[0])


@equation("actuator", "speed", "slope")
def torque_speed_limit(value, t, x, v, f, m, p, s, ds, held, accepted):
    free, lost = p
    return clip(value, -lost * (free + v), lost * (free - v))


@equation("actuator", "threshold")
def actuator_deadband(value, t, x, v, f, m, p, s, ds, held, accepted):
    if value > p[0]:
        return value - p[0]
    if value < -p[0]:
        return value + p[0]
    return 0.0


@equation("actuator", "coefficient")
def actuator_nonlinearity(value, t, x, v, f, m, p, s, ds, held, accepted):
    return value - p[0] * value**3


@equation("actuator", "rate")
def actuator_fade(value, t, x, v, f, m, p, s, ds, held, accepted):
    return value * (1.0 - p[0] * max(t, 0.0))


@equation("actuator", "width", held=1)
def backlash(value, t, x, v, f, m, p, s, ds, held, accepted):
    played = clip(held[0], value - 0.5 * p[0], value + 0.5 * p[0])
    if accepted:
        held[0] = played
    return played


@equation("actuator", "rate", held=2)
def actuator_rate_limit(value, t, x, v, f, m, p, s, ds, held, accepted):
    reach = p[0] * max(t - held[1], 0.0)
    reached = clip(value, held[0] - reach, held[0] + reach)
    if accepted:
        held[0] = reached
        held[1] = t
    return reached


# leg: springs, dampers and friction


@equation("leg", "force")
def coulomb_friction(value, t, x, v, f, m, p, s, ds, held, accepted):
    return value - p[0] * sgn(v, m)


@equation("leg", "force", "asymmetry")
def asymmetric_coulomb_friction(value, t, x, v, f, m, p, s, ds, held, accepted):
    return value - p[0] * (1.0 + p[1] * sgn(v, m)) * sgn(v, m)


@equation("leg", "force", "static_ratio", "stribeck_speed")
def stribeck_friction(value, t, x, v, f, m, p, s, ds, held, accepted):
    rise = p[0] * (p[1] - 1.0)
    return value - (p[0] + rise * math.exp(-((v / p[2]) ** 2))) * sgn(v, m)


@equation("leg", "coefficient")
def load_dependent_friction(value, t, x, v, f, m, p, s, ds, held, accepted):
    return value - p[0] * abs(f) * sgn(v, m)


@equation("leg", "coefficient", "external_ratio")
def transmitted_load_friction(value, t, x, v, f, m, p, s, ds, held, accepted):
    load = -m[STIFFNESS] * (x - m[REST_LENGTH]) - m[MASS] * m[GRAVITY] - m[MOMENT] * math.sin(x - m[HANGING])
    return value - p[0] * abs(f - p[1] * load) * sgn(v, m)


@equation("leg", "stiffness", "yield_displacement", "shape", states=(0.0,))
def bouc_wen_hysteresis(value, t, x, v, f, m, p, s, ds, held, accepted):
    z = s[0]
    ds[0] = v * (1.0 - (abs(z) + p[2] * (math.copysign(abs(z), v * z) - abs(z))) / p[1])
    return value - p[0] * z


@equation("leg", "stiffness", "yield_displacement", states=(0.0,))
def elastoplastic_hysteresis(value, t, x, v, f, m, p, s, ds, held, accepted):
    z = s[0]
    ds[0] = v * (1.0 - (z / p[1]) ** 2) if z * v > 0.0 else v
    return value - p[0] * z


@equation("leg", "damping")
def viscous_damper(value, t, x, v, f, m, p, s, ds, held, accepted):
    return value - p[0] * v


@equation("leg", "damping")
def flight_damping(value, t, x, v, f, m, p, s, ds, held, accepted):
    return value - p[0] * v if v <= 0.0 else value


@equation("leg", "threshold")
def switching_threshold(value, t, x, v, f, m, p, s, ds, held, accepted):
    at_zero = 1.0 if v > 0.0 else 0.0
    at_threshold = clip(0.5 + 0.5 * (v - p[0]) / SWITCHING, 0.0, 1.0)
    return value - m[DAMPING] * v * (at_threshold - at_zero)


@equation("leg", "coefficient", "reference", "exponent")
def position_dependent_damping(value, t, x, v, f, m, p, s, ds, held, accepted):
    return value - p[0] * (x - p[1]) ** int(p[2]) * v


@equation("leg", "coefficient")
def quadratic_damping(value, t, x, v, f, m, p, s, ds, held, accepted):
    return value - p[0] * v * abs(v)


@equation("leg", "stiffness", "damping_ratio", "position", "side")
def travel_stop(value, t, x, v, f, m, p, s, ds, held, accepted):
    depth = p[3] * (x - p[2])
    if depth <= 0.0:
        return value
    damping = 2.0 * p[1] * math.sqrt(p[0] * m[MASS])
    return value - p[3] * max(0.0, p[0] * depth + damping * p[3] * v)


@equation("leg", "coefficient")
def quadratic_stiffness(value, t, x, v, f, m, p, s, ds, held, accepted):
    return value - p[0] * (x - m[REST_LENGTH]) ** 2


@equation("leg", "coefficient")
def cubic_stiffness(value, t, x, v, f, m, p, s, ds, held, accepted):
    return value - p[0] * (x - m[REST_LENGTH]) ** 3


@equation("leg", "coefficient")
def quintic_stiffness(value, t, x, v, f, m, p, s, ds, held, accepted):
    return value - p[0] * (x - m[REST_LENGTH]) ** 5


@equation("leg", "change", "kink")
def bilinear_stiffness(value, t, x, v, f, m, p, s, ds, held, accepted):
    return value - p[0] * (x - p[1]) if x > p[1] else value


@equation("leg", "gap")
def freeplay(value, t, x, v, f, m, p, s, ds, held, accepted):
    return value + m[STIFFNESS] * clip(x - m[REST_LENGTH], -0.5 * p[0], 0.5 * p[0])


@equation("leg", "stiffness", "time_constant", states=(1.0,))
def viscoelastic_relaxation(value, t, x, v, f, m, p, s, ds, held, accepted):
    ds[0] = (x - s[0]) / p[1]
    return value - p[0] * (x - s[0])


@equation("leg", "rate")
def stiffness_drift(value, t, x, v, f, m, p, s, ds, held, accepted):
    return value - m[STIFFNESS] * p[0] * max(t, 0.0) * (x - m[REST_LENGTH])


@equation("leg", "change", "time")
def stiffness_jump(value, t, x, v, f, m, p, s, ds, held, accepted):
    return value - m[STIFFNESS] * p[0] * (x - m[REST_LENGTH]) if t > p[1] else value


@equation("contact", "loss")
def ground_contact_loss(value, t, x, v, f, m, p, s, ds, held, accepted):
    return value * (1.0 - p[0]) if x > m[REST_LENGTH] else value


# body: forces on the mass that do not act through the leg


@equation("body", "stiffness", "damping_ratio", "position", "side")
def end_stop_contact(value, t, x, v, f, m, p, s, ds, held, accepted):
    depth = p[3] * (x - p[2])
    if depth <= 0.0:
        return value
    damping = 2.0 * p[1] * math.sqrt(p[0] * m[MASS])
    return value - p[3] * max(0.0, p[0] * depth + damping * p[3] * v)


@equation("body", "force")
def constant_force(value, t, x, v, f, m, p, s, ds, held, accepted):
    return value + p[0]


@equation("body", "coefficient")
def quadratic_drag(value, t, x, v, f, m, p, s, ds, held, accepted):
    return value - p[0] * v * abs(v)


@equation("body", "amplitude", "wavelength", "phase")
def position_ripple(value, t, x, v, f, m, p, s, ds, held, accepted):
    return value + p[0] * math.sin(2.0 * math.pi * x / p[1] + p[2])


@equation("body", "amplitude", "frequency", "phase")
def periodic_disturbance(value, t, x, v, f, m, p, s, ds, held, accepted):
    return value + p[0] * math.sin(2.0 * math.pi * p[1] * t + p[2])


@equation("body", "mass", "frequency", "damping_ratio", states=(1.0, 0.0))
def second_mode(value, t, x, v, f, m, p, s, ds, held, accepted):
    omega = 2.0 * math.pi * p[1]
    spring = p[0] * omega * omega * (s[0] - x)
    damper = p[0] * 2.0 * p[2] * omega * (s[1] - v)
    ds[0] = s[1]
    ds[1] = -(spring + damper) / p[0]
    return value + spring + damper


# sensor


@equation("sensor", "rate")
def sensor_drift(value, t, x, v, f, m, p, s, ds, held, accepted):
    return value + p[0] * t


@equation("sensor", "time_constant", states=(1.0,))
def sensor_lag(value, t, x, v, f, m, p, s, ds, held, accepted):
    ds[0] = (value - s[0]) / p[0]
    return s[0]


@equation("sensor", "coefficient", "reference")
def sensor_nonlinearity(value, t, x, v, f, m, p, s, ds, held, accepted):
    return value + p[0] * (value - p[1]) ** 2


# outside the catalogue: a diagnosis does not know their names


@equation("body", "amplitude", "wavelength", "phase", "second", "second_phase")
def two_harmonic_cogging(value, t, x, v, f, m, p, s, ds, held, accepted):
    turn = 2.0 * math.pi * x / p[1]
    return value + p[0] * (math.sin(turn + p[2]) + p[3] * math.sin(2.0 * turn + p[4]))


@equation("body", "force", "place", "width")
def magnet(value, t, x, v, f, m, p, s, ds, held, accepted):
    away = (x - p[1]) / p[2]
    return value - p[0] * away * math.exp(0.5 - 0.5 * away * away)


@equation("leg", "force", "distance", "ageing", states=(0.0,))
def relaxing_friction(value, t, x, v, f, m, p, s, ds, held, accepted):
    ds[0] = (1.0 - s[0]) / p[2] - s[0] * abs(v) / p[1]
    return value - p[0] * (0.5 + s[0]) * sgn(v, m)


@equation("body", "coefficient")
def three_halves_drag(value, t, x, v, f, m, p, s, ds, held, accepted):
    return value - p[0] * v * math.sqrt(abs(v))


# the family of the catalogue to which each would belong
FOREIGN = {
    "two_harmonic_cogging": "ripple",
    "magnet": "stiffness",
    "relaxing_friction": "friction",
    "three_halves_drag": "damping",
}
