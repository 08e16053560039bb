"""What a diagnosis of several joints is asked, and each joint of it as a case of one axis."""

import math
from dataclasses import dataclass, replace

from threadpoolctl import threadpool_limits

from rhythmid.body.body import BODY
from rhythmid.body.inertial_parameter import MASS, PAYLOAD, TURNING, split
from rhythmid.diagnose.case import Budget, Case
from rhythmid.diagnose.effort.run import EffortResult, effort_run
from rhythmid.diagnose.effort.search import MOST_EFFECTS
from rhythmid.elements.catalogue import Catalogue
from rhythmid.errors import InputError
from rhythmid.identify.inverse_dynamics.applicability import Applicability
from rhythmid.identify.inverse_dynamics.balance import Balance
from rhythmid.identify.inverse_dynamics.rests import told
from rhythmid.identify.joints.joint_motion import JointBalances
from rhythmid.model import INERTIA, Model
from rhythmid.progress import Tell
from rhythmid.simulation.transport import INPUT_DELAY

# gain of log likelihood that a score test has to promise for an addition to be fitted: 1 in 70 reaches it by chance (chi-square), and
# what is named has to gain more than twice as much
PROMISING = 3.0
STIFFNESS = 0.1  # of the effort for the motion's size, that a spring is tried at
# how an answer names what is wrong with a link
OF_LINKS = {MASS: "link_mass", TURNING: "link_inertia", PAYLOAD: "payload"}
GAINS = (0.9, 1.1)  # at which it is tried whether an actuator gives less or more than is asked of it
# standard deviations of a joint's speed at which a limit of its reference's rate is tried: a reference that the limit keeps back most of the time
# moves at that rate, so that the joint does
RATES = (0.7, 1.0, 1.4, 2.0, 2.8, 4.0)
# [Hz] at which a drive may take a new reference: round ones, below those of records, which show no faster one
CLOCKS = (125.0, 100.0, 80.0, 60.0, 50.0, 40.0, 30.0, 25.0, 20.0, 10.0)


@dataclass(frozen=True, eq=False)
class JointResult:
    """What was found at one joint; `late` [s] by how much later a reference acts where the effort was made from it, `rotors` the links' masses and
    inertias that the joint feels as it does its rotor's."""

    joint: str
    case: Case
    late: float
    result: EffortResult
    rotors: tuple[str, ...] = ()

    @property
    def by_reference(self) -> bool:
        """Whether the joint's effort is what its controller makes of its reference."""
        return self.result.search.balance.by_reference


def joint_catalogue(catalogue: Catalogue) -> Catalogue:
    """The catalogue for a joint, whose inertia and weight are known from the body: there an actuator's gain is no mere calibration,
    and a spring may be at rest anywhere."""
    found = dict(catalogue.elements)
    if (gain := found.get("actuator_gain")) is not None:
        found[gain.name] = replace(gain, candidate=True, starts=lambda _: [{"gain": one} for one in GAINS])
    if (spring := found.get("linear_spring")) is not None:
        found[spring.name] = replace(
            spring,
            starts=lambda s: [
                {"stiffness": STIFFNESS * s.effort / s.position, "rest_length": rest}
                for rest in (s.low, s.centre, s.high)
            ],
        )
    if (limit := found.get("reference_rate_limit")) is not None:
        found[limit.name] = replace(limit, starts=lambda s: [{"rate": one * s.velocity} for one in RATES])
    if (hold := found.get("command_hold")) is not None:
        found[hold.name] = replace(
            hold, starts=lambda s: [{"period": 1.0 / rate} for rate in CLOCKS if 4.0 * s.frequency < rate]
        )
    # what the joints of a simulated robot have
    if (friction := found.get("soft_constraint_friction")) is not None:
        found[friction.name] = replace(friction, candidate=True)
    if (constant := found.get("constant_force")) is not None:  # a spring that is at rest far from the motion
        found[constant.name] = replace(constant, special_case_of=(*constant.special_case_of, "linear_spring"))
    return Catalogue(found)


@threadpool_limits.wrap(limits=1)  # many small matrices: threads would wait for each other
def diagnose_joint(
    balances: JointBalances, unseen: JointBalances | None, joint: str, catalogue: Catalogue, tell: Tell,
    budget: Budget, late: float = 0.0,
) -> JointResult:  # fmt: skip
    """Search for what one joint's path lacks; a reference acts there `late` [s] after its stamp. Raises InputError where the records hold too little of its motion."""
    model = balances.models[joint]
    balance = balances.balance(joint, late)
    other: Balance | None = None
    if unseen is not None:
        try:
            other = unseen.balance(joint, late)
        except InputError:
            other = None  # too little motion: it judges nothing
    case = Case(model, (), (), joint_catalogue(catalogue), None, tell, budget)
    found = effort_run(
        case, _applicable(balance, model), MOST_EFFECTS, other, PROMISING, len(balances.models)
    )
    return JointResult(joint, case, late, found, balances.rotors(joint))


def _applicable(balance: Balance, model: Model) -> Applicability:
    chosen = balance.bandwidth
    reason = f"the effort of each joint is predicted, below {chosen.effort:.3g} Hz at this one"
    reason = "; ".join(filter(None, (reason, told(balance.stuck))))
    return Applicability(
        True, reason, chosen.effort, math.nan, chosen.explained, math.nan, True, False, balance=balance
    )


def name_of(joint: str, label: str, by_reference: bool = False) -> tuple[str, str]:
    """What was found wrong at a joint, and where, of a label that is no element's: a link's mass, its inertia, its payload, the rotor's
    inertia, a delay: of the actuator, or where the effort is made `by_reference` of that."""
    if label == INERTIA:
        return "armature", joint
    if label.startswith(f"{BODY}."):
        link, kind = split(label.removeprefix(f"{BODY}."))
        return OF_LINKS[kind], link
    if label == INPUT_DELAY:
        return "input_delay" if by_reference else "actuator_delay", joint
    return label, joint
