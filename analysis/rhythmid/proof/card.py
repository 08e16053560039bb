"""The score card: rates with their intervals, by kind of case and size of the mismatch, and the confusion matrix."""

import math
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from rhythmid.proof.rate import Rate, rate
from rhythmid.proof.reliability import reliability, reliability_lines
from rhythmid.proof.score import SURE, Estimated, Score
from rhythmid.statistics import NORMAL_95

BINS = ((0.3, 1.0), (1.0, 3.0), (3.0, math.inf))


def coverage(estimates: Sequence[Estimated]) -> Rate:
    """Rate of 95 % intervals that contain the true value."""
    return Rate(sum(abs(one.deviation) <= NORMAL_95 for one in estimates), len(estimates))


def said(score: Score) -> str:
    """The answer to a case in a word or two."""
    if score.outcome in ("exact", "family", "wrong"):
        return " + ".join(score.named)
    return score.outcome


def confusion(scores: Sequence[Score]) -> dict[str, Counter[str]]:
    """Counts of the answers given for each concealed effect."""
    table: dict[str, Counter[str]] = {}
    for one in scores:
        table.setdefault(" + ".join(one.true) or "nothing", Counter())[said(one)] += 1
    return dict(sorted(table.items()))


def _rates(kind: str, scores: Sequence[Score]) -> dict[str, Rate]:
    """The rates of a kind of case, by what they count."""
    sure = {f"stated with p ≥ {SURE} and wrong": rate(scores, lambda s: bool(s.stated_wrong))}
    if kind == "null":
        found = {
            "something named": rate(scores, lambda s: s.verdict == "missing_physics"),
            "false alarms": rate(scores, lambda s: s.false_alarm),
        }
        for noise in ("white", "coloured", "quantised"):
            some = [s for s in scores if s.noise == noise]
            found[f"false alarms, {noise} noise"] = rate(some, lambda s: s.false_alarm)
        wrong = [s for s in scores if s.nominal_error > 0.25]
        found["false alarms, nominal model more than 25 % wrong"] = rate(wrong, lambda s: s.false_alarm)
        found["undecided"] = rate(scores, lambda s: s.outcome == "undecided")
        return found | sure
    if kind == "left-out":
        return (
            {
                "unknown, undecided or a declared family": rate(scores, lambda s: s.honest),
                "of these unknown": rate(scores, lambda s: s.outcome == "unknown"),
                "a confident wrong name": rate(scores, lambda s: s.outcome == "wrong" and not s.families),
            }
            | sure
            | {"the same of another family": rate(scores, lambda s: bool(s.stated_unrelated))}
            | _kind_rates(scores)
        )
    found = {
        "exact name" if kind == "single" else "exact names": rate(scores, lambda s: s.outcome == "exact"),
        "exact, or in a declared family of two": rate(scores, lambda s: s.right_within_family),
        "dominant effect first": rate(scores, lambda s: s.dominant_first),
        "slot": rate(scores, lambda s: s.slot_right),
        **sure,
        **_kind_rates(scores),
    }
    held = [s for s in scores if s.right_within_family and s.heldout is not None]
    found["held-out error within 1.1 of the noise floor"] = rate(
        held, lambda s: (s.heldout or math.inf) <= 1.1
    )
    return found


def _kind_rates(scores: Sequence[Score]) -> dict[str, Rate]:
    """Rate of cases in which the dominant effect's family is stated, and rate of stated families that are wrong."""
    stated = [one for score in scores for one in score.kinds_stated]
    return {
        f"family of the dominant effect stated with p ≥ {SURE}": rate(scores, lambda s: s.kind_right),
        f"families stated with p ≥ {SURE}: not there": Rate(
            sum(not one.right for one in stated), len(stated)
        ),
    }


def _machines(kind: str, scores: Sequence[Score]) -> dict[str, dict[str, Rate]]:
    """The main rates of a kind of case, by machine."""
    right: dict[str, Callable[[Score], bool]] = {
        "null": lambda s: s.outcome == "consistent", "left-out": lambda s: s.honest,
    }  # fmt: skip
    found: dict[str, dict[str, Rate]] = {}
    for name in dict.fromkeys(one.design for one in scores):
        some = [one for one in scores if one.design == name]
        found[name] = {"right": rate(some, right.get(kind, lambda s: s.right_within_family))}
        if kind in ("single", "pairs"):
            found[name]["dominant effect first"] = rate(some, lambda s: s.dominant_first)
        found[name][f"stated with p ≥ {SURE} and wrong"] = rate(some, lambda s: bool(s.stated_wrong))
    return found


def _sizes(scores: Sequence[Score]) -> list[tuple[str, list[Score]]]:
    names = [f"{low:g}–{high:g}" if math.isfinite(high) else f"over {low:g}" for low, high in BINS]
    return [(name, [s for s in scores if low <= s.faintest < high]) for name, (low, high) in zip(names, BINS)]


def summary(scores: Sequence[Score]) -> dict[str, Any]:
    """The complete score card as plain data."""
    card: dict[str, Any] = {}
    for group in dict.fromkeys(one.group for one in scores):
        some = [one for one in scores if one.group == group]
        kind = some[0].kind
        part: dict[str, Any] = {
            "cases": len(some),
            "rates": {name: value.to_dict() for name, value in _rates(kind, some).items()},
            "confusion": {true: dict(answers) for true, answers in confusion(some).items()},
            "seconds": _spread([s.seconds for s in some]),
            "processor_seconds": _spread([s.processor_seconds for s in some]),
            "failures": {s.case: s.failure for s in some if s.failure},
        }
        if kind != "null":
            part["by_size"] = {
                size: {name: value.to_dict() for name, value in _rates(kind, sized).items()}
                for size, sized in _sizes(some)
            }
        part["coverage"] = {
            "effects": coverage([e for s in some for e in s.effects]).to_dict(),
            "machine": coverage([e for s in some for e in s.machine]).to_dict(),
        }
        part["by_machine"] = {
            name: {what: value.to_dict() for what, value in rates.items()}
            for name, rates in _machines(kind, some).items()
        }
        card[group] = part
    card["reliability"] = reliability(scores)
    card["cases"] = [
        asdict(one) | {"deviations": {e.name: e.deviation for e in (*one.effects, *one.machine)}}
        for one in scores
    ]
    return card


def _spread(values: Sequence[float]) -> dict[str, float]:
    return {
        "median": float(np.median(values)), "ninth_decile": float(np.quantile(values, 0.9)), "most": max(values),
    }  # fmt: skip


def markdown(scores: Sequence[Score], command: str, complete: bool = True) -> str:
    """The score card as Markdown."""
    lines = ["# Concealed proof", "", f"    {command}", ""]
    if not complete:
        lines += ["Not all cases have been scored yet.", ""]
    lines.append("Rates with 95 % intervals; the mismatch is in units of the noise of a sample.")
    for group in dict.fromkeys(one.group for one in scores):
        some = [one for one in scores if one.group == group]
        kind = some[0].kind
        lines += ["", f"## {group}: {len(some)} cases", "", *_table(kind, some)]
        lines += _machine_table(kind, some)
        estimates = [e for s in some for e in s.effects]
        nuisance = [e for s in some for e in s.machine]
        if estimates:
            lines += [
                "",
                f"95 % intervals that hold the true value, parameters of the effect: {coverage(estimates)}.",
            ]
        if nuisance:
            lines += [
                "",
                f"95 % intervals that hold the true value, machine and delays: {coverage(nuisance)}.",
            ]
        time, used = _spread([s.seconds for s in some]), _spread([s.processor_seconds for s in some])
        lines += [
            "",
            f"Seconds a diagnosis: median {time['median']:.1f}, nine tenths below {time['ninth_decile']:.1f}; of processor "
            f"time {used['median']:.1f} and {used['ninth_decile']:.1f}.",
        ]
        if kind != "null":
            lines += ["", "| concealed | answered |", "| --- | --- |"]
            for true, answers in confusion(some).items():
                lines.append(
                    f"| {true} | {', '.join(f'{what} {count}' for what, count in answers.most_common())} |"
                )
        astray = [s for s in some if _astray(s)]
        if astray:
            lines += [
                "",
                "| case | mismatch | concealed | answered | families |",
                "| --- | --- | --- | --- | --- |",
            ]
            for s in astray:
                families = "; ".join(" = ".join(group) for group in s.families) or "–"
                lines.append(
                    f"| {s.case} | {s.faintest:.2f} | {' + '.join(s.true) or 'nothing'} | "
                    f"{s.verdict}: {' + '.join(s.named) or '–'} | {families} |"
                )
    lines += reliability_lines(scores)
    return "\n".join(lines) + "\n"


def _astray(score: Score) -> bool:
    if score.kind == "null":
        return score.outcome != "consistent"
    return not score.honest if score.kind == "left-out" else score.outcome != "exact"


def _table(kind: str, scores: Sequence[Score]) -> list[str]:
    columns = [("all", list(scores))]
    if kind != "null":
        columns += _sizes(scores)
    rates = [_rates(kind, group) for _, group in columns]
    lines = ["| | " + " | ".join(name for name, _ in columns) + " |", "| --- |" + " --- |" * len(columns)]
    for name in rates[0]:
        lines.append(f"| {name} | " + " | ".join(str(column[name]) for column in rates) + " |")
    return lines


def _machine_table(kind: str, scores: Sequence[Score]) -> list[str]:
    machines = _machines(kind, scores)
    if len(machines) < 2:
        return []
    names = list(next(iter(machines.values())))
    lines = ["", "| machine | " + " | ".join(names) + " |", "| --- |" + " --- |" * len(names)]
    return [
        *lines,
        *(f"| {name} | " + " | ".join(map(str, rates.values())) + " |" for name, rates in machines.items()),
    ]
