"""Spectra over whole periods: the choice of window, the input's integral, the limit cycle set apart."""

from dataclasses import replace

import numpy as np
import pytest

from rhythmid.errors import InputError
from rhythmid.ltp.htf import linearised
from rhythmid.ltp.pumping import Pumping, pumping_of
from rhythmid.ltp.spectra import Window, spectra, steady_window
from rhythmid.record.record import Channel, Record

PUMPING = Pumping.cosine(1.0, 1.0)


def record(command: np.ndarray, output: np.ndarray | None = None, rate: float = 1000.0, **changes) -> Record:
    time = np.arange(len(command)) / rate
    value = np.zeros(len(command)) if output is None else output
    made = Record("made", Channel(time, value, "m"), Channel(time, command, "N"))
    return replace(made, **changes)


def test_chirps_that_follow_a_warm_up_are_cut_to_where_they_repeat(paper_record) -> None:
    window = steady_window(paper_record(), 1.0, 1.95)
    assert window.periods == 271  # nine times 30 + 1/9 s
    assert window.leakage < 1e-9


def test_silence_at_both_ends_needs_no_repetition() -> None:
    command = np.zeros(60_000)
    command[20_000:40_000] = np.random.default_rng(0).standard_normal(20_000)
    window = steady_window(record(command), 1.0, 1.0)
    assert window.periods == 48  # all but the warm-up of twelve ring-downs
    assert window.leakage == 0.0


def test_a_command_that_does_not_repeat_is_told_by_its_leakage() -> None:
    command = np.random.default_rng(0).standard_normal(60_000)
    assert steady_window(record(command), 1.0, 1.0).leakage > 0.5


def test_a_record_shorter_than_a_period_is_refused() -> None:
    with pytest.raises(InputError, match="less than one pumping period"):
        steady_window(record(np.zeros(700)), 1.0, 0.1)


@pytest.mark.parametrize("rate", [1000.0, 130.0])
def test_the_integral_of_a_held_input_is_exact(rate: float) -> None:
    """∫ u exp(−jωt) dt of a staircase, written out step by step."""
    count = int(20 * rate)
    values = np.sin(np.arange(count) ** 1.3)
    window = Window(0.0, 20, 0.0)
    found = spectra(record(values, rate=rate), PUMPING, 1.0, sidebands=2, window=window)
    edges = np.arange(count + 1) / rate
    for index in (1, 7, 33):
        omega = 2 * np.pi * found.frequency[index]
        exact = np.sum(values * np.diff(np.exp(-1j * omega * edges))) / (-1j * omega)
        assert found.input[index] == pytest.approx(exact, abs=1e-4 * np.abs(found.input).max())


def test_a_band_limited_input_has_no_half_sample_of_delay() -> None:
    time = np.arange(2000) / 100.0
    value = np.cos(2 * np.pi * 1.25 * time)
    found = spectra(
        record(value, rate=100.0, hold="band_limited"), PUMPING, 1.0, sidebands=2, window=Window(2.0, 16, 0.0)
    )
    assert np.angle(found.input[20]) == pytest.approx(0.0, abs=1e-3)  # cos has phase 0 in cycle time
    held = spectra(record(value, rate=100.0), PUMPING, 1.0, sidebands=2, window=Window(2.0, 16, 0.0))
    assert np.angle(held.input[20]) == pytest.approx(-2 * np.pi * 1.25 * 0.005, abs=1e-3)


def test_the_limit_cycle_is_found_with_its_delay(paper_record, rig) -> None:
    made = paper_record()
    cycle = linearised(rig.hopper, PUMPING).cycle
    found = spectra(made, pumping_of(made), cycle.ring_down)
    turned = cycle.harmonics(3) * np.exp(-2j * np.pi * np.arange(4) * 0.05)
    # the command moves its lines by a little too, where the chirp excites whole multiples of 1 Hz
    assert found.cycle[:4] == pytest.approx(turned, abs=2e-6)


def test_spectra_do_not_depend_on_when_the_recording_began(paper_record) -> None:
    made = paper_record()
    later = replace(
        made,
        **{role: replace(channel, time=channel.time + 17.3456) for role, channel in made.channels.items()},
    )
    first = spectra(made, pumping_of(made), 1.95)
    second = spectra(later, pumping_of(later), 1.95)
    assert second.window.periods == first.window.periods
    whole = second.window.start - first.window.start - 17.3456  # the cut may begin a sample earlier
    assert abs(whole) < 2e-3
    for m in (0, 1):  # what any HTF is made of; a shift by whole periods turns both factors alike
        bins = np.arange(300, 1500)
        products = [
            one.output_at(bins) * one.shifted_input(np.array([m]), bins)[0].conj() for one in (first, second)
        ]
        assert products[1] == pytest.approx(products[0], abs=1e-4 * np.abs(products[0]).max())


def test_a_period_of_no_whole_number_of_samples_does_not_leak() -> None:
    frequency = 0.9713
    time = np.arange(60_000) * 1e-3
    motion = 0.01 * np.cos(2 * np.pi * frequency * time) + 0.002 * np.cos(4 * np.pi * frequency * time + 1)
    found = spectra(
        record(np.zeros(60_000), motion),
        Pumping.cosine(1.0, frequency),
        1.0,
        sidebands=4,
        window=Window(10.0, 40, 0.0),
    )
    lines = np.abs(found.output)
    lines[:: found.window.periods] = 0.0
    assert lines.max() < 1e-6 * np.abs(found.output).max()
    assert found.cycle[1] == pytest.approx(0.005, abs=1e-8)


def test_a_silent_input_has_no_band() -> None:
    found = spectra(record(np.zeros(20_000)), PUMPING, 1.0)
    with pytest.raises(InputError, match="silent"):
        _ = found.band
