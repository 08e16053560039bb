"""An identification of several joints as text for a terminal."""

from typing import TYPE_CHECKING

from rich.console import Console
from rich.markup import escape

from rhythmid.identify.caution import GIVEN_VALUES
from rhythmid.report.quantity import rounded, written_percent
from rhythmid.report.terminal_table import print_table

if TYPE_CHECKING:
    from rhythmid.identify.joints.joint_identification import MachineIdentification


def show_identification(found: "MachineIdentification", console: Console) -> None:
    """Print an identification: parameters, inertias, errors, and parameters that are not identifiable separately."""
    if not found.usable:
        missed = ", ".join(map(escape, found.not_identified))
        console.print(
            f"[bold]not identified: {missed}: {found.missed}, so none of their values can be used[/]"
        )
        console.print(f"  {GIVEN_VALUES}")
    rows = []
    for name, one in found.parameters.items():
        low, high = (rounded(end, one.std) for end in one.interval)
        ends = ", ends at its bound" if one.at_bound else ""
        rows.append((name, rounded(one.value, one.std), f"{low} to {high}{ends}", one.unit))
    title = "parameters"
    if set(found.not_identified) >= set(found.effort_nrmse):
        title += " of a fit that is not usable"
    elif found.not_identified:
        title += f"; those of {', '.join(found.not_identified)} are not usable"
    print_table(console, title, ("name", "value", "95 % interval", "unit"), rows)
    if found.inertia is not None:
        seen = found.inertia
        console.print(
            f"{seen.rank} of {seen.count} inertial parameters, or combinations of them, are seen; condition {seen.condition:.3g}"
        )
        for link, values in seen.links.items():
            centre = ", ".join(f"{values[name] / values['m']:.4g}" for name in ("mx", "my", "mz"))
            console.print(f"{escape(link)}: mass {values['m']:.4g} kg, centre at ({centre}) m")
    for joint, error in found.effort_nrmse.items():
        runs = ", ".join(f"{written_percent(one[joint])} {name}" for name, one in found.free_run.items())
        console.print(
            f"{escape(joint)}: effort missed by {written_percent(error)}; free run, held out: {runs or 'none'}"
        )
    for label, lines in (("not separable", found.not_separable), ("note", found.notes)):
        for line in lines:
            console.print(f"{label}: {escape(line)}")
