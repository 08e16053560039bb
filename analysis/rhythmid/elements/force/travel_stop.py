"""Travel stop: the end stop of a suspension. It moves with the base on which the mass stands; its contact is that
of `end_stop_contact`."""

from dataclasses import replace

from rhythmid.elements.force.end_stop_contact import ELEMENT as END_STOP

ELEMENT = replace(
    END_STOP,
    name="travel_stop",
    title="Travel stop",
    equation="F = ∓max(0, k_s p + c_s ṗ),  p = ±(x − x_b − x_s) > 0,  c_s = 2ζ√(k_s m)",
    acts="leg",
    displaced_base=True,
    also_known_as=("bump stop", "snubber", "bottoming out"),
    confusable={
        "end_stop_contact": "is met at one place in the room, wherever the base is: move the base slowly",
        "bilinear_stiffness": "soft, undamped, pulls as well as it pushes",
    },
)
