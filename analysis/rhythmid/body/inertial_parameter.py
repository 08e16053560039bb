"""Inertial parameters of a body: mass and rotational inertia of a link, a payload at its end, and the inertia of a
rotor."""

from rhythmid.elements.element import Parameter

MASS, TURNING, PAYLOAD, ARMATURE = "mass", "inertia", "payload", "armature"
CENTRE = "centre_of_mass"  # a place (3,), no parameter of one number
LOAD = "mass_and_centre"  # mass and centre of mass together
MOMENT = "first_moment"  # mass times distance of the centre
MEANING = {
    MASS: "mass of the link, shape kept",
    TURNING: "inertia of the link about the axis through its centre of mass along that of its joint, shape kept",
    PAYLOAD: "point mass at the end of the link, beside its own mass",
    ARMATURE: "inertia of the rotor, seen at the joint",
}


def split(name: str) -> tuple[str, str]:
    """Owner and kind of a parameter "owner.kind"; the owner is a link, or the joint of a rotor."""
    owner, _, kind = name.rpartition(".")
    return owner, kind


def described(name: str) -> Parameter:
    """Definition of a parameter "owner.kind", in translational units."""
    _, kind = split(name)
    unit = "kg*m^2" if kind == TURNING else "kg"
    return Parameter(kind, unit, MEANING[kind], bounds=(0.0, float("inf")))
