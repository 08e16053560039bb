"""Which joint carries a whole robot, such as the rail or the slide of its base."""

from typing import Any


def carries_all(model: Any, joint: str) -> bool:
    """Whether a joint of a MuJoCo model moves all its other joints."""
    own = int(model.jnt_bodyid[model.joint(joint).id])
    first = int(model.body_jntadr[own])
    if model.joint(first).name != joint:
        return False
    within = {own}
    for body in range(own + 1, model.nbody):  # a body comes after the one that carries it
        if int(model.body_parentid[body]) in within:
            within.add(body)
    return all(int(one) in within for one in model.jnt_bodyid)
