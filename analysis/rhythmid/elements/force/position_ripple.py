"""Position ripple: F = A sin(2 pi x / lambda + phi), for instance the cogging of a linear motor or an eccentric gear.

(A, phi) and (-A, phi + pi) are the same ripple, so A is kept positive. A fit in lambda has one minimum for every
period that fits into the range of motion. So it needs a grid of starts and, where a rotor makes many turns, the
spectral lines of the residual over position. With fewer than two periods in the travel nothing repeats: such a
force is a smooth function of the position, which hardening or softening springs describe as well.
"""

import math

from rhythmid.elements.element import Element, Parameter


def kernel(x, v, t, f, amplitude, wavelength, phase):
    return amplitude * math.sin(2.0 * math.pi * x / wavelength + phase)


def starts(scales):
    # from two periods in the usual travel to a dozen
    wavelengths = [2.0 * scales.position / 1.18**k for k in range(12)]
    return [
        {"amplitude": 0.01 * scales.force, "wavelength": wavelength, "phase": phase}
        for wavelength in (*scales.residual_wavelengths, *wavelengths)
        for phase in (0.0, 0.5 * math.pi, math.pi, 1.5 * math.pi)  # the amplitude has no sign
    ]


ELEMENT = Element(
    name="position_ripple",
    slot="force",
    title="Position ripple",
    equation="F = A sin(2πx/λ + φ)",
    parameters=(
        Parameter("amplitude", "N", "amplitude A", bounds=(0.0, math.inf)),
        Parameter("wavelength", "m", "period λ in position", bounds=(1e-9, math.inf)),
        Parameter("phase", "rad", "phase φ at x = 0", default=0.0, turn=2.0 * math.pi),
    ),
    kernel=kernel,
    acts="body",
    size="amplitude",
    starts=starts,
    ranges=lambda s: {"wavelength": (0.0, 0.5 * (s.high - s.low))},
    also_known_as=("cogging", "detent force", "torque ripple", "gear eccentricity"),
    family="ripple",
    repeats=True,  # pole pairs, slots and gears have a wavelength each
    confusable={
        "cubic_stiffness": "long wavelengths: use the whole range of motion",
        "periodic_disturbance": "periodic in position, not in time: change the speed",
    },
    reference="D. Hanselman, Brushless Permanent Magnet Motor Design, 2nd ed., 2003",
)
