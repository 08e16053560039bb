"""The paper's method: parameters from magnitudes, delays from phases."""

from dataclasses import replace

import numpy as np
import pytest

from rhythmid.errors import InputError
from rhythmid.identify.delay_fit import fit_delays
from rhythmid.identify.magnitude_fit import fit_magnitude, undelayed_parameters
from rhythmid.identify.paper import PaperResult, paper_method
from rhythmid.ltp.htf import HarmonicTransferFunctions, delay_phase
from rhythmid.ltp.limit_cycle import PeriodMap
from rhythmid.ltp.pumping import Pumping, pumping_of
from rhythmid.ltp.regularised_least_squares import HtfEstimate
from rhythmid.model import Model
from rhythmid.record.record import Channel, Record

PAIRS = [(0.0, 0.0), (0.04, 0.05), (0.08, 0.1)]


@pytest.fixture(scope="module")
def model(rig):
    return rig.hopper.with_parameters(
        {"switched_damper.flight": fixed(rig.hopper.parameters["switched_damper.flight"])}
    )


def fixed(value):
    from dataclasses import replace

    return replace(value, fixed=True)


@pytest.fixture(scope="module")
def found(paper_record, model) -> dict[tuple[float, float], PaperResult]:
    start = model.with_values({"linear_spring.stiffness": 190.0, "switched_damper.stance": 2.5})
    return {pair: paper_method(paper_record(pair), start, pumping_of(paper_record(pair))) for pair in PAIRS}


@pytest.mark.parametrize("pair", PAIRS)
def test_parameters_are_found_from_magnitudes_whatever_the_delays(found, pair) -> None:
    fit = found[pair].fit
    assert fit.model.value("linear_spring.stiffness") == pytest.approx(200.0, rel=2e-4)
    assert fit.model.value("switched_damper.stance") == pytest.approx(2.0, rel=3e-3)
    assert fit.model.value("linear_spring.rest_length") == pytest.approx(0.2, abs=2e-5)
    assert fit.misfit < 0.02


@pytest.mark.parametrize("pair", PAIRS)
def test_delays_are_found_from_each_harmonic_alone(found, pair) -> None:
    delays = found[pair].delays
    assert delays[0].sum == pytest.approx(sum(pair), abs=0.1e-3)
    assert delays[0].input is None
    for m in (-1, 1):
        assert delays[m].input == pytest.approx(pair[0], abs=0.6e-3)
        assert delays[m].measurement == pytest.approx(pair[1], abs=0.6e-3)
        assert min(delays[m].input, delays[m].measurement) >= 0.0


QUASI_STATIC = """
inertia: {mass: {value: 20.0, unit: kg}}
force:
  - viscous_damper: {damping: {value: 50000.0, unit: N*s/m}}
"""  # a ring-down of 0.4 ms beside a motion of 2 s, and no spring


def test_a_quasi_static_machine_without_a_spring_is_told_what_it_lacks() -> None:
    time = np.arange(0.0, 8.0, 1e-2)
    push = np.cos(np.pi * time)
    record = Record("slip", Channel(time, push / np.pi / 50000.0, "m"), Channel(time, push, "N"))
    with pytest.raises(InputError, match="nothing restores its position"):
        paper_method(record, Model.from_text(QUASI_STATIC), Pumping.cosine(0.0, 0.5), 0)


def test_a_period_map_whose_differences_overflow_says_that_the_model_diverges() -> None:
    map_ = PeriodMap(
        Model.from_text(QUASI_STATIC), Pumping.cosine(0.0, 2.0), "force", 2.5e-3
    )  # too long steps
    with pytest.raises(InputError, match="diverges"):
        map_.jacobian(np.zeros(2), np.full(2, 1e-9))


def test_the_peak_lost_by_smoothing_is_reported(found) -> None:
    loss = found[PAIRS[1]].loss
    assert 0.0005 < loss[3] < 0.01  # G_0


def synthetic(result: PaperResult, delays: tuple[float, float]) -> HtfEstimate:
    """HTFs without any error: the model's own, delayed by (7)."""
    htf = result.estimate.htf
    turn = delay_phase(htf.harmonics, htf.frequency, *delays, result.pumping.frequency)
    exact = HarmonicTransferFunctions(
        htf.harmonics, htf.frequency, result.fit.expected * np.exp(-1j * turn), htf.std
    )
    return replace(result.estimate, htf=exact)


@pytest.mark.parametrize(
    "delays", [(0.0, 0.0), (0.3, 0.0), (0.0, 0.3), (0.299, 0.3), (0.0403, 0.0517), (0.62, 0.2)]
)
def test_equation_16_recovers_any_delays_of_exact_htfs(found, delays) -> None:
    result = found[PAIRS[1]]
    exact = synthetic(result, delays)
    assert fit_delays(exact, result.fit.expected, 0).sum == pytest.approx(sum(delays), abs=1e-9)
    for m in (-2, -1, 1, 2):
        one = fit_delays(exact, result.fit.expected, m)
        pairs = [(one.input, one.measurement), *one.aliases]  # τ_u is known modulo T/|m|
        assert any(np.allclose(pair, delays, atol=1e-9) for pair in pairs)
        assert one.error < 1e-9


def test_equation_16_weighs_phases_by_magnitude(found) -> None:
    """A wrong phase where |Ĝ| is small must not matter."""
    result = found[PAIRS[1]]
    exact = synthetic(result, (0.04, 0.05))
    row = exact.htf.row(0)
    small = np.abs(exact.htf.value[row]) < 0.02 * np.abs(exact.htf.value[row]).max()
    spoiled = exact.htf.value.copy()
    spoiled[row, small] *= np.exp(0.5j)
    wrong = replace(exact, htf=replace(exact.htf, value=spoiled))
    assert fit_delays(wrong, result.fit.expected, 0).sum == pytest.approx(0.09, abs=0.3e-3)


def test_poor_starting_values_are_overcome(paper_record, found, model) -> None:
    start = model.with_values({"linear_spring.stiffness": 120.0, "switched_damper.stance": 3.0})
    fit = fit_magnitude(found[PAIRS[1]].estimate, start)
    assert fit.model.value("linear_spring.stiffness") == pytest.approx(200.0, rel=2e-4)
    assert fit.model.value("switched_damper.stance") == pytest.approx(2.0, rel=3e-3)


def test_what_magnitudes_cannot_tell_apart_has_infinite_uncertainty(found, model) -> None:
    """Gravity and rest length both only move the machine's mean."""
    from dataclasses import replace

    loose = replace(model.parameters["gravity.acceleration"], fixed=False)
    fit = fit_magnitude(found[PAIRS[1]].estimate, model.with_parameters({"gravity.acceleration": loose}))
    assert np.isinf(fit.std["gravity.acceleration"])
    assert np.isinf(fit.std["linear_spring.rest_length"])
    assert fit.std["linear_spring.stiffness"] < 0.1


def test_transport_delays_are_no_matter_of_magnitudes(model) -> None:
    assert undelayed_parameters(model) == [
        "linear_spring.stiffness",
        "linear_spring.rest_length",
        "switched_damper.stance",
    ]


def test_a_record_without_input_is_refused(paper_record, model) -> None:
    from dataclasses import replace

    with pytest.raises(InputError, match="no input"):
        paper_method(replace(paper_record(), input=None), model, pumping_of(paper_record()))
