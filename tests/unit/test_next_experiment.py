"""The next experiment: what the machine, and the sampling of its records, can bear, and whether one is needed at all."""

import math
from dataclasses import replace

import numpy as np
import pytest
from answers import diagnosed

from machines import CATALOGUE, SHORT, hopper, records, search_of
from rhythmid.diagnose.answer.compose import _rivals, _without
from rhythmid.diagnose.answer.next_experiment import (
    MORE_FREE,
    NONE_NEEDED_FREE,
    _menu,
    _of_the_input,
    next_experiment,
    separation,
)
from rhythmid.diagnose.joints.joint_compose import _next
from rhythmid.diagnose.search.proposals import WORTH
from rhythmid.excitation.sequence import build
from rhythmid.identify.output_error import estimate
from rhythmid.identify.record_scales import scales
from rhythmid.identify.series import Series, prepare
from rhythmid.model import Model
from rhythmid.record.record import Channel, Record
from rhythmid.simulation.signal import zero_order_hold

PENDULUM = """
units: {force: rad/s^2, position: rad}
inertia: {mass: {value: 1.0, fixed: true}}
force:
  - linear_spring: {stiffness: {value: 40.0}, rest_length: {value: 0.0}}
  - viscous_damper: {damping: {value: 0.2}}
"""
TIME = 0.02 * np.arange(400)


def decay(amplitude: float) -> list[Series]:
    """A free swing of this amplitude [rad] about 0.1 rad."""
    swing = 0.1 + amplitude * np.exp(-0.1 * TIME) * np.cos(math.sqrt(40.0) * TIME)
    noise = 1e-3 * np.random.default_rng(3).standard_normal(len(TIME))
    return prepare([Record("swing", Channel(TIME, swing + noise, "rad"))])


@pytest.mark.parametrize(("amplitude", "factors"), [(0.5, {"0.3", "3"}), (2.0, {"0.3"})])
def test_a_machine_that_nothing_drives_is_released_from_other_amplitudes(amplitude, factors):
    """And an angle no further than from the other side."""
    series = decay(amplitude)
    nominal = Model.from_text(PENDULUM)
    found = search_of(estimate(nominal, series))
    rival = nominal.with_element(CATALOGUE["coulomb_friction"], {"force": 0.3, "transition": 1e-3})
    other = search_of(estimate(rival, series, names=nominal.free), "coulomb_friction")
    menu = separation(found.best, other.best, series, found.noise.variance, 5e-3)
    assert {one.words.split(", ")[1].split()[0] for one in menu} == factors
    assert all(one.words.startswith("a release at rest from ") and one.chi2 > 0.0 for one in menu)
    said = next_experiment(found, [other.best], series, True)
    assert said.startswith("a release at rest from ") and "coulomb_friction" in said
    assert said.endswith(" standard deviations of the noise (rms)") and "chi2" not in said
    assert next_experiment(found, [], series, True) == MORE_FREE
    assert next_experiment(found, [other.best], series, False) == NONE_NEEDED_FREE


def test_no_experiment_is_proposed_that_would_not_show_the_difference():
    series = decay(0.5)
    nominal = Model.from_text(PENDULUM)
    found = search_of(estimate(nominal, series))
    rival = nominal.with_element(CATALOGUE["coulomb_friction"], {"force": 1e-6, "transition": 1e-3})
    other = search_of(estimate(rival, series, names=nominal.free), "coulomb_friction")
    said = next_experiment(found, [other.best], series, True)
    assert said.startswith("none of the experiments that were compared would separate the nominal model from")


def test_a_rival_is_what_the_records_do_not_tell_from_the_best():
    series = decay(0.5)
    nominal = Model.from_text(PENDULUM)
    rubbing = nominal.with_element(CATALOGUE["coulomb_friction"], {"force": 5.0, "transition": 1e-3})
    dragging = nominal.with_element(CATALOGUE["quadratic_drag"], {"coefficient": 0.1})
    one = search_of(estimate(rubbing, series, names=nominal.free), "coulomb_friction").best
    far = search_of(estimate(dragging, series, names=nominal.free), "quadratic_drag").best
    one, far = sorted((one, far), key=lambda trial: trial.bic())
    assert far.bic() - one.bic() > WORTH
    assert _rivals(one, one, ()) and not _rivals(far, one, ())
    assert _rivals(far, one, (("coulomb_friction", "quadratic_drag"),))


def test_a_rival_of_an_effect_too_uncertain_to_be_named_is_the_model_without_it():
    series = decay(0.5)
    rubbing = Model.from_text(PENDULUM).with_element(
        CATALOGUE["coulomb_friction"], {"force": 5.0, "transition": 1e-3}
    )
    both = rubbing.with_element(CATALOGUE["quadratic_drag"], {"coefficient": 0.1})
    free = Model.from_text(PENDULUM).free
    slim = search_of(estimate(rubbing, series, names=free), "coulomb_friction").best
    best = search_of(estimate(both, series, names=free), "coulomb_friction", "quadratic_drag").best
    assert _without(slim, best, ("quadratic_drag",))
    assert not _without(best, best, ("quadratic_drag",)) and not _without(slim, best, ("coulomb_friction",))


def test_only_a_machine_without_input_is_idle():
    assert scales(decay(0.5), Model.from_text(PENDULUM)).idle
    assert not scales(prepare(records(hopper(), SHORT[2:])), hopper()).idle
    forced = Model.from_text(PENDULUM).with_element(
        CATALOGUE["periodic_forcing"], {"amplitude": 1.0, "frequency": 1.0, "phase": 0.0}
    )
    assert not scales(decay(0.5), forced).idle


def test_a_machine_that_is_driven_at_another_level_in_each_record_is_not_idle():
    levels = (0.5, 0.5, 2.0)
    held = [
        replace(one, command=zero_order_hold(one.time[:1], np.array([level])))
        for one, level in zip(decay(0.5)[:1] * 3, levels)
    ]
    nominal = Model.from_text(PENDULUM)
    assert scales(held[:2], nominal).idle
    sizes = scales(held, nominal)
    assert not sizes.idle and sizes.effort == pytest.approx(np.std(levels))


@pytest.mark.parametrize("highest", [4.0, 40.0, 400.0])
def test_no_experiment_excites_what_the_sampling_cannot_show(highest):
    bands = [spec["band"] for _, spec, _ in _menu(1.0, "N", 6.0, 10.0, highest) if "band" in spec]
    assert bands and max(high for _, high in bands) <= highest
    assert max(high for _, high in bands) == min(highest, 21 * 6.0)


def test_amplitudes_have_the_unit_of_the_input_and_say_how_large_they_are_beside_the_records():
    for words, spec, _ in _menu(2.0, "N*m", 6.0, 10.0, 100.0):
        assert spec["type"] == "silence" or " N*m (" in words or " N*m rms" in words
    assert any(
        words.startswith("a chirp of 6 N*m (3 times the rms")
        for words, *_ in _menu(2.0, "N*m", 6.0, 10.0, 100.0)
    )
    series = prepare(records(hopper(), SHORT[2:]))
    sizes = scales(series, hopper())
    assert _of_the_input(series[0], hopper(), sizes) == (sizes.effort, "N")
    asked = replace(series[0], kind="reference")
    assert _of_the_input(asked, hopper(), sizes) == (pytest.approx(np.std(asked.drive)), "m")


def test_every_experiment_of_the_menu_can_be_built():
    for words, spec, factor in _menu(1.0, "N", 6.0, 10.0, 100.0):
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
    freed = replace(found, chosen=("coulomb_friction", "inertia.mass"))
    assert freed.settled is expected
    assert not replace(found, chosen=("coulomb_friction", "backlash")).settled


def test_the_joint_that_needs_an_experiment_most_is_told_and_none_where_all_are_sure():
    sure = diagnosed("missing_physics", "coulomb_friction", kind="effort")
    open_one = replace(
        diagnosed("missing_physics", "backlash"), indistinguishable=(("backlash", "freeplay"),)
    )
    open_one = replace(open_one, next_experiment="slow reversals")
    answers = {"hip": sure, "knee": open_one}
    assert _next(answers, {"hip", "knee"}, (), ()) == "joint knee: slow reversals"
    assert _next({"hip": sure}, {"hip"}, (), ()) == sure.next_experiment
