"""The next experiment: what the machine, and the sampling of its records, can bear, and whether one is needed at all."""

from dataclasses import replace

import pytest
from answers import diagnosed

from rhythmid.diagnose.answer.next_experiment import _menu
from rhythmid.diagnose.joints.joint_compose import _next
from rhythmid.excitation.sequence import build


@pytest.mark.parametrize("highest", [4.0, 40.0, 400.0])
def test_no_experiment_excites_what_the_sampling_cannot_show(highest):
    bands = [spec["band"] for _, spec, _ in _menu(1.0, 6.0, 10.0, highest) if "band" in spec]
    assert bands and max(high for _, high in bands) <= highest
    assert max(high for _, high in bands) == min(highest, 21 * 6.0)


def test_every_experiment_of_the_menu_can_be_built():
    for words, spec, factor in _menu(1.0, 6.0, 10.0, 100.0):
        assert build(spec).duration > 0.0 and factor > 0.0 and words


@pytest.mark.parametrize(
    ("verdict", "groups", "expected"),
    [
        ("missing_physics", (), True),
        ("missing_physics", (("coulomb_friction", "stribeck_friction"),), False),
        ("undecided", (), False),
        ("unknown_physics", (), False),
    ],
)
def test_only_names_that_nothing_might_stand_for_need_no_further_experiment(verdict, groups, expected):
    found = replace(diagnosed(verdict, "coulomb_friction", kind="effort"), indistinguishable=groups)
    assert found.settled is expected


def test_the_joint_that_needs_an_experiment_most_is_told_and_none_where_all_are_sure():
    sure = diagnosed("missing_physics", "coulomb_friction", kind="effort")
    open_one = replace(
        diagnosed("missing_physics", "backlash"), indistinguishable=(("backlash", "freeplay"),)
    )
    open_one = replace(open_one, next_experiment="slow reversals")
    answers = {"hip": sure, "knee": open_one}
    assert _next(answers, {"hip", "knee"}, (), ()) == "joint knee: slow reversals"
    assert _next({"hip": sure}, {"hip"}, (), ()) == sure.next_experiment
