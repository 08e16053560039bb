"""The forcing as a time reference: frequency, phase and harmonics from a recorded channel."""

import numpy as np
import pytest

from rhythmid.errors import InputError
from rhythmid.ltp.pumping import Pumping, active_pumping, pumping_of_channel
from rhythmid.record.fourier_series import fundamental_frequency
from rhythmid.record.record import Channel, Record

TIME = np.arange(12_000) * 1e-3


def channel(value: np.ndarray, time: np.ndarray = TIME) -> Channel:
    return Channel(time, value, "N")


@pytest.mark.parametrize("frequency", [1.0, 0.97, 2.5137])
@pytest.mark.parametrize("phase", [0.0, 1.0, -3.0])
def test_frequency_amplitude_and_phase_of_a_recorded_cosine_are_found(frequency: float, phase: float) -> None:
    found = pumping_of_channel(channel(0.7 * np.cos(2 * np.pi * frequency * TIME + phase)))
    assert found.frequency == pytest.approx(frequency, rel=1e-10)
    assert found.coefficients[1] == pytest.approx(0.7, rel=1e-9)
    assert found(TIME - found.origin) == pytest.approx(
        0.7 * np.cos(2 * np.pi * frequency * TIME + phase), abs=1e-8
    )


@pytest.mark.parametrize("periods", [2.1, 2.5, 3.0, 4.0, 5.0, 6.3, 9.0])
@pytest.mark.parametrize("noise", [0.0, 0.02])
def test_few_periods_are_enough_and_their_period_is_not_doubled(periods: float, noise: float) -> None:
    time = np.arange(round(1000 * periods)) * 1e-3
    value = np.cos(2 * np.pi * time + 0.7) + noise * np.random.default_rng(2).standard_normal(len(time))
    found = pumping_of_channel(channel(value, time))
    assert found.frequency == pytest.approx(1.0, abs=1e-9 + 0.05 * noise)


def test_a_stated_cosine_and_its_recording_are_the_same_pumping() -> None:
    stated = Pumping.cosine(-0.4, 1.25, 0.3)
    recorded = pumping_of_channel(channel(-0.4 * np.cos(2 * np.pi * 1.25 * TIME + 0.3)))
    assert recorded(TIME - recorded.origin) == pytest.approx(stated(TIME - stated.origin), abs=1e-9)


def test_harmonics_of_the_forcing_are_kept_even_where_they_are_stronger_than_the_fundamental() -> None:
    value = 0.3 * np.cos(2 * np.pi * TIME + 0.4) + 0.5 * np.sin(4 * np.pi * TIME) + 0.1
    found = pumping_of_channel(channel(value))
    assert found.frequency == pytest.approx(1.0, rel=1e-9)
    assert found(TIME - found.origin) == pytest.approx(value, abs=1e-9)


def test_irregular_stamps_do_not_matter() -> None:
    time = np.sort(TIME + np.random.default_rng(1).uniform(0, 8e-4, len(TIME)))
    found = pumping_of_channel(channel(np.cos(2 * np.pi * 1.1 * time - 0.2), time))
    assert found.frequency == pytest.approx(1.1, rel=1e-10)


@pytest.mark.parametrize("frequency", [0.7, 1.25, 2.0])
@pytest.mark.parametrize("late", [0.0, 0.05, 0.2])
@pytest.mark.parametrize("duration", [7.0, 13.0, 30.0])
def test_a_forcing_that_stands_still_at_the_ends_keeps_its_frequency(frequency, late, duration) -> None:
    time = np.arange(0.003, duration, 0.007)
    value = np.cos(2 * np.pi * frequency * np.clip(time, late, duration - late) + 2.9)
    assert fundamental_frequency(time, value) == pytest.approx(frequency, rel=0.02)


def test_a_constant_with_a_hair_of_noise_has_some_frequency_within_its_band() -> None:
    time = 0.007 * np.arange(1000)
    for seed in range(20):
        value = 1.0 + 1e-9 * np.random.default_rng(seed).standard_normal(len(time))
        assert 0.0 < fundamental_frequency(time, value) < 0.5 / 0.007


def test_the_signal_over_a_period_is_the_forcing() -> None:
    pumping = Pumping(0.8, np.array([0.1, 0.5, 0.2 - 0.1j]), 0.3)
    signal = pumping.signal()
    assert signal is not None
    at = np.linspace(0.0, pumping.period, 777)
    assert signal(at) == pytest.approx(pumping(at), abs=1e-10)


def test_a_constant_forcing_is_no_pumping() -> None:
    assert not pumping_of_channel(channel(np.full(len(TIME), 2.0))).active


def test_a_forcing_that_is_not_periodic_is_refused() -> None:
    noise = np.random.default_rng(0).standard_normal(len(TIME))
    with pytest.raises(InputError, match="not periodic"):
        pumping_of_channel(channel(noise))


def test_less_than_two_periods_of_forcing_are_refused() -> None:
    with pytest.raises(InputError, match="at least 2"):
        pumping_of_channel(channel(np.cos(2 * np.pi * 0.1 * TIME)))


def test_a_record_without_a_periodic_forcing_has_no_active_pumping() -> None:
    still, noise = np.full(len(TIME), 2.0), np.random.default_rng(0).standard_normal(len(TIME))
    output = channel(np.cos(TIME))
    for forcing in (None, channel(still), channel(noise)):
        assert active_pumping(Record("r", output, forcing=forcing)) is None
    assert active_pumping(Record("r", output, forcing=channel(np.cos(2 * np.pi * TIME)))) is not None
