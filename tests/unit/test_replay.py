"""Replay: from the evidence that an answer keeps, the same decision is made again without simulating."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from contests import contest, decided, predicted, supposed
from hypothesis import given, settings
from hypothesis import strategies as st

from rhythmid.diagnose.constants import PRACTICAL
from rhythmid.diagnose.replay import contest_of, decision_of, ledger, redecide

NOMINAL = supposed("", predicted(1.0))
SHAPES = st.sampled_from([None, {"within_bounds": 0.0}, {"within_bounds": math.inf, "more_than_gain": 3.0}])
KINDS = st.sampled_from(["effects", "effects", "freed_value", "location", "free_map"])


@settings(max_examples=40, deadline=None)
@given(
    st.dictionaries(
        st.sampled_from(["a", "b", "c", "a b", "a c", "b c"]), st.tuples(st.floats(1e-3, 1.0), SHAPES, KINDS)
    ),
    st.dictionaries(st.sampled_from(["position", "velocity"]), st.floats(1e-3, 1.0)),
    st.floats(1e-4, 1.0),
)
def test_the_decision_is_the_same_after_the_evidence_was_written_and_read(left, maps, detectable):
    made = contest(
        NOMINAL,
        *[
            supposed(names, predicted(share), kind, shape=shape)
            for names, (share, shape, kind) in left.items()
        ],
        maps={quantity: predicted(share) for quantity, share in maps.items()},
    )
    _, before = decided(made, detectable)
    after = decision_of(json.loads(json.dumps(ledger(made, detectable, {}), allow_nan=False)))
    assert (after.verdict, after.reason, after.named) == (before.verdict, before.reason, before.named)
    assert after.equivalent == before.equivalent
    assert after.joint == pytest.approx(before.joint, abs=1e-4)
    assert after.shares == pytest.approx(before.shares, abs=1e-4)
    assert after.unexplained.share == pytest.approx(before.unexplained.share, abs=1e-4)


@pytest.mark.parametrize("error", [0.01, 0.5, math.inf])
def test_the_error_of_an_effects_size_is_kept_with_the_evidence(error):
    made = contest(NOMINAL, supposed("a", predicted(0.1)))
    _, before = decided(made, errors={"a": error})
    after = decision_of(json.loads(json.dumps(ledger(made, 0.001, {"a": error}), allow_nan=False)))
    assert (after.verdict, after.rule) == (before.verdict, before.rule)
    assert after.probability["a"] == pytest.approx(before.probability["a"], abs=1e-6)
    assert (after.verdict == "missing_physics") == (error < 0.1)


def test_the_evidence_keeps_predictions_to_seven_digits():
    made = contest(NOMINAL, supposed("a", predicted(1.0 / 3.0, math.pi)), maps={"time": predicted(0.7)})
    read = contest_of(json.loads(json.dumps(ledger(made, 0.1, {}))))
    for one, other in zip(made.hypotheses, read.hypotheses):
        np.testing.assert_allclose(one.prediction.log_density, other.prediction.log_density, rtol=1e-7)
        assert (one.elements, one.names, one.kind, one.free) == (
            other.elements,
            other.names,
            other.kind,
            other.free,
        )
    assert read.practical == PRACTICAL and set(read.maps) == {"time"}
    assert read.follows == math.inf and contest_of(ledger(replace(made, follows=0.3), 0.1, {})).follows == 0.3


def test_the_evidence_keeps_the_laws_that_contain_an_effect_and_the_effects_that_it_is_at_its_end():
    whole = replace(
        supposed("a", predicted(0.1), richer={"a": ("b",)}, family={"a": "friction"}),
        beyond={"a": ("c", "d")},
    )
    read = contest_of(json.loads(json.dumps(ledger(contest(NOMINAL, whole), 0.1, {})))).hypotheses[1]
    assert {name: tuple(laws) for name, laws in read.richer.items()} == whole.richer
    assert {name: tuple(laws) for name, laws in read.beyond.items()} == whole.beyond
    assert read.family == whole.family


def answered(made, verdict: str, *missing: dict) -> dict:
    """An answer as it was kept, whatever its verdict was then."""
    kept = {"verdict": verdict, "missing": list(missing), "joint_probability": 0.0, "indistinguishable": []}
    return kept | {"evidence": ledger(made, 0.001, {}), "seconds": 12.0}


def test_an_answer_gets_the_verdict_and_names_that_its_evidence_gives_now():
    made = contest(NOMINAL, supposed("friction", predicted(0.05)))
    force = {"force": {"value": 0.1, "std": 0.01, "unit": "N"}}
    old = {
        "element": "friction",
        "slot": "force",
        "equation": "F",
        "share": 0.0,
        "probability": 0.0,
        "parameters": force,
    }
    anew = redecide(answered(made, "undecided", old))
    assert anew["verdict"] == "missing_physics" and anew["seconds"] == 12.0
    (effect,) = anew["missing"]
    assert effect["parameters"] == force and effect["probability"] > 0.8 and effect["share"] > 0.8


def test_a_name_that_was_not_given_then_has_no_parameters_now_and_one_that_goes_is_gone():
    named = redecide(answered(contest(NOMINAL, supposed("friction", predicted(0.05))), "consistent"))
    assert named["missing"][0]["parameters"] == {}
    gone = redecide(answered(contest(NOMINAL), "missing_physics", {"element": "friction"}))
    assert (gone["verdict"], gone["missing"]) == ("consistent", [])


def test_an_answer_without_evidence_stays_as_it_is():
    kept = {"verdict": "undecided", "missing": []}
    assert redecide(kept) is kept
