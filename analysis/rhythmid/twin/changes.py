"""Changes of physics that a twin looks for: parameters of the model, or of an element that it could gain."""

from dataclasses import dataclass

from rhythmid.elements.catalogue import Catalogue
from rhythmid.model import INERTIA, Model
from rhythmid.simulation.right_hand_side import DRIVES, InputKind

DELAYS = ("input_delay.delay", "measurement_delay.delay")
GAINED = (  # one effect of each kind that a slot of the signal path may gain
    "input_delay", "actuator_gain", "coulomb_friction", "viscous_damper", "constant_force", "measurement_delay",
    "sensor_gain", "sensor_offset",
)  # fmt: skip
# elements of the model with a parameter that already does the same
SAME = {"viscous_damper": ("switched_damper",)}
SHARP = 0.05  # share of the usual speed over which the sign of an added friction changes
INERTIA_SLOT = "inertia"


@dataclass(frozen=True)
class Change:
    """A parameter that may change, by "element.parameter", with the slot where it acts."""

    name: str
    slot: str
    unit: str

    @property
    def delay(self) -> bool:
        """Whether it is a transport delay, which shifts a signal in time and is no parameter of the simulation."""
        return self.name in DELAYS


def watched(
    model: Model, catalogue: Catalogue, speed: float, kind: InputKind = "force"
) -> tuple[Model, tuple[Change, ...]]:
    """The model with all elements that it could gain, at sizes without effect, and the changes to look for.

    `speed` [the model's unit] is the usual speed of the motion. Changes are the inertia, the free parameters and the sizes
    of the model's elements except drives, and the sizes of the added elements.
    """
    for name in GAINED:
        element = catalogue[name]
        present = any(
            term.element.name in (name, *SAME.get(name, ()))
            or (element.family == "friction" and term.element.family == "friction")
            for term in model.terms
        )
        if present or (element.slot == "command" and kind not in DRIVES):
            continue
        given = {element.size: element.absent}
        if name == "coulomb_friction":
            given["transition"] = SHARP * speed
        model = model.with_element(element, given, fixed=True)
    free = set(model.free)
    found = [Change(INERTIA, INERTIA_SLOT, model.mass.unit)]
    for term in model.terms:
        element = term.element
        if element.acts == "drive" or element.name == "gravity" or element.sampler is not None:
            continue
        if element.slot == "timing":
            continue
        for parameter in element.parameters:
            name = f"{term.label}.{parameter.name}"
            movable = element.kernel is not None or name in DELAYS
            if movable and (name in free or parameter.name == element.size):
                found.append(Change(name, element.slot, term.values[parameter.name].unit))
    return model, tuple(found)


def without_own_forcing(model: Model) -> Model:
    """The model without drives of its own, for a machine whose forcing is measured."""
    for term in [term for term in model.terms if term.element.acts == "drive"]:
        model = model.without(term.label)
    return model
