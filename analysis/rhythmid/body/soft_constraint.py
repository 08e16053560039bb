"""Dry friction as a MuJoCo constraint: `frictionloss`, with solver parameters that represent the identified law.

For a joint with dry friction, MuJoCo's constraint requests the acceleration −b v and limits the force −(a + b v) /
R to the friction loss. b = 2 / (d timeconst), R = (1 − d) w / d, where w is the joint's `dof_invweight0` and d is
here the same for all violations. F = −clip(m (a + v / τ) / s, ±F_c) follows with 1 / b = τ and R = s / m.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from rhythmid.body.body import Joint
from rhythmid.errors import InputError
from rhythmid.model import Model, Term

NAME = "soft_constraint_friction"
LEAST_IMPEDANCE, MOST_IMPEDANCE = 1e-4, 0.9999  # mjMINIMP, mjMAXIMP: MuJoCo clips d to these
CRITICAL = 1.0  # damping ratio; irrelevant for friction, which has no position to return to


@dataclass(frozen=True)
class SoftConstraint:
    """Dry friction of a joint: force F_c [N or N*m], regularisation R [1/kg or 1/(kg*m^2)] and lead τ [s]."""

    force: float
    regularisation: float
    lead: float

    @classmethod
    def of(cls, term: Term, mass: float) -> "SoftConstraint":
        """The friction of a term in a path with inertia `mass`."""
        values = term.numbers
        return cls(values["force"], values["softness"] / mass, values["lead"])

    def solver(self, weight: float, step: float) -> tuple[tuple[float, float], tuple[float, float]]:
        """MuJoCo's `solref` and the first two numbers of its `solimp`, for a joint with this `dof_invweight0`. The
        lead is at least one step [s]."""
        lead = max(self.lead, step)
        impedance = min(max(weight / (weight + self.regularisation), LEAST_IMPEDANCE), MOST_IMPEDANCE)
        return (2.0 * lead / impedance, CRITICAL), (impedance, impedance)


def put(model: Any, joints: Mapping[str, Joint], paths: Mapping[str, Model]) -> None:
    """Set the dry friction of paths with constraints in MuJoCo's model. Raises InputError for another constraint,
    which MuJoCo lacks."""
    for name, path in paths.items():
        for term in (one for one in path.terms if one.element.acts == "constraint"):
            if term.element.name != NAME:
                raise InputError(
                    f"{name}: {term.label} is a constraint that MuJoCo, which steps the body, does not have"
                )
            place, friction = joints[name].velocity, SoftConstraint.of(term, path.mass.value)
            weight, step = float(model.dof_invweight0[place]), float(model.opt.timestep)
            model.dof_frictionloss[place] = friction.force
            model.dof_solref[place], model.dof_solimp[place, :2] = friction.solver(weight, step)
