"""Print a diagnosis of several joints."""

from rich.console import Console
from rich.markup import escape

from rhythmid.diagnose.answer.result import Diagnosis
from rhythmid.diagnose.joints.joint_answer import MachineDiagnosis
from rhythmid.diagnose.joints.misfit import left_in_words
from rhythmid.report.quantity import with_std, written_percent
from rhythmid.report.terminal_table import print_table


def show_diagnosis(found: MachineDiagnosis, console: Console) -> None:
    """Print a diagnosis: the verdict, what is missing at which joint, then a row for every joint."""
    console.print(f"[bold]{found.verdict.replace('_', ' ')}[/]: {escape(found.summary)}")
    for one in found.missing:
        what = one.of_link or one.element
        console.print(
            f"[bold]{escape(one.place)}: {escape(what)}[/]   {escape(one.equation)}   (probability {one.probability:.2f}, "
            f"{written_percent(one.share)} of the joint's mismatch)"
        )
        for name, value in one.parameters.items():
            console.print(f"  {name}: {with_std(value.value, value.std)} {escape(value.unit)}")
    for joint, families in found.families.items():
        for one in families:
            console.print(
                f"{escape(joint)}: some form of {one.family} (probability {one.probability:.2f}, {written_percent(one.share)} of the "
                f"joint's mismatch): {', '.join(one.laws)}"
            )
    for group in found.indistinguishable:
        console.print(f"indistinguishable here: {escape(', '.join(group))}")
    rows = []
    for joint, one in found.joints.items():
        before, after = (one.fit[name].heldout_nrmse for name in ("refitted_nominal", "augmented"))
        rows.append(
            (
                joint,
                one.verdict.replace("_", " "),
                written_percent(before),
                written_percent(after),
                left_words(one),
            )
        )
    title = "error of the effort on data that no fit has seen, as a share of it"
    print_table(console, title, ("joint", "verdict", "nominal", "augmented", "left"), rows)
    for joint, why in found.not_judged.items():
        console.print(f"not judged: {escape(joint)}: {escape(why)}")
    for label, lines in (("assumption", found.assumptions), ("note", found.notes)):
        for line in lines:
            console.print(f"{label}: {escape(line)}")
    console.print(f"next experiment: {escape(found.next_experiment)}")


def left_words(one: Diagnosis) -> str:
    """The unexplained share of a joint's mismatch, in words; a dash where there is no mismatch."""
    left = one.remainder
    return left_in_words(one.verdict, left.share, left.significant, one.fit["augmented"].heldout_nrmse)
