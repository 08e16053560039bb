"""The input of a diagnosis of several joints, and each joint as a case of one axis."""

import math
from dataclasses import dataclass, replace

from threadpoolctl import threadpool_limits

from rhythmid.body.body import BODY
from rhythmid.body.inertial_parameter import CENTRE, LOAD, MASS, PAYLOAD, TURNING, split
from rhythmid.diagnose.case import Budget, Case
from rhythmid.diagnose.effort.run import EffortResult, effort_run
from rhythmid.diagnose.effort.search import MOST_EFFECTS
from rhythmid.elements.catalogue import Catalogue
from rhythmid.errors import InputError
from rhythmid.identify.inverse_dynamics.applicability import Applicability
from rhythmid.identify.inverse_dynamics.balance import Balance
from rhythmid.identify.inverse_dynamics.rests import told
from rhythmid.identify.joints.joint_motion import JointBalances
from rhythmid.model import INERTIA
from rhythmid.progress import Tell
from rhythmid.simulation.transport import INPUT_DELAY

# gain of log likelihood that a score test has to predict for an addition to be fitted: 1 in 70 reaches it by chance (chi-square),
# and a named effect has to gain more than twice as much
PROMISING = 3.0
# the name in an answer for a wrong quantity of a link
OF_LINKS = {
    MASS: "link_mass", TURNING: "link_inertia", PAYLOAD: "payload", CENTRE: "link_centre_of_mass", LOAD: "link_mass_and_centre"
}  # fmt: skip


@dataclass(frozen=True, eq=False)
class JointResult:
    """The result at one joint.

    `late` [s] is the additional delay of a reference where the effort was computed from it. `rotors` are the links' masses
    and inertias that act at the joint exactly like the inertia of its rotor.
    """

    joint: str
    case: Case
    late: float
    result: EffortResult
    rotors: tuple[str, ...] = ()

    @property
    def by_reference(self) -> bool:
        """Whether the joint's effort is computed by its controller from its reference."""
        return self.result.search.balance.by_reference


def joint_catalogue(catalogue: Catalogue) -> Catalogue:
    """The catalogue for a joint whose inertia and weight are known from the body.

    There an actuator's gain is not just calibration, and a spring may have any rest position: `at_joint` of the elements.
    """
    elements = catalogue.elements.items()
    return Catalogue({name: replace(one, **one.at_joint) if one.at_joint else one for name, one in elements})


@threadpool_limits.wrap(limits=1)  # many small matrices: threads would wait for each other
def diagnose_joint(
    balances: JointBalances, unseen: JointBalances | None, joint: str, catalogue: Catalogue, tell: Tell,
    budget: Budget, late: float = 0.0,
) -> JointResult:  # fmt: skip
    """Search for what one joint's path lacks; a reference acts `late` [s] after its stamp.

    Raises InputError where the records hold too little motion of the joint.
    """
    model = balances.models[joint]
    balance = balances.balance(joint, late)
    other: Balance | None = None
    if unseen is not None:
        try:
            other = unseen.balance(joint, late)
        except InputError:
            other = None  # too little motion: it cannot be used for judging
    case = Case(model, (), (), joint_catalogue(catalogue), None, tell, budget)
    found = effort_run(case, _applicable(balance), MOST_EFFECTS, other, PROMISING, len(balances.models))
    return JointResult(joint, case, late, found, balances.rotors(joint))


def _applicable(balance: Balance) -> Applicability:
    chosen = balance.bandwidth
    reason = f"the effort of each joint is predicted, below {chosen.effort:.3g} Hz at this one"
    reason = "; ".join(filter(None, (reason, told(balance.stuck))))
    return Applicability(
        True, reason, chosen.effort, math.nan, chosen.explained, math.nan, True, False, balance=balance
    )


def name_of(joint: str, label: str, by_reference: bool = False) -> tuple[str, str]:
    """Name and place of a wrong quantity of a joint whose label is not that of an element.

    It is a link's mass, inertia or payload, the rotor's inertia, or a delay: of the actuator, or where the effort is computed
    `by_reference`, of the reference.
    """
    if label == INERTIA:
        return "armature", joint
    if label.startswith(f"{BODY}."):
        link, kind = split(label.removeprefix(f"{BODY}."))
        return OF_LINKS[kind], link
    if label == INPUT_DELAY:
        return "input_delay" if by_reference else "actuator_delay", joint
    return label, joint
