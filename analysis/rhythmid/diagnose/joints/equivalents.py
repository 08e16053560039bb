"""Names that the records of a joint cannot separate: effects, values of the body, delays.

The search lists effects that predict as well as the chosen one. A value of the body may do so, too. The inertia of a link that
turns about one fixed axis is exactly equivalent to that of the rotor, so that no search tries both.
"""

from rhythmid.body.body import BODY
from rhythmid.diagnose.joints.joint_case import JointResult, name_of
from rhythmid.diagnose.probability import joint_probability
from rhythmid.diagnose.selection import equivalent
from rhythmid.model import INERTIA
from rhythmid.simulation.transport import INPUT_DELAY


def equivalents(one: JointResult) -> tuple[tuple[str, ...], ...]:
    """Groups of equivalent names at a joint, the chosen one first; a value of the body is given by its label."""
    contest, chosen = one.result.contest, one.result.selection.chosen
    groups = {group[0]: list(group) for group in one.result.decision.equivalent}
    for label, name in zip(chosen.elements, chosen.names, strict=True):
        rest = set(chosen.elements) - {label}
        found = groups.setdefault(name, [name])
        for other in contest.hypotheses:
            more = set(other.elements) - rest
            if len(other.elements) != len(chosen.elements) or len(more) != 1 or other.key == chosen.key:
                continue
            (its,) = more
            if _of_body(its) and equivalent(other, chosen, contest):
                found.append(its)
        if label == INERTIA:
            found += [f"{BODY}.{rotor}" for rotor in one.rotors]
    return tuple(tuple(dict.fromkeys(group)) for group in groups.values() if len(set(group)) > 1)


def equivalent_names(one: JointResult) -> tuple[tuple[str, ...], ...]:
    """The groups in the form of an answer: a value of the body is given as the quantity that is wrong, such as `link_mass`."""
    named = (
        tuple(dict.fromkeys(name_of(one.joint, name, one.by_reference)[0] for name in group))
        for group in equivalents(one)
    )
    return tuple(group for group in named if len(group) > 1)


def shared_among(one: JointResult, label: str) -> int:
    """Number of equivalent names, untested against one another, among which the probability of one name is shared."""
    return 1 + len(one.rotors) if label == INERTIA else 1


def probability_together(one: JointResult, label: str) -> float:
    """Probability that a chosen effect of a joint, or one of the names in its place, is what the path lacks.

    They share the chance that the effect is a law at all; what they hold of the evidence adds up.
    """
    decision, contest, chosen = one.result.decision, one.result.contest, one.result.selection.chosen
    name = dict(zip(chosen.elements, chosen.names, strict=True))[label]
    own = joint_probability([name], contest, chosen, decision.weights)
    alike = {name, *chosen.richer.get(name, ())}.union(*(g for g in equivalents(one) if g[0] == name))
    held = sum(decision.weights.get(h.key, 0.0) for h in contest.hypotheses if alike & set(h.names))
    return min(decision.probability[label] * max(held / own, 1.0), 1.0) if own > 0.0 else 0.0


def _of_body(label: str) -> bool:
    return label in (INERTIA, INPUT_DELAY) or label.startswith(f"{BODY}.")
