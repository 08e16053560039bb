"""Joints whose efforts the body of the file hardly fits, and efforts that come after the motion."""

from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import pytest
from answers import diagnosed

from rhythmid.diagnose.answer.result import FitQuality
from rhythmid.diagnose.joints.joint_case import JointResult
from rhythmid.diagnose.joints.misfit import late_efforts, misfits


@pytest.mark.parametrize(
    ("nominal", "named", "told"),
    [(1.62, 0.52, True), (0.9, 0.9, True), (1.62, 0.05, False), (0.5, 0.5, False)],
    ids=["the names explain half", "nothing is named", "the names explain it", "a friction is missing"],
)
def test_a_joint_is_told_whose_effort_neither_the_body_nor_the_names_explain(
    nominal: float, named: float, told: bool
):
    fit = {"refitted_nominal": FitQuality(0.1, nominal), "augmented": FitQuality(0.1, named)}
    answers = {"hip": diagnosed("consistent"), "knee": replace(diagnosed("undecided"), fit=fit)}
    notes = list(misfits(answers, {}))
    assert len(notes) == told
    if told:
        assert notes[0].startswith(
            f"knee: the refitted nominal model misses {100.0 * nominal:.0f} % of the effort"
        )
        assert all(word in notes[0] for word in ("centres of mass", "order", "signs", "units"))


def test_without_held_out_data_the_error_of_the_fit_tells_it():
    fit = {"refitted_nominal": FitQuality(1.2, None), "augmented": FitQuality(1.1, None)}
    (note,) = misfits({"knee": replace(diagnosed("undecided"), fit=fit)}, {})
    assert "120 %" in note and "110 %" in note


def found(alignments: Sequence[float], limit: float = 0.02) -> dict[str, JointResult]:
    """Results at joints whose efforts are ahead of the motion by these times [s], at most by the limit."""

    def one(alignment: float) -> JointResult:
        fit = SimpleNamespace(alignment=alignment, at_limit=[abs(alignment) >= limit])
        result = SimpleNamespace(chosen=SimpleNamespace(fit=fit))
        return cast(JointResult, SimpleNamespace(result=result, by_reference=False))

    return {f"j{number}": one(alignment) for number, alignment in enumerate(alignments)}


def test_efforts_of_most_joints_that_come_after_the_motion_are_told():
    (note,) = late_efforts(found([-0.02, -0.02, 0.001]))
    assert note.startswith("the efforts of j0, j1 fit best 20 ms or more after the motion")
    for usual in ([-0.02, 0.001, 0.001], [-0.019, -0.01], [0.02, 0.02], [-0.02]):
        assert not list(late_efforts(found(usual)))
