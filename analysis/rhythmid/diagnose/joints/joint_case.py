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
STIFFNESS = 0.1  # first guess of a spring: share of the effort at the size of the motion
# the name in an answer for a wrong quantity of a link
OF_LINKS = {
    MASS: "link_mass", TURNING: "link_inertia", PAYLOAD: "payload", CENTRE: "link_centre_of_mass", LOAD: "link_mass_and_centre"
}  # fmt: skip
GAINS = (0.9, 1.1)  # first guesses of an actuator's gain
# first guesses of a limit of the reference's rate, in standard deviations of the joint's speed: if the limit acts most of the time,
# the reference and the joint move at that rate
RATES = (0.7, 1.0, 1.4, 2.0, 2.8, 4.0)
# [Hz] usual rates at which a drive may take a new reference; faster ones do not show at the rates of records
CLOCKS = (125.0, 100.0, 80.0, 60.0, 50.0, 40.0, 30.0, 25.0, 20.0, 10.0)


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

    There an actuator's gain is not just calibration, and a spring may have any rest position.
    """
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
    # the friction model of simulated robots
    if (friction := found.get("soft_constraint_friction")) is not None:
        found[friction.name] = replace(friction, candidate=True)
    if (
        constant := found.get("constant_force")
    ) is not None:  # a spring at rest far from the motion acts like a constant force
        found[constant.name] = replace(constant, special_case_of=(*constant.special_case_of, "linear_spring"))
    return Catalogue(found)


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
