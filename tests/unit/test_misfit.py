"""Joints whose efforts the body of the file hardly fits."""

from dataclasses import replace

import pytest
from answers import diagnosed

from rhythmid.diagnose.answer.result import FitQuality
from rhythmid.diagnose.joints.misfit import misfits


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
