"""Backlash: the play operator of width b on the actuator force; the output follows only after the gap is crossed.

The play is the projection of its memory state w onto [f - b/2, f + b/2]. That is exact while the force does not
reverse within an integration step h; otherwise the error is at most h^2 d2f/dt2 / 8. It starts in the middle of the
gap, at the commanded force.
"""

from math import inf

from rhythmid.elements.element import Element, Parameter


def kernel(f, t, width, memory):
    played = max(f - 0.5 * width, min(f + 0.5 * width, memory))
    return played, played


ELEMENT = Element(
    name="backlash",
    slot="actuator",
    title="Backlash",
    equation="f → w,  w = clip(w₋, f − b/2, f + b/2)",
    parameters=(Parameter("width", "N", "width b of the play", bounds=(0.0, inf)),),
    kernel=kernel,
    memories=("memory",),
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
