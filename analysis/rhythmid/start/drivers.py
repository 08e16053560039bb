"""Driving signals of the machine: efforts, a forcing, a reference, or the motion of its base."""

from collections.abc import Sequence
from dataclasses import replace

from rhythmid.record.inventory import Recorded
from rhythmid.record.signals import InputKind
from rhythmid.start.direction import COPY, doubt_of_direction
from rhythmid.start.force_unit import doubt_of_units, matching, of_one_unit
from rhythmid.start.meaning import is_modelled, meaning_of, says_base, says_it_was_read
from rhythmid.start.relation import GOES_ALONG, HARDLY, coherent, follows
from rhythmid.start.role_choice import Ask, Choice, Known, chosen, pick, ranked_by_worth, strongest
from rhythmid.start.vocabulary import Quantity

SAYS_READ = "its name says that it was read from a sensor"


def not_read(left: Sequence[str]) -> str:
    """Note where an effort was preferred to others because of its name."""
    listed = ", ".join(left)
    return (
        f"{SAYS_READ}, and that of {listed} does not: where one of those is the machine's effort, put it here"
    )


def drivers(
    rest: list[Known], output: Recorded, measured: Quantity, ask: Ask
) -> tuple[dict[str, Choice], InputKind, Quantity]:
    """Driving signals of the machine: commanded and measured efforts, forcing, references, or the motion of its base."""
    efforts = [one for one in rest if one.quantity == "effort"]
    forcing = [one for one in efforts if one.meaning.forcing]
    efforts = [one for one in efforts if not one.meaning.forcing]
    efforts = [one for one in efforts if not is_modelled(one.one)] or efforts
    commanded = [one for one in efforts if one.meaning.commanded]
    sensed = [one for one in efforts if not one.meaning.commanded]
    sensed = [
        one for one in sensed if one.meaning.certain
    ] or sensed  # a number named as an effort comes before an unnamed one
    if commanded and not forcing:  # a wrench beside a command is an external force
        forcing = [
            one for one in sensed if one.one.type.startswith("geometry_msgs/") and "Wrench" in one.one.type
        ]
        sensed = [one for one in sensed if one not in forcing]
    found: dict[str, Choice] = {}
    if forcing:
        found["forcing"] = strongest(forcing, "moves most of what pushes from outside")
    reference, of = _reference(rest, output, measured)
    if reference is not None:
        commanded = [one for one in commanded if not _is_hardly_effort(one, output, HARDLY)]
        sensed = [one for one in sensed if not _is_hardly_effort(one, output, GOES_ALONG)]
    base = [one for one in rest if one.meaning.base and one.quantity in ("position", "acceleration")]
    if commanded and sensed:
        found["input"], found["effort"] = _commanded_and_measured(commanded, sensed, output, ask)
    elif commanded:
        found["input"] = _driving(commanded, output, "an effort that was asked for", ask)
    elif sensed and reference is not None:
        found["effort"] = _driving(sensed, output, "an effort that was measured", ask)
    elif sensed:
        found["input"] = _driving(sensed, output, "an effort, and nothing else drives", ask)
    elif base:
        found["input"], kind = _moving_base(base)
        return found, kind, of
    for role in ("input", "effort"):
        if base and role in found:
            found[role] = _beside_base(found[role], base)
            break
    if reference is not None and ("effort" in found or "input" not in found):
        if "input" in found or "effort" in found:
            found["reference"] = reference
        else:
            found["input"] = reference
            return found, "reference", of
    return found, "force", of


def _is_hardly_effort(one: Known, output: Recorded, least: float) -> bool:
    """Whether no name says that it is an effort, and its coherence with the output is below `least`.

    A reference drives both the output and other signals, such as a motion of the tool, so those are partly coherent
    with the output.
    """
    return meaning_of(one.one).quantity is None and coherent(one.one, output) < least


def _beside_base(choice: Choice, base: list[Known]) -> Choice:
    """The choice, with a doubt where a motion of the base was recorded as well and is not used."""
    listed = ", ".join(str(one.one) for one in base)
    doubt = f"a motion of the base was recorded, too ({listed}), and is not used: where it is what drives, make it the input, with its kind"
    return replace(choice, doubts=(*choice.doubts, doubt))


def _moving_base(base: list[Known]) -> tuple[Choice, InputKind]:
    """The largest motion of the base, and its kind."""
    choice = strongest(base, "the motion of the base")
    picked = next(one for one in base if one.one is choice.recorded)
    if picked.one.stated is None and not (says_base(picked.one) and picked.meaning.certain):
        doubt = (
            "taken for a displacement of the base: say  kind: base_acceleration  where it is its acceleration, kind: reference  where it "
            "is what a controller is asked for, and no kind where it is a force"
        )
        choice = replace(choice, doubts=(*choice.doubts, doubt))
    return choice, "base_displacement" if picked.quantity == "position" else "base_acceleration"


def _driving(able: list[Known], output: Recorded, reason: str, ask: Ask) -> Choice:
    """Among several efforts the one with the highest coherence with the output."""
    if len(able) == 1:
        return chosen(able[0], f"{reason}: {able[0].meaning.reason}")
    read = [one for one in able if says_it_was_read(one.one)] or able
    ranked = ranked_by_worth([(coherent(one.one, output) + 1e-9, one) for one in read])
    best = ranked[pick("What drives the machine (input)?", ranked, ask)][1]
    picked = next(one for one in able if one.one is best)
    others = [one.one for one in sorted(able, key=lambda one: one not in read) if one is not picked]
    share = coherent(best, output)
    along = f"of those it goes best with the output (coherence {share:.2f})"
    along = along if len(read) > 1 else SAYS_READ
    choice = chosen(picked, f"{reason}: {picked.meaning.reason}; {along}", others)
    left = [str(one.one) for one in able if one not in read]
    doubts = [not_read(left)] if left else []
    if len(read) > 1 and share < HARDLY:
        doubts.append(
            f"it hardly goes with the output (coherence {share:.2f}), and the others less: see that it drives the machine"
        )
    return replace(choice, doubts=(*choice.doubts, *doubts))


def _commanded_and_measured(
    commanded: list[Known], sensed: list[Known], output: Recorded, ask: Ask
) -> tuple[Choice, Choice]:
    """The measured effort with the highest coherence with the output, and the best such command in its unit."""
    commanded, sensed = of_one_unit(commanded, sensed)
    effort = _driving(sensed, output, "an effort that was measured", ask)
    command = _driving(matching(commanded, effort.recorded), output, "an effort that was asked for", ask)
    told = follows(command.recorded, effort.recorded)
    if told.correlation > COPY and not told.is_copy:
        doubt = f"it is {told.ratio:.3g} times the command: one of them is in another unit, or behind a gear"
        effort = replace(effort, doubts=(*effort.doubts, doubt))
    if doubt := doubt_of_units(command.recorded, effort.recorded):
        command = replace(command, doubts=(*command.doubts, doubt))
    return command, effort


def _reference(rest: list[Known], output: Recorded, measured: Quantity) -> tuple[Choice | None, Quantity]:
    """The commanded position, else velocity, that the output follows best."""
    for quantity in ("position", "velocity"):
        able = [
            one for one in rest if one.meaning.commanded and one.quantity == quantity and not one.meaning.base
        ]
        able = [one for one in able if one.meaning.joint == meaning_of(output).joint] or able
        if able and (quantity == measured or quantity == "velocity"):
            scored = [(follows(one.one, output), one) for one in able]
            if quantity == measured:
                scored = [
                    (told, one)
                    for told, one in scored
                    if told.is_answer or told.correlation > COPY or one.one.stated is not None
                ]
            if not scored:
                continue
            ranked = ranked_by_worth([(abs(told.correlation), one) for told, one in scored])
            told = follows(ranked[0][1], output)
            why = next(one.meaning.reason for one in able if one.one is ranked[0][1])
            reason = f"a {quantity} that was asked for: {why}"
            if quantity == measured and " follows it " not in why:
                when = f"{1e3 * abs(told.lag):.3g} ms {'earlier' if told.lag < 0.0 else 'later'}"
                when = when if told.lag else "at once"
                reason += f"; the output follows it {when} ({told.correlation:.2f} correlation)"
            doubt = doubt_of_direction(ranked[0][1], output) if quantity == measured else ""
            others = tuple(one for _, one in ranked[1:])
            return Choice(ranked[0][1], reason, others, (doubt,) if doubt else ()), quantity
    return None, "position"
