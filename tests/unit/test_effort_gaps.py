"""Lost rows of a record whose effort is scored: short gaps are bridged and count for nothing, long ones cut the record."""

from dataclasses import replace

import numpy as np
import pytest
from axes import CATALOGUE, RATE, axis, axis_model

from rhythmid.diagnose.admission import admitted
from rhythmid.diagnose.diagnosis import Answer, diagnose
from rhythmid.identify.inverse_dynamics.balance import QUARTER, Balance
from rhythmid.identify.inverse_dynamics.estimate import fit_effort
from rhythmid.identify.inverse_dynamics.motion import across, short_gaps, stretches
from rhythmid.record.record import Channel, Record

BURST, BURSTS = 5, 10  # rows, and how often as many are lost: 1 % of the record
FEW = CATALOGUE.without(
    *(
        set(CATALOGUE)
        - {"coulomb_friction", "asymmetric_coulomb_friction", "cubic_stiffness", "viscous_damper"}
    )
)


def lossy(record: Record, firsts: np.ndarray, count: int) -> Record:
    """The record without so many rows from each of `firsts` on."""
    kept = np.ones(len(record.output), dtype=bool)
    for first in firsts:
        kept[first : first + count] = False

    def part(channel: Channel | None) -> Channel:
        assert channel is not None
        return replace(channel, time=channel.time[kept], value=channel.value[kept])

    return replace(record, output=part(record.output), input=part(record.input))


def bursts(record: Record) -> Record:
    """The record without 1 % of its rows, in bursts anywhere."""
    places = np.linspace(200, len(record.output) - 200, BURSTS)
    return lossy(record, (places + np.random.default_rng(0).uniform(-150, 150, BURSTS)).astype(int), BURST)


def whole(record: Record) -> tuple[Record, ...]:
    return admitted([record], (), axis_model()).whole_records


def covered(balance: Balance) -> float:
    """Time [s] of which the effort is scored, its rows as far apart as they are within a stretch."""
    apart = [np.median(np.diff(p)) * m.period for p, m in zip(balance.places, balance.motions) if len(p) > 1]
    return len(balance.measured) * float(np.median(apart))


@pytest.fixture(scope="module")
def complete() -> Answer:
    return diagnose([axis()], axis_model(), catalogue=FEW)


def test_a_record_that_lost_rows_in_bursts_gives_the_verdict_of_the_whole_one(complete):
    found = diagnose([bursts(axis())], axis_model(), catalogue=FEW)
    names = [[one.element for one in answer.diagnosis.missing] for answer in (found, complete)]
    assert names[0] == names[1] == ["coulomb_friction"]
    assert found.diagnosis.verdict == complete.diagnosis.verdict == "missing_physics"
    force, exact = (one.model.value("coulomb_friction.force") for one in (found, complete))
    assert force == pytest.approx(exact, rel=0.03)
    (note,) = [one for one in found.diagnosis.notes if "bridged" in one]
    assert note.startswith(f"axis 0: {BURSTS} gaps of at most {(BURST + 1) / RATE:.2g} s")
    assert not any("cut where" in one for one in found.diagnosis.notes)


def test_lost_rows_cost_no_more_than_their_own_time():
    record = bursts(axis())
    before, after = Balance.of([axis()], axis_model()), Balance.of(whole(record), axis_model())
    assert covered(after) == pytest.approx(covered(before), rel=0.05)
    assert len(after.motions) == 1


def test_no_row_of_effort_lies_where_nothing_was_recorded():
    record = bursts(axis())
    balance = Balance.of(whole(record), axis_model())
    (motion,), (places,) = balance.motions, balance.places
    nearest = np.abs(motion.time[places][:, None] - record.output.time[None, :]).min(axis=1)
    assert len(motion.bridged) == BURSTS and nearest.max() < 1.0 / RATE


def test_a_single_bridged_gap_is_told_in_the_singular():
    (note,) = Balance.of(whole(lossy(axis(), np.array([2500]), BURST)), axis_model()).notes
    assert note.startswith("axis 0: a gap of 0.0") and " s is bridged" in note


def test_a_gap_that_is_long_beside_the_effort_s_shortest_period_cuts_the_record():
    shortest = 1.0 / Balance.of([axis()], axis_model()).bandwidth.effort
    count = int(4.0 * QUARTER * shortest * RATE)
    balance = Balance.of(whole(lossy(axis(), np.array([2500]), count)), axis_model())
    assert len(balance.motions) == 2 and not balance.notes
    fit = fit_effort(
        balance, axis_model().with_element(CATALOGUE["coulomb_friction"], {"force": 0.3, "transition": 0.02})
    )
    assert fit.model.value("inertia.mass") == pytest.approx(1.0, abs=0.02)


def test_a_bridge_follows_what_the_band_holds_and_not_the_noise_beside_it():
    rng = np.random.default_rng(1)
    turns = 2.0 * np.pi * np.arange(400) / 80.0  # a gap of a quarter of a period is 20 samples
    missing = np.zeros(400, dtype=bool)
    missing[190:210] = True
    for period, most in ((1.0, 0.13), (2.0, 0.016)):
        smooth = np.sin(turns / period + 0.4)
        made = across(np.where(missing, 0.0, smooth), ~missing, missing)
        assert np.abs(made - smooth)[missing].max() < most
    noise = 0.1 * rng.standard_normal(400)
    assert np.abs(across(noise, ~missing, missing))[missing].max() < 0.1


def test_only_gaps_up_to_the_longest_with_samples_beside_them_are_short():
    missing = np.zeros(100, dtype=bool)
    missing[2:4] = missing[30:33] = missing[60:80] = True
    assert np.flatnonzero(short_gaps(missing, 10)).tolist() == [30, 31, 32]
    assert not short_gaps(missing, 0).any()


@pytest.mark.parametrize("at_the_end", [True, False])
def test_a_gap_at_an_end_of_what_the_channels_share_is_left_out(at_the_end):
    record = axis()
    assert record.input is not None
    count = len(record.output)
    lost = np.r_[count - 8 : count - 1] if at_the_end else np.r_[1:8]
    kept = np.delete(np.arange(count), lost)
    shorter = slice(0, count - 3) if at_the_end else slice(3, count)
    cut = replace(
        record,
        output=replace(record.output, time=record.output.time[shorter], value=record.output.value[shorter]),
        input=replace(record.input, time=record.input.time[kept], value=record.input.value[kept]),
    )
    (found,) = stretches([cut], axis_model(), longest=1.0)
    ends = (
        (record.output.time[0], record.output.time[count - 9])
        if at_the_end
        else (record.output.time[8], record.output.time[-1])
    )
    assert (found.time[0], found.time[-1]) == pytest.approx(ends, abs=1.0 / RATE) and found.bridged == ()


def alternating(phase: float) -> Record:
    """A record of whose rows every other one is lost in two seconds; the output begins `phase` of a period before the input."""
    record = axis()
    assert record.input is not None
    lost = np.arange(1000, 1000 + int(2.0 * RATE), 2)
    output = replace(
        record.output,
        time=np.delete(record.output.time - phase / RATE, lost),
        value=np.delete(record.output.value, lost),
    )
    kept = replace(
        record.input, time=np.delete(record.input.time, lost), value=np.delete(record.input.value, lost)
    )
    return replace(record, output=output, input=kept)


@pytest.mark.parametrize("phase", [0.0, 0.3])
def test_gaps_with_a_sample_between_them_are_not_made_one(phase):
    (found,) = stretches([alternating(phase)], axis_model(), longest=4.0 / RATE)
    assert max(end - begin for begin, end in found.bridged) < 3.5 / RATE
    assert len(found.bridged) == pytest.approx(2.0 * RATE / 2.0, abs=2)


@pytest.mark.parametrize("phase", [0.0, 0.3, 0.7])
def test_what_was_measured_between_gaps_is_kept(phase):
    """Also where the gaps of both channels together leave no time at which both were sampled."""
    (found,) = stretches([alternating(phase)], axis_model(), longest=4.0 / RATE)
    complete = np.interp(found.time, axis().output.time - phase / RATE, axis().output.value)
    assert np.abs(found.output - complete).max() < 0.01 * np.std(complete)
