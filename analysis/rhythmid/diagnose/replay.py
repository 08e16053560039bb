"""Replay: the evidence of a diagnosis as plain data, from which the decision is repeated without simulation.

This allows changes of the rules or of the constants to be tried on stored answers.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from rhythmid.diagnose.hypothesis import Hypothesis, Prediction
from rhythmid.diagnose.selection import Contest, select
from rhythmid.diagnose.verdict import Decision, decide

DIGITS = 8  # significant digits of each number in the ledger
# fields that are plain data already
OF_CONTEST = ("candidates", "size", "practical", "cut_short", "uncompared", "structured", "structured_after")
OF_HYPOTHESIS = ("kind", "free", "heldout_nrmse", "richer", "family", "beyond")


def ledger(contest: Contest, detectable: float, size_errors: Mapping[str, float]) -> dict[str, Any]:
    """All data that a decision depends on, as plain JSON data."""
    return {
        "hypotheses": [
            {
                "elements": list(one.elements),
                "names": list(one.names),
                "shape": {name: value for name, value in one.shape.items() if math.isfinite(value)},
                **{name: getattr(one, name) for name in OF_HYPOTHESIS},
                **_written(one.prediction),
            }
            for one in (*contest.hypotheses, *contest.ruled_out)
        ],
        "ruled_out": len(contest.ruled_out),
        "maps": {quantity: _written(one) for quantity, one in contest.maps.items()},
        **{name: getattr(contest, name) for name in OF_CONTEST},
        "unnamed": contest.unnamed,
        "follows": contest.follows if math.isfinite(contest.follows) else None,
        "detectable": detectable,
        "size_errors": {
            label: error if math.isfinite(error) else None for label, error in size_errors.items()
        },
    }


def _written(one: Prediction) -> dict[str, list[float] | list[bool] | None]:
    numbers = {
        name: [float(f"{value:.{DIGITS}g}") for value in getattr(one, name)]
        for name in ("log_density", "squared_error", "samples")
    }
    return {**numbers, "unseen": None if one.unseen is None else one.unseen.tolist()}


def _read(data: dict[str, Any]) -> Prediction:
    density, error, samples = (np.array(data[name]) for name in ("log_density", "squared_error", "samples"))
    unseen = data.get("unseen")
    return Prediction(density, error, samples, None if unseen is None else np.array(unseen, dtype=bool))


def _given(data: dict[str, Any], names: Sequence[str]) -> dict[str, Any]:
    """These fields of a ledger, as far as it has them: one of an earlier version may have fewer."""
    return {name: data[name] for name in names if name in data}


def contest_of(data: dict[str, Any]) -> Contest:
    """The contest that a ledger describes."""
    hypotheses = tuple(
        Hypothesis(
            tuple(one["elements"]),
            tuple(one["names"]),
            prediction=_read(one),
            shape=one["shape"],
            **_given(one, OF_HYPOTHESIS),
        )
        for one in data["hypotheses"]
    )
    competing = len(hypotheses) - data.get("ruled_out", 0)
    return Contest(
        hypotheses[:competing],
        {quantity: _read(one) for quantity, one in data["maps"].items()},
        unnamed=data.get("unnamed", data["practical"]),
        ruled_out=hypotheses[competing:],
        follows=data.get("follows") or math.inf,
        **_given(data, OF_CONTEST),
    )


def decision_of(data: dict[str, Any]) -> Decision:
    """The decision on a ledger by the current rules."""
    contest = contest_of(data)
    errors = {label: math.inf if one is None else one for label, one in data.get("size_errors", {}).items()}
    return decide(contest, select(contest), data["detectable"], errors)


def redecide(answer: dict[str, Any]) -> dict[str, Any]:
    """A stored answer with the verdict, names and probabilities that the current rules give for its evidence.

    Newly named effects have no parameters, because the fit of another model was stored.
    """
    if "evidence" not in answer:
        return answer
    decision = decision_of(answer["evidence"])
    contest = contest_of(answer["evidence"])
    names = {e: n for one in contest.hypotheses for e, n in zip(one.elements, one.names)}
    known = {effect["element"]: effect for effect in answer.get("missing", ())}
    missing = [
        {"slot": "", "equation": "", "parameters": {}}
        | known.get(names[label], {})
        | {
            "element": names[label],
            "share": decision.shares[label],
            "probability": decision.probability[label],
        }
        for label in decision.named
    ]
    return answer | {
        "verdict": decision.verdict,
        "missing": missing,
        "joint_probability": decision.joint,
        "indistinguishable": [list(group) for group in decision.equivalent],
        "families": [asdict(family) for family in decision.families],
    }
