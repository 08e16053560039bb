"""The schema of an answer: generated from the types, kept in the documentation, and kept to by answers."""

import json
import math
from dataclasses import fields, replace

import pytest
from json_schema import SCHEMA, conforming, faults

from rhythmid.diagnose.answer.result import (
    ANSWER,
    Curve,
    Detection,
    Diagnosis,
    Estimate,
    Explanation,
    FitQuality,
    Location,
    MissingEffect,
    Remainder,
    Scored,
    schema,
)
from rhythmid.diagnose.rejections import Rejection

FRICTION = MissingEffect(
    "coulomb_friction", "force", "F", 0.9, 0.95, {"force": Estimate(0.1, None, "N"), "transition": Estimate(0.01, 1e-3, "m/s")}
)  # fmt: skip
ANSWERED = Diagnosis(
    verdict="missing_physics",
    summary="Friction is missing.",
    detection=Detection(None, math.inf, 0.3, 0.01),
    location=Location("force", "in the leg", ("velocity explains most",)),
    missing=(FRICTION,),
    joint_probability=0.95,
    indistinguishable=(("coulomb_friction", "stribeck_friction"),),
    alternatives=(),
    hypotheses=(Explanation(("coulomb_friction",), "effects", 10.0, 0.0, math.inf, 0.95, None),),
    rejections=(Rejection(("play",), "share_of_rest", -math.inf, 0.2, "too little"),),
    remainder=Remainder(0.02, True, "velocity", Curve((0.0, 1.0), (0.1, 0.2))),
    fit={"refitted_nominal": FitQuality(0.3, None), "augmented": FitQuality(0.01, 0.012)},
    parameters={"linear_spring.stiffness": Estimate(200.0, 0.1, "N/m")},
    delays={"sum": {"value": 0.03, "std": None, "unit": "s"}, "separable": False},
    next_experiment="none",
    scoring=Scored("effort", 12.0, "the effort was recorded", 1),
)


def test_the_schema_in_the_documentation_is_that_of_the_types():
    written = json.loads(SCHEMA.read_text())
    assert written == schema(), (
        "run `python -m rhythmid.diagnose.answer.result > docs/schema/diagnose.schema.json`"
    )


def test_an_answer_keeps_to_the_schema_with_null_for_what_is_not_finite():
    content = conforming(ANSWERED).to_dict()
    assert content["detection"]["nominal_nrmse"] is None
    assert content["rejections"][0]["statistic"] is None
    assert content["hypotheses"][0]["standard_error"] is None


def test_what_was_written_is_read_back_the_same():
    finite = replace(ANSWERED, detection=Detection(0.1, 0.2, 0.3, 0.01), hypotheses=(), rejections=())
    assert ANSWER.validate_json(json.dumps(finite.to_dict())) == finite


@pytest.mark.parametrize(
    "key",
    [
        "verdict", "detection", "location", "missing", "indistinguishable", "alternatives", "fit", "parameters", "delays",
        "next_experiment", "remainder", "hypotheses", "rejections", "scoring", "assumptions",
    ],
)  # fmt: skip
def test_the_contract_s_keys_are_in_every_answer(key):
    assert key in ANSWERED.to_dict() and key in schema()["properties"]
    assert key in {one.name for one in fields(Diagnosis)}


@pytest.mark.parametrize(
    ("kept", "keys"),
    [
        ("MissingEffect", {"element", "slot", "equation", "probability", "share", "parameters"}),
        ("Remainder", {"share", "significant", "goes_with", "curve"}),
        (
            "Explanation",
            {
                "elements",
                "kind",
                "score",
                "score_difference",
                "standard_error",
                "probability",
                "heldout_nrmse",
            },
        ),
        ("Rejection", {"hypothesis", "name", "statistic", "threshold", "reason"}),
        ("Scored", {"kind", "bandwidth", "reason", "averaged"}),
    ],
)
def test_the_parts_of_an_answer_have_the_contract_s_keys(kept, keys):
    assert set(schema()["$defs"][kept]["properties"]) == set(schema()["$defs"][kept]["required"]) == keys


@pytest.mark.parametrize(
    ("change", "place"),
    [
        ({"verdict": "perhaps"}, ".verdict"),
        ({"missing": [{"element": "friction"}]}, ".missing[0]"),
        ({"joint_probability": "high"}, ".joint_probability"),
        ({"fit": {"other": {"train_nrmse": 0.1, "heldout_nrmse": None}}}, ".fit.other"),
        (
            {"remainder": {"share": 0.1, "significant": 1.0, "goes_with": None, "curve": None}},
            ".remainder.significant",
        ),
    ],
)
def test_what_does_not_keep_to_the_schema_is_told_with_its_place(change, place):
    told = faults(ANSWERED.to_dict() | change, schema(), schema())
    assert told and all(one.startswith(place) for one in told)
