"""Kinematic tree of a body's joints."""

from rhythmid.body.mujoco_body import MujocoBody


def parents_of(body: MujocoBody) -> dict[str, str | None]:
    """For each joint the joint that carries it; None for one at the base."""
    model, found = body.model, {}
    last: dict[int, str] = {}  # the last joint of each link
    for number in range(model.njnt):
        name, link = model.joint(number).name, int(model.jnt_bodyid[number])
        if name not in body.joints:
            continue
        above, before = link, last.get(link)
        while before is None and above:
            above = int(model.body_parentid[above])
            before = last.get(above)
        found[name] = before
        last[link] = name
    return found
