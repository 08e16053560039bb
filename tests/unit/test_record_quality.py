"""What is said of a recording's quality: counts that are right, and nothing about a flawless one."""

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rhythmid.errors import InputError
from rhythmid.record.bag_report import quality_report
from rhythmid.record.bag_writer import write_bag
from rhythmid.record.channel_quality import channel_quality
from rhythmid.record.messages import Messages
from rhythmid.record.quality import ChannelQuality, Quality, clipped
from rhythmid.record.timing import Timing, nominal_period, put_in_order

seeds = st.integers(0, 10_000)


@given(
    seed=seeds,
    rate=st.sampled_from([7.0, 50.0, 60.0, 100.0, 333.0, 1000.0, 2500.0]),
    count=st.integers(20, 400),
)
def test_the_nominal_period_survives_jitter_and_loss(seed, rate, count):
    rng = np.random.default_rng(seed)
    time = (np.arange(count) + rng.uniform(-0.1, 0.1, count)) / rate
    kept = rng.random(count) > 0.1
    kept[:3] = True
    timing = Timing.of(time[kept])
    assert timing.period == pytest.approx(1.0 / rate, rel=0.05)


@given(seed=seeds, lost=st.integers(0, 20))
def test_lost_samples_are_counted_exactly(seed, lost):
    kept = np.ones(500, bool)
    kept[np.random.default_rng(seed).choice(np.arange(1, 499), lost, replace=False)] = False
    timing = Timing.of(np.arange(500)[kept] * 1e-3)
    assert timing.lost == lost and timing.count == 500 - lost
    runs = np.diff(np.concatenate([[0], ~kept, [0]]).astype(int))
    assert timing.gaps == np.count_nonzero(runs == 1)
    assert timing.jitter_std == pytest.approx(0.0, abs=1e-9)


@given(seed=seeds, repeated=st.integers(0, 50))
def test_duplicates_are_counted_exactly(seed, repeated):
    time = np.arange(200) * 1e-3
    again = np.random.default_rng(seed).choice(time, repeated)
    timing = Timing.of(np.sort(np.concatenate([time, again])))
    assert (timing.duplicates, timing.gaps, timing.lost) == (repeated, 0, 0)


@given(seed=seeds, std=st.floats(1e-6, 1e-4))
def test_the_jitter_is_that_of_the_steps(seed, std):
    time = np.arange(4000) * 1e-3 + np.random.default_rng(seed).normal(0.0, std, 4000)
    assert Timing.of(time).jitter_std == pytest.approx(np.sqrt(2.0) * std, rel=0.1)


@given(seed=seeds, jitter=st.floats(0.0, 0.45))
def test_jitter_is_no_gap_and_its_long_steps_count_as_jitter(seed, jitter):
    time = np.sort(np.arange(500) + np.random.default_rng(seed).uniform(-jitter, jitter, 500)) * 1e-3
    timing = Timing.of(time)
    assert (timing.gaps, timing.lost, timing.longest_gap) == (0, 0, 0.0)
    assert timing.jitter_std == pytest.approx(float(np.std(np.diff(time))), rel=0.02, abs=1e-9)


@pytest.mark.parametrize("rate", [1000.0, 610.3515625, 1024.0, 3.0])
def test_an_even_rate_is_found_to_the_last_digit(rate):
    assert nominal_period(np.diff(np.arange(5000) / rate)) == pytest.approx(1.0 / rate, rel=1e-12)


def test_stamps_rounded_to_a_millisecond_do_not_bend_the_rate():
    time = np.round(np.arange(3000) / 300.0, 3)
    assert Timing.of(time).rate == pytest.approx(300.0, rel=1e-3)


@pytest.mark.parametrize("count", [0, 1])
def test_hardly_any_samples_have_no_rate(count):
    timing = Timing.of(np.zeros(count))
    assert (timing.count, timing.rate, timing.gaps) == (count, 0.0, 0)


@given(seed=seeds)
def test_samples_that_overtook_one_another_are_put_back(seed):
    rng = np.random.default_rng(seed)
    time = np.arange(300) * 1e-3
    order = np.arange(300)
    for at in rng.choice(np.arange(10, 280, 12), 5, replace=False):
        order[at], order[at + 2] = order[at + 2], order[at]
    kept = put_in_order(time[order], "output", "split it")
    np.testing.assert_array_equal(time[order][kept], time)


@pytest.mark.parametrize("back", [0.02, 1.0, 1e9])
def test_a_clock_that_was_set_back_is_refused(back):
    time = np.arange(300) * 1e-3 + 2e9
    time[100:] -= back
    with pytest.raises(
        InputError,
        match=r"^output: time goes backwards by .* \(sample 101 of 300\): the clock was set back there, .*; split it$",
    ):
        put_in_order(time, "output", "split it")


@given(seed=seeds)
def test_rows_that_come_twice_are_put_back_with_those_that_overtook_one_another(seed):
    rng = np.random.default_rng(seed)
    rows = np.sort(np.concatenate([np.arange(600), rng.choice(600, 30, replace=False)]))
    for at in 4 * rng.choice(140, 20, replace=False):
        rows[at], rows[at + 1] = rows[at + 1], rows[at]
    kept = put_in_order(rows * 1e-3, "output", "split it")
    np.testing.assert_array_equal(rows[kept], np.arange(600))


@pytest.mark.parametrize("periods", [2, 3, 10])
def test_a_clock_that_was_set_back_by_whole_periods_is_refused(periods):
    time = np.arange(300) * 1e-3
    time[100:] -= periods * 1e-3
    with pytest.raises(InputError, match="time goes backwards"):
        put_in_order(np.round(time, 6), "output", "split it")


def test_rows_that_are_mixed_up_are_refused_with_another_mend_than_a_clock_that_was_set_back():
    order = np.random.default_rng(0).permutation(300)
    with pytest.raises(
        InputError, match=r"the first of \d+ times\): rows are mixed up or damaged: sort them"
    ):
        put_in_order(np.arange(300)[order] * 1e-3, "output", "split it")


def test_gaps_that_channels_share_are_counted_once():
    quality = ChannelQuality("/y", Timing.of(np.delete(np.arange(100), [50, 70, 71]) * 1e-3))
    both = Quality({"input": quality, "output": quality})
    assert (both.gaps, both.lost, both.to_dict()["gaps"]) == (2, 3, 2)


@given(seed=seeds, limit=st.floats(0.3, 0.9))
def test_clipping_is_seen(seed, limit):
    phase = np.random.default_rng(seed).uniform(0, 2 * np.pi)
    value = np.clip(np.sin(2 * np.pi * np.arange(2000) / 200 + phase), -limit, limit)
    assert clipped(value) >= np.count_nonzero(np.abs(value) == limit) - 8


@given(seed=seeds)
def test_what_is_not_clipped_is_not_called_so(seed):
    rng = np.random.default_rng(seed)
    smooth = np.sin(2 * np.pi * np.arange(2000) / 200 + rng.uniform(0, 6))
    for value in (
        smooth,
        np.round(smooth, 1),
        rng.standard_normal(500),
        np.repeat([0.0, 1.0], 50),
        np.zeros(10),
    ):
        assert clipped(value) == 0


@given(seed=seeds)
def test_a_standstill_after_a_short_jump_that_the_motion_then_leaves_is_no_clipping(seed):
    rng = np.random.default_rng(seed)
    back = np.array([-0.4, -0.8]) * rng.uniform(0.5, 2.0)
    away = back[1] + np.cumsum([0.26, *np.full(500, 0.5)])  # as fast at once as a motor without load
    value = np.concatenate([np.zeros(200), back, np.full(rng.integers(5, 12), back[1]), away])
    assert clipped(value) == 0


@given(seed=seeds)
def test_a_rounded_speed_that_drops_a_count_now_and_then_is_no_clipping(seed):
    value = np.full(600, 52.36)
    value[np.random.default_rng(seed).integers(12, 18, 40).cumsum() % 600] = 47.12
    assert clipped(np.concatenate([np.zeros(300), [20.0, 40.0], value, [31.0], np.zeros(300)])) == 0


@given(seed=seeds)
def test_a_single_clipped_peak_is_seen_in_a_motion_that_also_sticks(seed):
    """Friction holds the machine elsewhere for as long, but it slows down before."""
    phase = np.random.default_rng(seed).uniform(0.0, 0.5)
    swing = 1.4 * np.sin(np.linspace(0.0, np.pi, 200)[1:]) - 0.1 * phase
    slowing = -0.5 * (1.0 - np.exp(-np.arange(150) / 12.0)) + swing[-1]
    value = (
        np.round(
            np.concatenate([np.clip(swing, -9.0, 1.0), slowing, slowing[-1] - 0.02 * np.arange(30)]) / 0.002
        )
        * 0.002
    )
    assert clipped(value) == np.count_nonzero(value == value.max())


@given(seed=seeds)
def test_a_machine_that_rests_on_many_levels_is_not_clipped_on_its_outermost_ones(seed):
    rng = np.random.default_rng(seed)
    levels = np.round(rng.uniform(0.0, 10.0, 12), 5)
    moves = [np.round(np.linspace(a, b, 12)[1:-1], 5) for a, b in zip(levels, levels[1:])]
    rests = [np.full(rng.integers(60, 120), level) for level in levels]
    value = np.concatenate([part for pair in zip(rests, moves) for part in pair] + [rests[-1]])
    assert clipped(value) == 0


def test_a_flawless_channel_gives_no_complaint():
    flawless = ChannelQuality("/y position[0]", Timing.of(np.arange(100) * 1e-3))
    assert flawless.complaints() == []
    assert Quality({"output": flawless}).warnings() == []


def test_every_flaw_is_named():
    time = np.sort(np.concatenate([np.delete(np.arange(100), [50, 51]), [7]])) * 1e-3
    flawed = ChannelQuality("/y", Timing.of(time), nan=1, clipped=4, missing=2, conflicts=1)
    told = "; ".join(flawed.complaints())
    for words in ("1 gaps, 2 samples lost, longest 0.003 s", "1 duplicates, 1 of them with other values: of equal times the first sample is kept", "1 samples are NaN or empty",
                  "4 samples look clipped", "2 messages without"):  # fmt: skip
        assert words in told
    quality = Quality({"output": flawed}, truncated=True, notes=("breaks off",))
    assert quality.warnings()[0] == "breaks off" and quality.lost == 2 and quality.clipped == 4
    assert json.loads(json.dumps(quality.to_dict()))["channels"]["output"]["gaps"] == 1


def test_the_report_of_a_bag_tells_rate_lateness_and_size(tmp_path):
    stamps = np.arange(1000) * 2_000_000
    late = stamps + np.random.default_rng(0).integers(200_000, 400_000, 1000)
    topics = {
        "excitation": Messages(stamps, effort=np.sin(stamps * 1e-9)),
        "joint_states": Messages(stamps, position=np.cos(stamps * 1e-9), receive_ns=late),
    }
    report = quality_report(write_bag(tmp_path / "bag", topics))
    found = {topic.name: topic.to_dict() for topic in report.topics}["/hopper/joint_states"]
    assert found["rate"] == pytest.approx(500.0) and found["count"] == 1000
    assert found["lateness_mean"] == pytest.approx(3e-4, rel=0.02)
    assert found["lateness_max"] == pytest.approx(4e-4, rel=0.02)
    assert report.usable and report.size > 100_000 and report.duration == pytest.approx(1.998, abs=1e-3)
    told = "\n".join(report.lines())
    assert (
        "500 Hz" in told
        and "output: /hopper/joint_states position[leg]: 500 Hz, jitter of its arrival 5.8e-05 s: flawless"
        in told
    )


def test_the_report_tells_why_a_bag_cannot_be_used(tmp_path):
    topics = {"excitation": Messages(np.arange(100) * 1_000_000, effort=np.ones(100))}
    report = quality_report(write_bag(tmp_path / "bag", topics))
    assert not report.usable and "topic /hopper/joint_states is not in" in report.problems[0]
    assert [topic.name for topic in report.topics] == ["/hopper/excitation"]


def test_infinite_values_do_not_disturb_what_is_told_of_the_others(recwarn):
    time = 0.01 * np.arange(400)
    value = np.round(np.clip(np.sin(5.0 * time), -0.8, 0.9), 2)
    spoilt = value.copy()
    spoilt[[60, 61, 62, 200, 201, 202]] = np.inf
    plain, found = (channel_quality("q", time, None, time, one, False, 0, 0) for one in (value, spoilt))
    assert found.clipped > 0 and found.resolution == plain.resolution
    assert not recwarn.list


def test_a_channel_of_which_nothing_is_finite_has_no_resolution():
    found = channel_quality("q", np.arange(9.0), None, np.arange(9.0), np.full(9, np.inf), True, 0, 0)
    assert found.resolution == 0.0 and not found.clipped
