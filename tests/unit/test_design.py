"""The excitation designer: lines that stay apart, small peaks, limits kept, honest refusals."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as some

from machines import CATALOGUE, HOPPER, hopper
from rhythmid.design.chirp_comb import chirp_comb
from rhythmid.design.crest_factor import crest_factor, least_crest, one_period
from rhythmid.design.designer import Design, design
from rhythmid.design.distortion import linearised_bias
from rhythmid.design.interleaved_multisine import interleaved
from rhythmid.design.requirements import Requirements
from rhythmid.design.response_lines import ResponseLines
from rhythmid.errors import InputError
from rhythmid.identify.joint import fit_from
from rhythmid.identify.monte_carlo import noisy
from rhythmid.model import Model
from rhythmid.settings import Forcing

WANTED = Requirements(
    duration=60.0, band=(0.3, 6.0), max_effort=0.02, envelope=(0.13, 0.17), noise_std=2e-5, rate=250, harmonics=3,
    input_delay=0.0403, measurement_delay=0.0251,
)  # fmt: skip
COMB = replace(WANTED, kind="comb", duration=100.0)
RING_DOWN = 2.0


@pytest.fixture(scope="module")
def multisine() -> Design:
    return design(hopper(), WANTED)


@pytest.fixture(scope="module")
def comb() -> Design:
    return design(hopper(), COMB)


# Lines


@given(some.floats(40.0, 400.0), some.integers(1, 4), some.floats(0.5, 3.0))
def test_no_two_responses_of_a_multisine_fall_on_one_another(duration, harmonics, frequency):
    wanted = replace(
        WANTED, duration=duration, harmonics=harmonics, forcing=Forcing(1.0, frequency), longest_delay=0.1
    )
    made = interleaved(wanted, RING_DOWN)
    seen: dict[int, tuple[int, int]] = {}
    for line in made.lines.tolist():
        for m in range(-harmonics, harmonics + 1):
            place = abs(line + m * made.periods)
            assert place not in seen, (seen[place], (line, m))
            assert place % made.periods != 0
            seen[place] = (line, m)


def test_the_lines_of_a_multisine_are_odd_so_that_even_distortion_falls_on_even_ones():
    made = interleaved(replace(WANTED, duration=200.0, harmonics=3), RING_DOWN)
    responses = ResponseLines(made.lines, made.periods, 1.0, 3).bins
    assert np.all(responses % 2 == 1)
    left_out = np.setdiff1d(made.spaced, made.lines)
    assert len(left_out) >= len(made.lines) // 4 and not np.isin(left_out, responses).any()


@pytest.mark.parametrize("harmonics", [1, 2, 3])
def test_harmonic_m_of_a_comb_falls_into_class_m(harmonics):
    plan = chirp_comb(replace(COMB, duration=200.0, harmonics=harmonics), RING_DOWN)
    count = plan.facts["chirps"]
    assert count == 2 * harmonics + 3
    signed = plan.response.lines[None, :] + plan.response.orders[:, None] * plan.response.periods
    np.testing.assert_array_equal(
        signed % count, np.broadcast_to(plan.response.orders[:, None] % count, signed.shape)
    )
    assert plan.response.separate


@pytest.mark.parametrize("which", ["multisine", "comb"])
def test_the_simulated_response_has_just_the_predicted_lines(which, request):
    """An independent transform of a simulated run with a small command against transfer functions times lines."""
    wanted = request.getfixturevalue(which).requirements
    made = design(hopper(), replace(wanted, max_effort=0.1 * wanted.max_effort))
    lines, rate = made.plan.response, made.requirements.rate
    count = round(made.plan.window * rate)

    def spectrum(signal):
        return np.fft.rfft(signal[-count:]) * 2.0 / count

    command, response = np.abs(spectrum(made.command.values)), np.abs(spectrum(made.output - made.still))
    for m in (-1, 0, 1):
        bins = lines.lines + m * lines.periods
        frequency = bins.astype(float) * lines.resolution
        predicted = np.abs(made.machine.htf(np.array([m]), frequency)[0]) * command[lines.lines]
        strong = predicted > 0.02 * predicted.max()
        error = response[np.abs(bins)][strong] - predicted[strong]
        assert np.linalg.norm(error) < (0.01 if m == 0 else 0.06) * np.linalg.norm(predicted)
    inside = np.unique(lines.bins)
    outside = np.setdiff1d(np.arange(1, int(inside.max())), inside)
    assert np.linalg.norm(response[outside]) < 0.08 * np.linalg.norm(response[inside])


def test_two_lines_that_alias_are_named():
    with pytest.raises(InputError, match="to 2.5 Hz at m = -1 and to 1.5 Hz at m = 0 both fall on 1.5 Hz; x"):
        ResponseLines(np.array([15, 25]), 10, 0.1, 2).require_separate("x")
    with pytest.raises(InputError, match="the line at 2 Hz lies on a harmonic of the forcing"):
        ResponseLines(np.array([15, 20]), 10, 0.1, 1).require_separate("x")


# Crest factor


@pytest.mark.parametrize("count", [12, 46])
def test_the_crest_factor_is_well_below_that_of_random_phases(count):
    lines = np.arange(7, 7 + 14 * count, 14)
    weights = np.ones(count)
    crest, phases = least_crest(lines, weights)
    rng = np.random.default_rng(1)
    drawn = [crest_factor(one_period(lines, weights, rng.uniform(0, 2 * np.pi, count))) for _ in range(300)]
    assert crest < 1.65 < 0.9 * min(drawn)
    assert crest_factor(one_period(lines, weights, phases)) == pytest.approx(crest)


def test_minimising_the_crest_factor_keeps_the_amplitudes_and_the_seed_decides():
    lines, weights = np.array([3, 5, 9]), np.array([1.0, 0.5, 2.0])
    crest, phases = least_crest(lines, weights, seed=3)
    signal = one_period(lines, weights, phases)
    found = np.abs(np.fft.rfft(signal))[lines] * 2 / len(signal)
    np.testing.assert_allclose(found, weights, rtol=1e-9)
    assert (crest, phases.tolist()) == (
        least_crest(lines, weights, seed=3)[0],
        least_crest(lines, weights, seed=3)[1].tolist(),
    )


def test_the_crest_factor_of_a_sine_is_the_root_of_two():
    assert crest_factor(np.sin(2 * np.pi * np.arange(1000) / 1000)) == pytest.approx(np.sqrt(2))


# Amplitude


def test_the_peak_effort_is_used_up_where_nothing_else_limits(multisine):
    assert multisine.amplitude.limited_by == "max_effort"
    assert np.max(np.abs(multisine.command.values)) == pytest.approx(0.02, rel=1e-8)
    assert np.max(np.abs(multisine.command.values)) <= 0.02


def test_the_position_fills_the_envelope_where_that_limits():
    made = design(hopper(), replace(WANTED, max_effort=1.0, envelope=(0.144, 0.1605)))
    assert made.amplitude.limited_by == "envelope"
    margin = 5 * WANTED.noise_std
    slack = (made.output.min() - margin - 0.144, 0.1605 - made.output.max() - margin)
    assert min(slack) >= 0.0
    assert min(slack) < 0.002 * (made.output.max() - made.still.max())


def test_an_envelope_that_leaves_next_to_no_room_is_refused(multisine):
    tight = replace(WANTED, envelope=(multisine.still.min() - 2e-8, 0.17), noise_std=1e-9)
    with pytest.raises(InputError, match="next to no command .* --envelope allows less than"):
        design(hopper(), tight)


def test_the_distortion_is_bounded_where_that_is_asked_for(multisine):
    wanted = replace(WANTED, max_effort=1.0, envelope=(0.0, 0.4), max_distortion=0.03)
    made = design(hopper(), wanted)
    assert made.amplitude.limited_by == "max_distortion"
    assert 0.029 < made.distortion.total <= 0.03
    assert not any("departs" in note for note in made.notes)


def test_a_linear_machine_is_not_distorted_and_a_switching_one_the_more_the_larger_the_command(multisine):
    linear = HOPPER.replace("switched_damper: {stance:", "viscous_damper: {damping:").split(", flight")[0]
    linear += "}\n" + HOPPER[HOPPER.index("sensor") :]
    straight = design(Model.from_text(linear, catalogue=CATALOGUE), WANTED)
    assert straight.distortion.total < 1e-4
    double = design(hopper(), replace(WANTED, max_effort=0.04))
    assert 1.6 < double.distortion.even / multisine.distortion.even < 2.6


def test_the_bias_that_is_reported_is_what_a_fit_suffers(multisine):
    """The distortion, added once more to the record, moves the fit by the bias."""
    fit, record = multisine.prediction.fit, multisine.prediction.record
    signal = 0.1 * multisine.distortion.signal
    quiet = fit_from(fit.model, noisy(record, 2e-6, 0))
    moved = replace(record, output=replace(record.output, value=record.output.value + signal))
    bent = fit_from(fit.model, noisy(moved, 2e-6, 0))
    for name, bias in linearised_bias(fit, signal).items():
        shift = (bent.model.value(name) - quiet.model.value(name)) / fit.std[name]
        assert shift == pytest.approx(bias, abs=0.05 + 0.1 * abs(bias)), name


# Refusals

SAME = HOPPER.replace(
    "acceleration: {value: 9.81, unit: m/s^2, fixed: true}", "acceleration: {value: 9.81, unit: m/s^2}"
)


AXIS = """
inertia: {mass: {value: 2.0, unit: kg}}
force:
  - linear_spring: {stiffness: {value: 300.0, unit: N/m}, rest_length: {value: 0.0, unit: m}}
  - viscous_damper: {damping: {value: 5.0, unit: N*s/m}}
command:
  - input_delay: {delay: {value: 0.01, unit: s}}
"""


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"band": (0.0, 125.0)}, "--band up to 125 Hz aliases"),
        ({"band": (0.0, 124.5)}, r"sideband \+3 of 124.5 Hz lies at 127.5 Hz and aliases"),
        ({"band": (5.0, 2.0)}, "0 ≤ low < high"),
        ({"kind": "comb", "duration": 200.0, "harmonics": 3, "shifts": 4}, "the design aliases: the responses to .* use at least 7 shifts"),
        ({"kind": "comb"}, "--duration 60 s is too short for a comb of 9 chirps.* at least 87 s are needed"),
        ({"duration": 6.0}, "--duration 6 s is too short for a multisine of 8 s .* at least 12 s"),
        ({"duration": 200.0, "harmonics": 3, "spacing": 1.0}, "the design aliases: the responses to .* leave out --spacing"),
        ({"period": 9.0}, "--period 9 s aliases: it does not hold an even number of forcing periods of 1 s.*is 8 s"),
        ({"period": 8.3}, "--period 8.3 s aliases"),
        ({"period": 4.0}, "--period 4 s is too short"),
        ({"band": (2.2, 2.4)}, "the design aliases: no 4 lines between 2.2 and 2.4 Hz"),
        ({"envelope": (0.15, 0.17)}, "the limit cycle itself.* leaves the envelope 0.15 to 0.17"),
        ({"envelope": (0.2, 0.1)}, "two positions low < high"),
        ({"max_effort": 0.0}, "--max-effort 0"),
        ({"noise_std": -1.0}, "--noise-std -1"),
        ({"longest_delay": 1.2}, "delays up to 1.2 s alias: a shift by 1 s"),
        ({"input_delay": 0.4}, "the input delay of 0.4 s is outside 0 to 0.3 s"),
        ({"forcing": Forcing(0.0)}, "without forcing there is no limit cycle"),
        ({"shifts": 5}, "--shifts is none of a multisine's options"),
        ({"kind": "comb", "period": 10.0}, "--period is none of a comb's options"),
        ({"kind": "noise"}, "--kind noise: one of comb, multisine"),
    ],
)  # fmt: skip
def test_what_cannot_work_is_refused_in_one_line(changes, words):
    with pytest.raises(InputError, match=words) as refusal:
        design(hopper(), replace(WANTED, **changes))
    assert "\n" not in str(refusal.value)


def test_a_machine_without_forcing_is_designed_for_with_the_sum_of_its_delays():
    axis = Model.from_text(AXIS, catalogue=CATALOGUE)
    wanted = Requirements.of(axis, 20.0, (0.2, 6.0), 2.0, (-0.05, 0.05), 1e-5, rate=200, unforced=True)
    plan = design(axis, wanted)
    assert np.all(plan.still == 0.0) and plan.visible == ()
    assert set(plan.prediction.delays) == {"input"}
    assert plan.prediction.delays["input"].value == pytest.approx(0.01)
    assert any("only the sum of the two delays" in note for note in plan.notes)
    seen = noisy(plan.prediction.record, wanted.noise_std, seed=3)
    found = fit_from(plan.prediction.fit.model, seen)
    for name in plan.prediction.fit.names:
        error = found.model.value(name) - plan.prediction.fit.model.value(name)
        assert abs(error) < 5.0 * plan.prediction.fit.std[name], name


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"harmonics": 2}, "without forcing there is no limit cycle.* --no-forcing"),
        ({"kind": "comb"}, "--kind comb shifts its chirps along the forcing"),
        ({"forcing": Forcing(1.0, 1.0)}, "--no-forcing contradicts"),
        ({"envelope": (0.01, 0.05)}, "the position at rest.* leaves the envelope"),
    ],
)
def test_what_a_machine_without_forcing_cannot_have_is_refused(changes, words):
    axis = Model.from_text(AXIS, catalogue=CATALOGUE)
    limits = {
        "duration": 20.0,
        "band": (0.2, 6.0),
        "max_effort": 2.0,
        "envelope": (-0.05, 0.05),
        "noise_std": 1e-5,
    }
    with pytest.raises(InputError, match=words):
        design(axis, Requirements.of(axis, **(limits | changes), rate=200, unforced=True))


def test_a_parameter_that_the_design_cannot_determine_is_named():
    with pytest.raises(InputError, match="gravity.acceleration.*linear_spring.rest_length") as refusal:
        design(Model.from_text(SAME, catalogue=CATALOGUE), WANTED)
    assert "the design cannot determine all free parameters" in str(refusal.value)


def test_a_cycle_that_is_not_damped_is_refused():
    with pytest.raises(InputError, match="limit cycle"):
        design(hopper().with_values({"switched_damper.stance": 0.0}), WANTED)


def test_no_forcing_is_assumed_for_a_machine_that_is_not_in_newtons_and_metres():
    servo = Model.from_text(
        """
units: {force: N*m, position: rad}
inertia: {mass: 0.5}
force:
  - linear_spring: {stiffness: 5.0, rest_length: 0.0}
  - viscous_damper: {damping: 0.3}
"""
    )
    wanted = Requirements.of(servo, 20.0, (0.2, 6.0), 2.0, (-0.5, 0.5), 1e-5)
    assert not wanted.forced and not wanted.forcing_assumed and wanted.harmonics == 0
