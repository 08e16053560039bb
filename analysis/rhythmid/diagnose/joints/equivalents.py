"""Names that the records of a joint do not separate: effects, values of the body, delays.

The search lists effects that predict as well as the chosen one. A value of the body may do so, too: a link that turns about one fixed axis is felt
as the rotor is, exactly, so that no search tries both.
"""

from rhythmid.body.body import BODY
from rhythmid.diagnose.joints.joint_case import JointResult, name_of
from rhythmid.diagnose.selection import equivalent
from rhythmid.model import INERTIA
from rhythmid.simulation.transport import INPUT_DELAY


def equivalents(one: JointResult) -> tuple[tuple[str, ...], ...]:
    """Groups of names at a joint that predict as well as one another, the chosen one first; a value of the body goes by its label."""
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
    """The groups as an answer has them: a value of the body goes by what is wrong with it, such as `link_mass`."""
    named = (
        tuple(dict.fromkeys(name_of(one.joint, name, one.by_reference)[0] for name in group))
        for group in equivalents(one)
    )
    return tuple(group for group in named if len(group) > 1)


def shared_among(one: JointResult, label: str) -> int:
    """Among how many names the probability of one is to be shared that no search has tried against one another."""
    return 1 + len(one.rotors) if label == INERTIA else 1


def _of_body(label: str) -> bool:
    return label in (INERTIA, INPUT_DELAY) or label.startswith(f"{BODY}.")
