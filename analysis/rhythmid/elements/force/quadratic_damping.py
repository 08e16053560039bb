"""Quadratic damping of an orifice: F = -c_2 v |v|, v the speed of the mass relative to the base that it stands on.

A hydraulic damper moves with its base; the drag of air on the mass does not. On a fixed base the two are equivalent.
"""

from dataclasses import replace

from rhythmid.elements.force.quadratic_drag import ELEMENT as DRAG

ELEMENT = replace(
    DRAG,
    name="quadratic_damping",
    title="Quadratic damping",
    equation="F = −c₂ v |v|,  v relative to the base",
    parameters=(replace(DRAG.parameters[0], description="coefficient c₂ of the damper's turbulent flow"),),
    acts="leg",
    displaced_base=True,
    also_known_as=("orifice damping", "hydraulic damper", "shock absorber"),
    confusable={
        "quadratic_drag": "depends on the speed through the room: far above the resonance the base moves and the mass does not",
        "viscous_damper": "one amplitude only: quadratic damping grows with amplitude",
    },
    reference="J. C. Dixon, The Shock Absorber Handbook, 2nd ed., 2007, chapter 6",
)
