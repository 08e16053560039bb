"""Punctuality of a run in real time: the part of the nodes' figures that the topic `run` repeats.

Figures that would reveal a delay that is to be identified (how long an injector holds messages) are left out.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

# node: keys of its figures for the number of messages, of late ones, and the prefix of how late they were
_STAGES = {
    "command_delay": ("relayed", "late", "delay_error"),
    "plant": ("commands", "late_commands", "transport"),
    "measurement_delay": ("relayed", "late", "delay_error"),
}
_LOSSES = [
    (node, key) for node in ("command_delay", "measurement_delay", "recorder") for key in ("dropped", "lost")
]


def timing(figures: Mapping[str, Mapping[str, str]], said: Mapping[str, Any]) -> dict[str, Any]:
    """Counts and lateness [s] of every stage of the path, and the messages lost.

    Parameters
    ----------
    figures : of every node by its name, as /diagnostics has them.
    said : content of `run` so far, with the excitation's own counts.
    """
    found: dict[str, Any] = dict(said.get("timing", {}))
    for node, (of, late, prefix) in _STAGES.items():
        if node in figures and late in figures[node]:
            told = figures[node]
            times = {name: 1e-3 * float(told[f"{prefix}_{name}_ms"]) for name in ("mean", "p99", "max")}
            found[node] = {"of": int(told[of]), "late": int(told[late]), **times}
    return {**found, "lost": sum(int(figures.get(node, {}).get(key, 0)) for node, key in _LOSSES)}
