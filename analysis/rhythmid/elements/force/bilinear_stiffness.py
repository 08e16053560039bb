"""Bilinear stiffness: another stiffness beyond the kink, F = -dk (x - x_b) for x > x_b.

The other side needs no separate element: with a free linear spring, -dk on this side is +dk on the other.
"""

from rhythmid.elements.element import Element, Parameter


def kernel(x, v, t, f, change, kink):
    return -change * max(x - kink, 0.0)


def starts(scales):
    return [
        {"change": 0.05 * scales.stiffness, "kink": scales.centre + offset * scales.position}
        for offset in (-1.0, 0.0, 1.0)
    ]


ELEMENT = Element(
    name="bilinear_stiffness",
    slot="force",
    title="Bilinear stiffness",
    equation="F = −Δk (x − x_b) for x > x_b",
    parameters=(
        Parameter("change", "N/m", "stiffness Δk that is added beyond the kink, of either sign"),
        Parameter("kink", "m", "position x_b of the kink"),
    ),
    kernel=kernel,
    size="change",
    starts=starts,
    ranges=lambda s: {"kink": s.inside},
    also_known_as=("piecewise linear spring", "kinked spring", "helper spring"),
    family="stiffness",
    special_case_of=("end_stop_contact",),  # undamped, pushing only
    confusable={
        "end_stop_contact": "a stop is stiff, damped and beyond the usual motion",
        "quadratic_stiffness": "a kink instead of a smooth curve: vary the amplitude",
        "ground_contact_loss": "the leg's whole force vanishes, damping too, at the rest length",
    },
    switches=("x", "kink"),
    reference="S. W. Shaw, P. J. Holmes, A periodically forced piecewise linear oscillator, "
    "Journal of Sound and Vibration 90(1), 1983, 129-155",
)
