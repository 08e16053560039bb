"""The diagnosis on recordings of real machines and on simulated machines with clutter, in one table.

    python benchmarks/real_recordings.py [--only pendulum,xl330] [--budget S] [--limit S] [--folder DIR] [--markdown] [--json FILE] [--list]
    python benchmarks/real_recordings.py --rows FILE [FILE ...] [--markdown]

Every case is diagnosed by the command `rhythmid diagnose` in a separate process, so that its processor time can be measured. Printed for
each: number of records for the fit + held out; verdict; names with probability, the dominant one first; error on held-out records of the
refitted nominal and of the augmented model, in % of the motion or, where the effort is predicted, of the effort; share, the part of the
mismatch's power that all names together explain; kind of scoring; processor seconds; the largest relative error of the known parameters
that were found; and, if the answer is known, whether it is right: `first`, the accepted effect comes first and is stated (or nothing is named if nothing is missing); `listed`, it comes first but
is not stated; `no` otherwise.

The recordings are searched in $RHYTHMID_DATA, else in ../shared/data beside the checkout (docs/real.md); without them only the simulated
machines are run. `--folder` keeps signals.yaml, model.yaml, tables and answers; `--limit` ends a case after so many seconds of
wall time; `--budget` is passed on to the diagnosis. `--rows` prints the rows of earlier runs again.
"""

import argparse
import json
import resource
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from bench_case import Case
from cluttered_machines import cluttered_cases
from recording_sets import real_cases

from rhythmid.elements.catalogue import load_catalogue

HEADS = (
    "set",
    "records",
    "nominal",
    "verdict",
    "names",
    "held out, %",
    "share",
    "scoring",
    "CPU s",
    "off, %",
    "right",
)
SAID = 120  # characters of an error message that the table shows


@dataclass(frozen=True)
class Row:
    """The answer to one case; errors are relative (1 = as large as the motion or the effort), NaN-free: None if not stated."""

    case: str
    records: str
    nominal: str
    verdict: str
    names: tuple[tuple[str, float], ...]
    before: float | None
    after: float | None
    share: float | None
    scoring: str
    cpu: float
    right: str
    off: float | None = None  # largest relative error of the parameters that are known and were found


def diagnosed(case: Case, folder: Path, budget: float | None, limit: float) -> Row:
    """The answer of `rhythmid diagnose` to `case`; its JSON and the augmented model stay in `folder`."""
    stem = case.name.replace(" ", "_")
    answer, augmented = folder / f"{stem}.json", folder / f"{stem}-augmented.yaml"
    command = [
        sys.executable, "-m", "rhythmid.cli", "diagnose", *map(str, case.train), "--model", str(case.model),
        "--json", str(answer), "--save-model", str(augmented),
    ]  # fmt: skip
    for path in case.holdout:
        command += ["--holdout", str(path)]
    if budget is not None:
        command += ["--budget", str(budget)]
    for path in (answer, augmented):
        path.unlink(missing_ok=True)
    before = _children()
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=limit)
        said = _last_line(done.stderr).replace(f"{folder}/", "")
        failure = f"exit {done.returncode}: {said[:SAID]}" if done.returncode else ""
    except subprocess.TimeoutExpired:
        failure = f"stopped after {limit:g} s"
    cpu = _children() - before
    found = json.loads(answer.read_text()) if not failure and answer.exists() else None
    return row_of(case, found, cpu, failure)


def row_of(case: Case, found: dict[str, Any] | None, cpu: float, failure: str = "") -> Row:
    """The row of an answer `found`, the JSON of a diagnosis; None where there is none, with what failed."""
    records = f"{len(case.train)}+{len(case.holdout)}"
    if found is None:
        return Row(case.name, records, case.nominal, failure, (), None, None, None, "", cpu, "no")
    names = tuple((effect["element"], float(effect["probability"])) for effect in found["missing"])
    before = found["fit"]["refitted_nominal"]["heldout_nrmse"]
    after = found["fit"]["augmented"]["heldout_nrmse"]
    told = [effect["share"] for effect in found["missing"] if effect.get("share") is not None]
    share = sum(told) if told else None
    if share is None and names and before and after is not None:
        share = 1.0 - (after / before) ** 2
    scoring = found.get("scoring", "")
    kind = scoring["kind"] if isinstance(scoring, dict) else str(scoring).split(",")[0].split(":")[0]
    return Row(
        case.name, records, case.nominal, found["verdict"], names, before, after, share, kind, cpu, judged(case, found, names), known_error(case, found),
    )  # fmt: skip


def known_error(case: Case, found: dict[str, Any]) -> float | None:
    """Largest relative error of the parameters that are known and were found; None where there is none."""
    values = {name: one["value"] for name, one in found.get("parameters", {}).items()}
    return max(
        (abs(values[name] / true - 1.0) for name, true in case.truth.items() if name in values), default=None
    )


def judged(case: Case, found: dict[str, Any], names: Sequence[tuple[str, float]]) -> str:
    """Whether an answer is right: `first`, `listed`, `no`, or empty where no answer is accepted."""
    if case.first is None:
        return ""
    if not case.first:
        return "first" if found["verdict"] == "consistent" else "no"
    listed = [name for name, _ in names] or [
        element for one in found.get("hypotheses", [])[:1] for element in one["elements"][:1]
    ]
    if not listed or listed[0] not in case.first:
        return "no"
    return "first" if found["verdict"] == "missing_physics" else "listed"


def cells(row: Row) -> tuple[str, ...]:
    """The row as words, in the order of HEADS."""
    names = ", ".join(f"{name} {probability:.2f}" for name, probability in row.names) or "-"
    errors = (
        "-"
        if row.before is None
        else f"{100 * row.before:.3g} → {'-' if row.after is None else f'{100 * row.after:.3g}'}"
    )
    share = "-" if row.share is None else f"{row.share:.2f}"
    return (
        row.case, row.records, row.nominal, row.verdict, names, errors, share, row.scoring, f"{row.cpu:.0f}",
        "-" if row.off is None else f"{100 * row.off:.0f}", row.right,
    )  # fmt: skip


def table(rows: Iterable[Row], markdown: bool = False) -> str:
    """All rows in one table."""
    lines = [HEADS, *(cells(row) for row in rows)]
    if markdown:
        head, *rest = ["| " + " | ".join(line) + " |" for line in lines]
        return "\n".join([head, "|" + " --- |" * len(HEADS), *rest])
    widths = [max(len(line[index]) for line in lines) for index in range(len(HEADS))]
    return "\n".join(
        "  ".join(cell.ljust(width) for cell, width in zip(line, widths)).rstrip() for line in lines
    )


def mirrored(rows: Sequence[Row]) -> list[str]:
    """Whether the left and right joints of a quadruped get dominant names of the same family."""
    catalogue = load_catalogue()
    first = {
        row.case.removeprefix("go2 "): row.names[0][0] if row.names else row.verdict
        for row in rows
        if row.case.startswith("go2 ")
    }
    lines: list[str] = []
    for left, name in first.items():
        right = left.replace("L_", "R_", 1)
        if "L_" in left and right in first:
            families = {
                catalogue[one].family or one if one in catalogue else one for one in (name, first[right])
            }
            verb = "agree" if len(families) == 1 else "differ"
            lines.append(f"{left} and {right} {verb}: {name}, {first[right]}")
    return lines


def by_set(rows: Sequence[Row]) -> list[str]:
    """Right answers and processor time by set."""
    sets = dict.fromkeys(row.case.split()[0] for row in rows)
    lines: list[str] = []
    for name in sets:
        own = [row for row in rows if row.case.split()[0] == name]
        known = [row for row in own if row.right]
        lines.append(
            f"{name}: {sum(row.right == 'first' for row in known)} of {len(known)} right, {sum(row.cpu for row in own):.0f} s CPU"
        )
    return lines


def saved_rows(paths: Iterable[Path]) -> list[Row]:
    """Rows that `--json` wrote; a case that was run again counts as it was run last."""
    found: dict[str, Row] = {}
    for path in paths:
        for one in json.loads(path.read_text()):
            names = tuple((str(name), float(probability)) for name, probability in one.pop("names"))
            found[one["case"]] = Row(**one, names=names)
    return list(found.values())


def told(rows: Sequence[Row], markdown: bool) -> None:
    """Print all rows and their sums."""
    print(table(rows, markdown), end="\n\n")
    for line in (*mirrored(rows), *by_set(rows)):
        print(line)
    known = [row for row in rows if row.right]
    print(
        f"{sum(row.right == 'first' for row in known)} of {len(known)} right; {sum(row.cpu for row in rows):.0f} s CPU"
    )


def _children() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def _last_line(text: str) -> str:
    lines = [line for line in text.splitlines() if line.strip()]
    return lines[-1] if lines else ""


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--only", default="", help="sets or cases by the beginning of their names, comma-separated"
    )
    parser.add_argument("--budget", type=float, help="passed on to the diagnosis [s]")
    parser.add_argument("--limit", type=float, default=1800.0, help="wall time a case may take [s]")
    parser.add_argument("--folder", type=Path, help="where files and answers are kept")
    parser.add_argument("--markdown", action="store_true", help="print the table for a document")
    parser.add_argument("--json", type=Path, help="write the rows there, after every case")
    parser.add_argument("--list", action="store_true", help="name the cases and end")
    parser.add_argument("--rows", type=Path, nargs="+", help="print the rows in these files of earlier runs")
    chosen = parser.parse_args()
    if chosen.rows:
        told(saved_rows(chosen.rows), chosen.markdown)
        return
    wanted = [word.strip() for word in chosen.only.split(",") if word.strip()]

    def is_wanted(name: str) -> bool:
        return not wanted or any(name.startswith(word) for word in wanted)

    with tempfile.TemporaryDirectory() as temporary:
        folder: Path = chosen.folder or Path(temporary)
        folder.mkdir(parents=True, exist_ok=True)
        folder = folder.resolve()
        cases = [case for case in real_cases(folder) if is_wanted(case.name)]
        cases += cluttered_cases(folder, is_wanted)
        if chosen.list:
            print("\n".join(case.name for case in cases))
            return
        rows: list[Row] = []
        for case in cases:
            rows.append(diagnosed(case, folder, chosen.budget, chosen.limit))
            print("  ".join(cells(rows[-1])), file=sys.stderr, flush=True)
            if chosen.json:  # after every case, so that a run that is ended early is not lost
                chosen.json.write_text(json.dumps([asdict(row) for row in rows], indent=1) + "\n")
    told(rows, chosen.markdown)


if __name__ == "__main__":
    main()
