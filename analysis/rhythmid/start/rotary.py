"""Whether a recorded quantity is rotational or translational, by its unit, its type and the words of its name."""

from rhythmid.record.inventory import Recorded
from rhythmid.start.meaning import force_unit_of, meaning_of
from rhythmid.start.vocabulary import ELECTRICAL
from rhythmid.start.words import words_of

ROTARY = frozenset(
    "angle angles angular theta phi alpha torque torques tor torq tau q rotation rotary omega revolute hinge encoder moment trq dof joint joints "
    "qpos qvel knee hip ankle thigh calf shoulder elbow wrist arm pan tilt roll pitch yaw pendulum winkel drehmoment drehzahl angulo "
    "angolo couple coppia odrv odrive moteus dynamixel dxl rotor".split()
)
LINEAR = frozenset(
    "force forces height displacement disp x z slide slider prismatic linear leg lift rail cart trolley carriage piston travel extension length"
    " deflection elevator kraft weg fuerza forza forca".split()
)  # fmt: skip


def rotary_of(one: Recorded, by_topic: bool = True) -> tuple[bool | None, str]:
    """Whether the quantity is rotational (True) or translational (False), and the word or unit that says so; `by_topic` also
    its topic's words, the weakest of all: `joint_states` is what every robot's topic is called."""
    if one.unit in ("rad", "rad/s", "rad/s^2", "N*m"):
        return True, f"its unit is {one.written_unit}"
    if one.unit in ("m", "m/s", "m/s^2", "N"):
        return False, f"its unit is {one.written_unit}"
    if force_unit_of(one) in ELECTRICAL and meaning_of(one).quantity == "effort":
        return True, "it feeds a motor"
    for word in [*words_of(one.said), *words_of(one.joint), *(words_of(one.topic) if by_topic else ())]:
        if word in LINEAR:
            return False, f"its name says {word!r}"
        if word in ROTARY:
            return True, f"its name says {word!r}"
    return None, ""


def rotary_of_wrench(one: Recorded) -> tuple[bool | None, str]:
    """As `rotary_of`, for a field of a wrench: a force in N or a torque in N*m, by REP 103."""
    words = words_of(one.field) if one.type.rpartition("/")[2] in ("Wrench", "WrenchStamped") else []
    if "torque" in words:
        return True, "a wrench's torque is in N*m"
    return (False, "a wrench's force is in N") if "force" in words else (None, "")
