"""The inertial parameters of a body: the mass of a link, a payload at the end of one, and the inertia of a rotor."""

from rhythmid.elements.element import Parameter

MASS, PAYLOAD, ARMATURE = "mass", "payload", "armature"
MEANING = {
    MASS: "mass of the link, shape kept",
    PAYLOAD: "point mass at the end of the link, beside its own mass",
    ARMATURE: "inertia of the rotor, seen at the joint",
}


def split(name: str) -> tuple[str, str]:
    """Owner and kind of a parameter "owner.kind"; the owner is a link, or the joint of a rotor."""
    owner, _, kind = name.rpartition(".")
    return owner, kind


def described(name: str) -> Parameter:
    """What a parameter "owner.kind" is, in translational units."""
    _, kind = split(name)
    return Parameter(kind, "kg", MEANING[kind], bounds=(0.0, float("inf")))
