"""Cases drawn from a seed."""

from collections import Counter
from typing import Any

import numpy as np
import pytest

from rhythmid.elements.catalogue import load_catalogue
from rhythmid.errors import InputError
from rhythmid.model import Model
from rhythmid.proof.draw import (
    FAINTEST,
    LONGEST_DELAY,
    NOISES,
    STRONGEST,
    absent_with,
    candidates,
    draw_case,
    draw_noise,
    related,
)
from rhythmid.proof.equations import EQUATIONS
from rhythmid.proof.machine import TIMING
from rhythmid.proof.seal import seal, truth_of, unseal
from rhythmid.proof.sizes import SIZES
from rhythmid.proof.sizing import strength_for


@pytest.fixture(scope="module")
def catalogue():
    return load_catalogue()


@pytest.fixture(scope="module")
def case(catalogue):
    return draw_case(3, "single", 0, catalogue)


def test_every_candidate_of_the_catalogue_can_be_concealed(catalogue):
    # a spring or a pendulum's gravity can only be missing from another kind of machine than the one drawn here
    elsewhere = {
        name for name, e in catalogue.items() if e.rotational or e.controlled or e.displaced_base
    } | {"linear_spring"}
    expected = {name for name, e in catalogue.items() if e.candidate} - elsewhere
    assert expected <= set(SIZES)
    assert set(SIZES) == set(EQUATIONS) | set(TIMING)


def test_concealed_parameters_bear_the_catalogues_names(catalogue):
    for name, equation in EQUATIONS.items():
        if name in catalogue:
            assert set(equation.parameters) <= {p.name for p in catalogue[name].parameters}


def test_the_same_seed_draws_the_same_case(case, catalogue):
    assert draw_case(3, "single", 0, catalogue) == case


def test_another_seed_draws_another_case(case, catalogue):
    assert draw_case(4, "single", 0, catalogue) != case


def test_a_case_stays_within_what_is_promised(case, catalogue):
    assert FAINTEST <= case.ratio <= 1.2 * STRONGEST
    assert 3 <= len(case.runs) <= 6
    assert all(10.0 <= run.duration <= 30.0 for run in case.runs)
    assert 0.0 <= case.input_delay <= LONGEST_DELAY["input"]
    assert 0.0 <= case.measurement_delay <= LONGEST_DELAY["measurement"]
    assert 0.5 <= case.machine.mass <= 3.0 and 50.0 <= case.machine.stiffness <= 800.0
    assert 0.02 <= case.nominal_error <= 0.5
    believed = Model.from_text(case.nominal, catalogue=catalogue)
    assert believed.value("inertia.mass") == case.machine.mass
    assert believed.value("linear_spring.stiffness") != case.machine.stiffness
    assert not {term.element.name for term in believed.terms} & {effect.name for effect in case.effects}


def test_effects_take_turns_so_that_each_is_concealed_equally_often(catalogue, monkeypatch):
    monkeypatch.setattr("rhythmid.proof.draw._draw", lambda label, kind, names, *_: names)
    classes = candidates(catalogue)
    names: list[Any] = [draw_case(5, "single", i, catalogue) for i in range(2 * len(classes))]
    drawn = Counter(name for (name,) in names)
    assert all(sum(drawn[name] for name in group) == 2 for group in classes)


def test_pairs_are_of_different_families(catalogue, monkeypatch):
    monkeypatch.setattr("rhythmid.proof.draw._draw", lambda label, kind, names, *_: names)
    for index in range(40):
        names: Any = draw_case(6, "pairs", index, catalogue)
        first, second = names
        assert not related(catalogue, first, second)


def test_what_contains_or_equals_an_effect_leaves_the_catalogue_with_it(catalogue):
    assert {"coulomb_friction", "stribeck_friction"} <= set(absent_with(catalogue, "coulomb_friction"))
    assert set(absent_with(catalogue, "clock_skew")) == {"clock_skew", "delay_drift"}
    assert "coulomb_friction" not in absent_with(catalogue, "stribeck_friction")


@pytest.mark.parametrize("kind", NOISES)
def test_noise_of_every_kind_has_the_rms_that_it_says(kind):
    rng = np.random.default_rng(0)
    noise = draw_noise(rng, 0.01, kind)
    motion = 0.01 * np.sin(np.arange(200_000) / 37.0)
    error = noise.corrupt(motion, rng) - motion
    assert np.std(error) == pytest.approx(noise.std, rel=0.05)
    lag = float(np.mean(error[1:] * error[:-1]) / np.var(error))
    assert lag == pytest.approx(noise.correlation, abs=0.05)


@pytest.mark.parametrize("power", [0.7, 1.0, 2.0])
@pytest.mark.parametrize("target", [0.3, 3.0, 10.0])
def test_the_strength_that_leaves_a_mismatch_is_found(power, target):
    strength, ratio = strength_for(target, lambda s: 40.0 * s**power)
    assert ratio == pytest.approx(target, rel=0.26)
    assert ratio == pytest.approx(40.0 * strength**power)


def test_a_mismatch_out_of_reach_gives_the_largest_there_is():
    assert strength_for(3.0, lambda s: 0.1 * s) == pytest.approx((1.0, 0.1))


def test_a_strength_that_makes_the_machine_diverge_is_avoided():
    strength, ratio = strength_for(10.0, lambda s: 100.0 * s if s < 0.09 else float("inf"))
    assert strength < 0.09 and 5.0 < ratio < 12.0


def test_a_seal_that_was_tampered_with_is_refused(case, tmp_path):
    path = tmp_path / "sealed" / "case.json"
    told = seal(path, truth_of(case, {5: 0.01}))
    assert unseal(path, told)["concealed"][0]["effect"]["name"] == case.effects[0].name
    path.write_text(path.read_text().replace(case.effects[0].name, "gravity"))
    with pytest.raises(InputError, match="hash"):
        unseal(path, told)
