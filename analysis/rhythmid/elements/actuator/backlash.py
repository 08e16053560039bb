"""Backlash: the play operator of width b on the actuator force; the output follows only after the gap is crossed.

The play is the projection of its own memory w onto [f - b/2, f + b/2]. The kernel returns this projection exactly and
lets the memory follow it as fast as the integration step h allows, with h / 1.5 as time constant: the output errs only
after a reversal, by about h^2 d2f/dt2 / 4. The play starts in the middle, at the force that is asked for.
"""

from math import inf

from rhythmid.elements.element import STEP, Element, Parameter


def kernel(f, t, width, step, memory):
    played = max(f - 0.5 * width, min(f + 0.5 * width, memory))
    return played, 1.5 * (played - memory) / step


ELEMENT = Element(
    name="backlash",
    slot="actuator",
    title="Backlash",
    equation="f → w,  w = clip(w₋, f − b/2, f + b/2)",
    parameters=(Parameter("width", "N", "width b of the play", bounds=(0.0, inf)),),
    borrows={"step": (STEP, 1e-3)},
    kernel=kernel,
    states=("memory",),
    initial=lambda x, v, f, **_: (f,),
    size="width",
    starts=lambda s: [{"width": w * s.effort} for w in (0.05, 0.2) if s.effort > 0.0],
    also_known_as=("play", "actuator hysteresis", "lost motion"),
    family="actuator nonlinearity",
    confusable={
        "actuator_deadband": "has memory: the force is lost at reversals, not near zero",
        "actuator_lag": "its phase lag falls with amplitude",
        "freeplay": "in the actuator force, not in the position",
    },
    reference="A. Visintin, Differential Models of Hysteresis, Springer, 1994; M. Nordin, P.-O. Gutman, "
    "Automatica 38(10), 2002, 1633-1649",
)
