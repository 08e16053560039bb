"""Joint maximum likelihood: found from anywhere, unbiased by amplitude, stuck fits reported, checked in the other domain."""

from dataclasses import replace

import numpy as np
import pytest

from machines import hopper, record
from rhythmid.errors import InputError
from rhythmid.identify.bound import cramer_rao
from rhythmid.identify.harmonic_likelihood import harmonic_likelihood
from rhythmid.identify.identify import forced_by
from rhythmid.identify.joint import fit_from, joint_likelihood
from rhythmid.identify.monte_carlo import noisy
from rhythmid.identify.paper import paper_method
from rhythmid.model import Model
from rhythmid.record.record import Record

U, Y, K, C = (
    "input_delay.delay",
    "measurement_delay.delay",
    "linear_spring.stiffness",
    "switched_damper.stance",
)
DELAYS = (0.0403, 0.0551)
NOISE = 2e-5


def chirps(amplitude: float) -> dict:
    return {"type": "chirp", "amplitude": amplitude, "band": [0, 7], "sweep": 20.0, "repetitions": 2, "warm_up": 1,
            "shift": {"period": 1.0, "count": 2}}  # fmt: skip


@pytest.fixture(scope="module")
def quiet() -> Record:
    return record(hopper(), chirps(0.02), delays=DELAYS, std=0.0)


def right() -> Model:
    return hopper().with_values({U: DELAYS[0], Y: DELAYS[1]})


def test_a_noise_free_record_gives_delays_within_a_microsecond(quiet):
    fit = joint_likelihood(quiet, hopper()).fit
    assert fit.model.value(U) == pytest.approx(DELAYS[0], abs=1e-6)
    assert fit.model.value(Y) == pytest.approx(DELAYS[1], abs=1e-6)
    assert fit.model.value(C) == pytest.approx(2.0, rel=2e-4)


@pytest.mark.parametrize("stiffness, damping, delays", [(105.0, 2.9, (0.29, 0.0)), (295.0, 1.05, (0.0, 0.3))])
def test_the_start_does_not_matter(quiet, stiffness, damping, delays):
    wrong = hopper().with_values({K: stiffness, C: damping, U: delays[0], Y: delays[1]})
    fit = joint_likelihood(noisy(quiet, NOISE, 1), wrong).fit
    for name, truth in ((U, DELAYS[0]), (Y, DELAYS[1]), (K, 200.0), (C, 2.0)):
        assert abs(fit.model.value(name) - truth) < 5.0 * fit.std[name]


def test_a_search_that_cannot_arrive_says_so_and_gives_no_answer(quiet):
    stiff = hopper().parameters[K]
    model = hopper().with_parameters({K: replace(stiff, value=400.0, bounds=(350.0, 500.0))})
    with pytest.raises(InputError, match="no answer: the fit leaves"):
        joint_likelihood(quiet.cut(0.0, 12.0), model)


@pytest.mark.parametrize("cycle", [True, False])
def test_the_standard_deviations_are_the_bound(quiet, cycle):
    bound = cramer_rao(right(), quiet, NOISE, cycle=cycle)
    fit = fit_from(right(), noisy(quiet, NOISE, 2), cycle=cycle)
    for name in (U, Y, K, C):
        assert fit.std[name] == pytest.approx(bound.std[name], rel=0.06)
        assert abs(fit.model.value(name) - right().value(name)) < 4.5 * bound.std[name]


def test_the_limit_cycle_sharpens_the_measurement_delay(quiet):
    with_cycle, without = (cramer_rao(right(), quiet, NOISE, cycle=cycle) for cycle in (True, False))
    assert with_cycle.std[Y] < 0.1 * without.std[Y]
    assert without.std["linear_spring.rest_length"] == np.inf  # a rest length shows in the mean alone


def test_frequency_and_time_domain_agree_within_the_bound():
    spec = chirps(0.004) | {
        "sweep": 10.0,
        "repetitions": 9,
        "warm_up": 3,
        "shift": {"period": 1.0, "count": 9},
    }
    noisy_record = record(hopper(), spec, delays=DELAYS, std=5e-6)
    machine, pumping = forced_by(hopper(), noisy_record)
    harmonic = harmonic_likelihood(noisy_record, machine, pumping, cycle=False)
    fit = fit_from(right(), noisy_record, cycle=False)
    for name in (U, Y, K, C):
        found = dict(zip(harmonic.names, harmonic.values))[name]
        assert abs(found - fit.model.value(name)) < 3.0 * fit.std[name]


@pytest.mark.parametrize("amplitude", [0.004, 0.012])
def test_amplitude_does_not_bias_the_nonlinear_fit_as_it_biases_the_papers_method(amplitude):
    made = record(hopper(), chirps(amplitude), delays=DELAYS, std=0.0)
    machine, pumping = forced_by(hopper(), made)
    paper = paper_method(made, machine, pumping).delays
    worst = max(
        abs(value - truth)
        for m in (-1, 1)
        for value, truth in ((paper[m].input, DELAYS[0]), (paper[m].measurement, DELAYS[1]))
        if value is not None
    )
    fit = fit_from(right(), made)
    ours = max(abs(fit.model.value(U) - DELAYS[0]), abs(fit.model.value(Y) - DELAYS[1]))
    assert ours < 2e-6
    assert worst > 1e-4
