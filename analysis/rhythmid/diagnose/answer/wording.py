"""The sentences of a diagnosis: where, what, how much better, and which nominal values the records contradict."""

import math
from collections import Counter
from collections.abc import Mapping, Sequence

from rhythmid.body.body import BODY
from rhythmid.diagnose.answer.result import FitQuality, Location, MissingEffect
from rhythmid.diagnose.constants import CONTRADICTS, CONTRADICTS_LEAST, STATED
from rhythmid.diagnose.hypothesis import Hypothesis, Verdict
from rhythmid.diagnose.verdict import Decision
from rhythmid.diagnose.verdict_rules import LONGER_DELAY
from rhythmid.elements.places import SENTENCES
from rhythmid.model import Model
from rhythmid.report.quantity import in_words, number, sentence, with_std, with_written_unit
from rhythmid.simulation.transport import INPUT_DELAY

NOT_LOCATED = "not located"


def location_of(
    missing: Sequence[MissingEffect],
    verdict: Verdict,
    whole: str,
    evidence: Sequence[str],
    slot: str | None,
    depends: str = "",
) -> Location:
    """Where the named effects act; without any, the likeliest `slot`, and what the mismatch `depends` on.

    `whole` is what the nominal model explains where nothing is missing.
    """
    slots = list(dict.fromkeys(effect.slot for effect in missing))
    if slots:
        return Location(slots[0], "; and ".join(SENTENCES[one] for one in slots), tuple(evidence))
    if verdict == "consistent":
        return Location(None, f"nowhere: the refitted nominal model explains the {whole}", tuple(evidence))
    return Location(slot, SENTENCES.get(slot or "", NOT_LOCATED) + depends, tuple(evidence))


def _some_form_of(decision: Decision, stated: Sequence[str] = ()) -> str:
    """Families that are probable enough to be reported and have no `stated` law; empty where there are none."""
    told = [
        f"some form of {one.family} ({100.0 * one.probability:.0f} %)"
        for one in decision.families
        if one.probability >= STATED and not set(one.laws) & set(stated)
    ]
    return f"The model lacks {' and '.join(told)}" if told else ""


def _agreed(decision: Decision) -> str:
    """The effects that nearly all of the evidence contains, in a sentence; empty where there are none."""
    if not decision.agreed:
        return ""
    names = listed(decision.agreed)
    return f"Nearly all of the evidence contains {names}, whatever else is missing. "


def _alike(decision: Decision) -> str:
    groups = "; nor ".join(listed(group) for group in decision.equivalent)
    return f"These records do not separate {groups}."


def summary_of(
    decision: Decision,
    missing: Sequence[MissingEffect],
    plain: FitQuality,
    augmented: FitQuality,
    whole: str,
    freed: str | None = None,
    noise_known: bool = True,
) -> str:
    """The verdict in a sentence or two.

    `whole` is the quantity that errors are a share of. `freed` describes the value that the chosen hypothesis frees besides its
    effects: one that is fixed, or the delay. `noise_known`: whether the noise is known otherwise than as what the model leaves.
    """
    value = sentence(freed or "")
    if decision.verdict == "missing_physics":
        return _lacking(decision, missing, plain, augmented, whole, value)
    if value:
        return f"{_agreed(decision)}{value}"
    if decision.verdict == "consistent":
        return _nothing_missing(decision, plain, whole, noise_known)
    if decision.verdict == "undecided":
        return _undecided(decision, missing)
    nearest = f" The nearest known {'effect does' if len(missing) == 1 else 'effects do'} not explain it: {_names(missing)}."
    return f"Something is missing that the catalogue does not know: {decision.reason}." + (
        nearest if missing else ""
    )


def _names(missing: Sequence[MissingEffect]) -> str:
    return listed([effect.element for effect in missing])


def _nothing_missing(decision: Decision, plain: FitQuality, whole: str, noise_known: bool) -> str:
    said = "Nothing of practical size is missing: with its parameters refitted, the nominal model explains the records"
    left = decision.unexplained
    if noise_known and not left.significant:
        return f"{said} down to the noise."
    small = f"{number(100.0 * plain.error, 2)} % of the {whole}"
    if left.significant:
        return f"{said} but for {small}, part of which depends on {left.goes_with}."
    return f"{said} but for {small}, in which no test finds a cause."


def _lacking(
    decision: Decision, missing: Sequence[MissingEffect], plain: FitQuality, augmented: FitQuality,
    whole: str, value: str,
) -> str:  # fmt: skip
    said = f"The model lacks {_names(missing)}."
    if decision.equivalent:
        said += f" {_alike(decision)}"
    before, after = plain.heldout_nrmse, augmented.heldout_nrmse
    if before is not None and after is not None:
        beside = listed(decision.beside)
        if beside:
            verb = "is" if len(decision.beside) == 1 else "are"
            beside = f" and {beside}, which {verb} too uncertain to be named"
        said += (
            f" With {'it' if len(missing) == 1 else 'them'}{beside}, the error on held-out data falls from {100 * before:.2f} % to "
            f"{100 * after:.2f} % of the {whole}."
        )
    left = decision.unexplained
    if left.significant and left.share > 0.0:
        said += f" {number(100.0 * left.share, 2)} % of the mismatch is left and depends on {left.goes_with}."
    families = _some_form_of(decision, [effect.element for effect in missing])
    return f"{said} {value}".strip() + (f" {families}, too; the law is undecided." if families else "")


def _undecided(decision: Decision, missing: Sequence[MissingEffect]) -> str:
    families = _some_form_of(decision)
    law = f"{families}, but the law is undecided: {decision.reason}."
    said = law if families else sentence(decision.reason)
    groups = decision.equivalent
    of_main = bool(groups) and (not missing or groups[0][0] == missing[0].element)
    if of_main and decision.rule == "rivals":
        open_ = {name for group in groups for name in group}
        others = listed([one.element for one in missing if one.element not in open_])
        rivals = "; and ".join(listed(group, "or") for group in groups)
        return f"{said} They are {rivals}{f', each beside {others}' if others else ''}."
    main = (
        f", of which {in_words(missing[0].element)} explains {missing[0].share:.0%} of the mismatch"
        if len(missing) > 1
        else ""
    )
    said += f" Best so far: {_names(missing)}{main}." if missing else ""
    return said + (f" {_alike(decision)}" if groups else "")


def listed(names: Sequence[str], word: str = "and") -> str:
    """Names in words: "a", "a and b", "a, b and c"; `word` may be "or". A repeated name gets a number."""
    said = [
        in_words(name) if count == 1 else f"{in_words(name)} ({count} of them)"
        for name, count in Counter(names).items()
    ]
    return f" {word} ".join([", ".join(said[:-1]), said[-1]] if len(said) > 1 else said)


def freed_value(nominal: Model, fitted: Model, chosen: Hypothesis) -> str | None:
    """Sentences about the fixed values that the chosen hypothesis frees besides its effects; None where it frees none."""
    if chosen.kind != "freed_value":
        return None
    effects = [label for label in chosen.elements if fitted.term(label) is not None]
    freed = [name for name in chosen.elements if name not in effects]
    beside = f" with {listed(effects)}" if effects else ""
    values = [
        f"{_of_body(name)} is fixed at {with_written_unit(f'{held.value:.4g}', held.unit)}. If it is free, it is estimated at {fitted.value(name):.4g}"
        for name, held in ((name, nominal.parameters[name]) for name in freed)
    ]
    what = "that value" if len(freed) == 1 else "these values"
    # the file of a body does not mark free parameters
    file = any(name.startswith(f"{BODY}.") for name in freed)
    return (
        f"{'. '.join(values)}, and this{beside} predicts the records better than any effect beside the fixed value: check {what}"
        f"{'' if file else ', or drop its ' + repr('fixed: true')}."
    )


def _of_body(name: str) -> str:
    """A value as the model's file names it; one of a body in words."""
    return in_words(name) if name.startswith(f"{BODY}.") else name


def recalibrated(nominal: Model, fitted: Model, stds: Mapping[str, float]) -> tuple[str, ...]:
    """Nominal values that the records contradict, as sentences; `stds` are standard deviations of the estimated parameters, by name."""
    said = []
    for name, value in nominal.parameters.items():
        if name not in stds or name not in fitted.parameters:
            continue
        new, std = fitted.value(name), stds[name]
        least = max(CONTRADICTS * std, CONTRADICTS_LEAST * abs(value.value))
        if math.isfinite(std) and abs(new - value.value) > least:
            said.append(
                f"{name}: {value.value:.6g} in the nominal model, {with_written_unit(with_std(new, std), value.unit)} in the "
                "records"
            )
    return tuple(said)


def longer_delay(delay: float, std: float | None, decision: Decision) -> str | None:
    """The sentence about a delay [s] that alone explains the records; None where the verdict does not rest on it."""
    if decision.rule != LONGER_DELAY:
        return None
    late = with_std(1e3 * delay, None if std is None else 1e3 * std)
    return f"The input is delayed by {late} ms, longer than was given, and that explains the records."


def unstated_delay(delay: float, std: float | None) -> tuple[str, ...]:
    """A delay [s] that the records show and the nominal model does not have, as a sentence; none where noise may explain it."""
    if std is None or not math.isfinite(std) or delay <= CONTRADICTS * std:
        return ()
    return (
        f"{INPUT_DELAY}: none in the nominal model, {with_std(1e3 * delay, 1e3 * std)} ms in the records",
    )
