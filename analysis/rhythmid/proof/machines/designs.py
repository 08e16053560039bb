"""All types of machines, in the order in which they take turns."""

from rhythmid.proof.machines import axis, decay, hopper, joint, motor, pendulum, servo, shaken
from rhythmid.proof.machines.rig import Design

DESIGNS: dict[str, Design] = {
    module.DESIGN.name: module.DESIGN
    for module in (hopper, axis, joint, pendulum, shaken, servo, decay, motor)
}
