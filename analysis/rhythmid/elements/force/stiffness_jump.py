"""Stiffness jump: the linear spring's stiffness becomes k (1 + delta) at the time t_s (a crack, a slipped clamp).

The step is spread over one integration step, so that the motion depends smoothly on t_s. A fit in t_s has a minimum
for every period of the motion or of the forcing, so it needs a grid of starts and hops between minima.
"""

from math import inf

from rhythmid.elements.element import STEP, Element, Parameter


def kernel(x, v, t, f, change, time, stiffness, rest_length, step):
    done = max(0.0, min(1.0, 0.5 + (t - time) / step))
    return -stiffness * change * done * (x - rest_length)


ELEMENT = Element(
    name="stiffness_jump",
    slot="force",
    title="Stiffness jump",
    equation="F = −k δ e for t > t_s,  e = x − x₀",
    parameters=(
        Parameter("change", "1", "relative change δ of the stiffness", bounds=(-1.0, inf)),
        Parameter("time", "s", "time t_s of the change"),
    ),
    borrows={
        "stiffness": ("linear_spring.stiffness", None),
        "rest_length": ("linear_spring.rest_length", 0.0),
        "step": (STEP, 1e-3),
    },
    kernel=kernel,
    size="change",
    starts=lambda s: [{"change": 0.005, "time": k / 12.0 * s.duration} for k in range(1, 12)],
    hops=lambda s: {"time": 1.0 / min(s.frequency, s.forcing_frequency or s.frequency)},
    also_known_as=("crack", "sudden softening", "slipped clamp"),
    family="drift",
    confusable={"stiffness_drift": "a step instead of a ramp"},
    reference="M. Basseville, I. V. Nikiforov, Detection of Abrupt Changes, Prentice Hall, 1993",
)
