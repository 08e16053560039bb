"""The integrator of the concealed machines: rates of the whole signal path, and steps with error control.

The embedded Runge-Kutta pair of J. R. Dormand and P. J. Prince (J. Comput. Appl. Math. 6 (1980) 19), restarted at every knot of
the command. It shares no code with the simulator of the fitted models.
"""

import warnings
from functools import lru_cache
from typing import Any

import numpy as np
from numba import boolean, float64, int64, njit, types
from numba.core.errors import NumbaExperimentalFeatureWarning

from rhythmid.proof.equations import (
    AMPLITUDE,
    DAMPING,
    DERIVATIVE,
    EQUATIONS,
    FREQUENCY,
    GRAVITY,
    HANGING,
    INTEGRAL,
    MASS,
    MOMENT,
    PHASE,
    PLACES,
    PROPORTIONAL,
    REST_LENGTH,
    RETURN,
    SENSED,
    STIFFNESS,
)

MOST_EFFECTS = 5  # largest number of effects at once: two, and three small ones
RELATIVE, ABSOLUTE = 1e-8, 1e-11  # error tolerances of a step
SHORTEST_STEP = 1e-8  # [s] step below which the error is not controlled: inside a jump
DIVERGED_POSITION = 1e3  # [m] beyond which the machine has diverged
COLUMNS = 5  # values for each sample: position, velocity, measured, concealed force, acceleration

COMMAND, ACTUATOR, LEG, CONTACT, BODY, SENSOR = range(len(PLACES))
NOWHERE = -1
# meaning of the command: a force, the displacement of a moved base, the reference of a continuous controller, or the reference of a
# position or velocity controller that is updated at the command's knots
FORCE, BASE, CONTINUOUS, SAMPLED_POSITION, SAMPLED_VELOCITY = range(5)
numbers = float64[::1]
SIGNATURE = float64(
    float64, float64, float64, float64, float64, numbers, numbers, numbers, numbers, numbers, boolean
)
EFFECTS = types.UniTuple(types.FunctionType(SIGNATURE), MOST_EFFECTS)
whole = int64[::1]
table = int64[:, ::1]


def _nothing(value, t, x, v, f, m, p, s, ds, held, accepted):
    return value


@lru_cache(maxsize=64)
def compiled(name: str) -> Any:
    """The compiled equation `name`; that of "" changes nothing."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", NumbaExperimentalFeatureWarning)
        return njit(SIGNATURE, cache=True)(EQUATIONS[name].function if name else _nothing)


@njit(
    float64(int64, float64, float64, float64, float64, float64, EFFECTS, whole, table, numbers, numbers, numbers,
            numbers, numbers, boolean),
    cache=True,
)  # fmt: skip
def through(place, value, t, x, v, f, effects, places, layout, m, p, s, ds, held, accepted):
    """The signal `value` after all effects at its place."""
    for i in range(MOST_EFFECTS):
        if places[i] == place:
            value = effects[i](
                value, t, x, v, f, m, p[layout[i, 0] : layout[i + 1, 0]],
                s[layout[i, 1] : layout[i + 1, 1]], ds[layout[i, 1] : layout[i + 1, 1]],
                held[layout[i, 2] : layout[i + 1, 2]], accepted,
            )  # fmt: skip
    return value


@njit(float64(float64, float64, numbers), cache=True)
def plain_leg(e, ev, m):
    """Force of the spring and the damper, without effects, at the displacement `e` and velocity `ev` of the leg."""
    damping = m[DAMPING] if ev > 0.0 else m[RETURN]
    return -m[STIFFNESS] * (e - m[REST_LENGTH]) - damping * ev


@njit(
    float64(float64, numbers, float64, float64, int64, EFFECTS, whole, table, numbers, numbers, numbers, boolean,
            numbers, numbers),
    cache=True,
)  # fmt: skip
def rates(t, z, u, du, mode, effects, places, layout, m, p, held, accepted, dz, told):
    """Write the rates of the states z = (x, v, …), and to `told` (1,) the force [N] that all effects together add.

    `u` is the present command and `du` its slope. Returns the measured position or velocity.
    """
    x, v, s, ds = z[0], z[1], z[2:], dz[2:]
    e, ev, f, plain = x, v, 0.0, 0.0
    if mode == BASE:
        e, ev = x - u, v - du
    else:
        f = through(COMMAND, u, t, x, v, 0.0, effects, places, layout, m, p, s, ds, held, accepted)
        plain = u
        if mode == CONTINUOUS:
            f = m[PROPORTIONAL] * (f - x) - m[DERIVATIVE] * v
            plain = m[PROPORTIONAL] * (u - x) - m[DERIVATIVE] * v
    forcing = m[AMPLITUDE] * np.cos(2.0 * np.pi * m[FREQUENCY] * t + m[PHASE])
    f = through(ACTUATOR, f + forcing, t, x, v, 0.0, effects, places, layout, m, p, s, ds, held, accepted)
    bare = plain_leg(e, ev, m)
    leg = through(LEG, bare, t, e, ev, f, effects, places, layout, m, p, s, ds, held, accepted)
    leg = through(CONTACT, leg, t, e, ev, f, effects, places, layout, m, p, s, ds, held, accepted)
    weight = m[MASS] * m[GRAVITY] + m[MOMENT] * np.sin(x - m[HANGING])
    total = f + leg - weight
    total = through(BODY, total, t, x, v, f, effects, places, layout, m, p, s, ds, held, accepted)
    dz[0] = v
    dz[1] = total / m[MASS]
    told[0] = total - (plain + forcing + bare - weight)
    sensed = v if m[SENSED] == 1.0 else x
    return through(SENSOR, sensed, t, x, v, f, effects, places, layout, m, p, s, ds, held, accepted)


@njit(types.UniTuple(float64, 2)(float64, int64, numbers, numbers, numbers, float64, boolean), cache=True)
def command_at(t, j, knots, values, slopes, level, smooth):
    """The command and its slope at t, after `j` knots: held at `level`, or a cubic with the given slopes at both ends."""
    if not smooth or j == 0:
        return level, 0.0
    if j == len(knots):
        return values[j - 1], 0.0
    h = knots[j] - knots[j - 1]
    r = (t - knots[j - 1]) / h
    rise = values[j] - values[j - 1]
    a, b = h * slopes[j - 1], h * slopes[j]
    square, cube = 3.0 * rise - 2.0 * a - b, a + b - 2.0 * rise
    return values[j - 1] + r * (a + r * (square + r * cube)), (a + r * (2.0 * square + 3.0 * r * cube)) / h


@njit(
    int64(EFFECTS, whole, table, numbers, numbers, numbers, numbers, float64, numbers, numbers, numbers, int64, numbers,
          float64[:, ::1], numbers, float64),
    cache=True,
)  # fmt: skip
def integrate(
    effects, places, layout, m, p, held, z, begin, knots, values, slopes, mode, samples, out, efforts, before
):
    """Integrate from `begin` through all `samples`, filling the rows of `out`.

    The command is `before` until the first of its `knots`, then values[j] from knots[j] on. With as many `slopes` as knots it is a
    smooth curve through them. `efforts` (knots,) receives the forces of a sampled controller at the knots. Returns the number of
    valid rows.
    """
    n = len(z)
    k1, k2, k3, k4 = np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n)
    k5, k6, k7, trial = np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n)
    told = np.zeros(1)
    smooth = len(slopes) == len(knots) and len(knots) > 0
    drive = FORCE if mode >= SAMPLED_POSITION else mode
    summed = 0.0
    t, level, j = begin, before, 0
    h = 1e-4
    for i in range(len(samples)):
        while t < samples[i]:
            while j < len(knots) and knots[j] <= t:
                level = values[j]
                if mode >= SAMPLED_POSITION:
                    miss = values[j] - (z[0] if mode == SAMPLED_POSITION else z[1])
                    summed += miss * (knots[j] - knots[max(j - 1, 0)])
                    level = m[PROPORTIONAL] * miss + m[INTEGRAL] * summed - m[DERIVATIVE] * z[1]
                    efforts[j] = level
                j += 1
            stop = samples[i]
            if j < len(knots) and knots[j] < stop:
                stop = knots[j]
            # the command may just have jumped; effects with memory must be updated
            u, du = command_at(t, j, knots, values, slopes, level, smooth)
            rates(t, z, u, du, drive, effects, places, layout, m, p, held, True, k1, told)
            while t < stop:
                last = h >= stop - t
                step = stop - t if last else h
                for q in range(n):
                    trial[q] = z[q] + step * k1[q] / 5.0
                u, du = command_at(t + step / 5.0, j, knots, values, slopes, level, smooth)
                rates(
                    t + step / 5.0, trial, u, du, drive, effects, places, layout, m, p, held, False, k2, told
                )
                for q in range(n):
                    trial[q] = z[q] + step * (3.0 * k1[q] + 9.0 * k2[q]) / 40.0
                u, du = command_at(t + 0.3 * step, j, knots, values, slopes, level, smooth)
                rates(
                    t + 0.3 * step, trial, u, du, drive, effects, places, layout, m, p, held, False, k3, told
                )
                for q in range(n):
                    trial[q] = z[q] + step * (44.0 / 45.0 * k1[q] - 56.0 / 15.0 * k2[q] + 32.0 / 9.0 * k3[q])
                u, du = command_at(t + 0.8 * step, j, knots, values, slopes, level, smooth)
                rates(
                    t + 0.8 * step, trial, u, du, drive, effects, places, layout, m, p, held, False, k4, told
                )
                for q in range(n):
                    trial[q] = z[q] + step * (
                        19372.0 / 6561.0 * k1[q] - 25360.0 / 2187.0 * k2[q] + 64448.0 / 6561.0 * k3[q]
                        - 212.0 / 729.0 * k4[q]
                    )  # fmt: skip
                late = t + 8.0 / 9.0 * step
                u, du = command_at(late, j, knots, values, slopes, level, smooth)
                rates(late, trial, u, du, drive, effects, places, layout, m, p, held, False, k5, told)
                for q in range(n):
                    trial[q] = z[q] + step * (
                        9017.0 / 3168.0 * k1[q] - 355.0 / 33.0 * k2[q] + 46732.0 / 5247.0 * k3[q]
                        + 49.0 / 176.0 * k4[q] - 5103.0 / 18656.0 * k5[q]
                    )  # fmt: skip
                u, du = command_at(t + step, j, knots, values, slopes, level, smooth)
                rates(t + step, trial, u, du, drive, effects, places, layout, m, p, held, False, k6, told)
                for q in range(n):
                    trial[q] = z[q] + step * (
                        35.0 / 384.0 * k1[q] + 500.0 / 1113.0 * k3[q] + 125.0 / 192.0 * k4[q]
                        - 2187.0 / 6784.0 * k5[q] + 11.0 / 84.0 * k6[q]
                    )  # fmt: skip
                rates(t + step, trial, u, du, drive, effects, places, layout, m, p, held, False, k7, told)
                worst = 0.0
                for q in range(n):
                    error = step * (
                        71.0 / 57600.0 * k1[q] - 71.0 / 16695.0 * k3[q] + 71.0 / 1920.0 * k4[q]
                        - 17253.0 / 339200.0 * k5[q] + 22.0 / 525.0 * k6[q] - k7[q] / 40.0
                    )  # fmt: skip
                    allowed = ABSOLUTE + RELATIVE * max(abs(z[q]), abs(trial[q]))
                    worst = max(worst, abs(error) / allowed)
                if not np.isfinite(worst):
                    return i
                growth = 5.0 if worst == 0.0 else min(5.0, max(0.2, 0.9 * worst**-0.2))
                if worst > 1.0 and step > SHORTEST_STEP:
                    h = max(step * growth, SHORTEST_STEP)
                    continue
                t = stop if last else t + step
                z[:] = trial
                u, du = command_at(t, j, knots, values, slopes, level, smooth)
                rates(t, z, u, du, drive, effects, places, layout, m, p, held, True, k1, told)
                h = max(h, step * growth) if last else max(step * growth, SHORTEST_STEP)
            if abs(z[0]) > DIVERGED_POSITION:
                return i
        u, du = command_at(t, j, knots, values, slopes, level, smooth)
        out[i, 0], out[i, 1] = z[0], z[1]
        out[i, 2] = rates(t, z, u, du, drive, effects, places, layout, m, p, held, False, k1, told)
        out[i, 3], out[i, 4] = told[0], k1[1]
    return len(samples)
