"""A simulation's record beside a real one: aligned by what was commanded, and told where they part."""

import json
from dataclasses import replace

import numpy as np
import pytest

from machines import CATALOGUE, hopper, record
from rhythmid.compare.align import align
from rhythmid.compare.compare import Comparison, compare
from rhythmid.errors import InputError
from rhythmid.record.record import Channel, Record

CHIRP = {"type": "chirp", "amplitude": 1.0, "sweep": 12.0, "band": [0.0, 7.0]}
MULTISINE = {"type": "multisine", "rms": 0.5, "period": 4.0, "periods": 4, "band": [0.1, 6.0]}
SILENCE = {"type": "silence", "length": 10.0}
NONE = (0.0, 0.0)


def hidden(element: str, **values: float):
    return hopper().with_element(CATALOGUE[element], values)


def resampled(one: Record, every: int = 1, later: float = 0.0) -> Record:
    """The record with only every so many samples, its clock moved."""

    def part(channel: Channel | None) -> Channel | None:
        if channel is None:
            return None
        return replace(channel, time=channel.time[::every] + later, value=channel.value[::every])

    return replace(one, output=part(one.output), input=part(one.input), forcing=part(one.forcing))


def bare(one: Record) -> Record:
    return replace(one, input=None, forcing=None)


def names(found: Comparison) -> list[str]:
    return [one.name for one in found.explanations]


@pytest.fixture(scope="module")
def simulation() -> Record:
    return record(hopper(), CHIRP, delays=NONE, std=0.0)


# alignment


@pytest.mark.parametrize(("every", "later"), [(1, 3.7), (2, -1.2345678), (3, 100.00037)])
def test_the_offset_of_the_clocks_is_found_below_a_sample_by_the_command(simulation, every, later):
    found = align(simulation, resampled(record(hopper(), CHIRP), every, later))
    assert (found.by, found.mismatch) == ("command", "")
    assert found.offset == pytest.approx(later, abs=2e-5)


def test_a_part_of_the_recording_that_began_in_the_middle_is_aligned_too(simulation):
    seen = resampled(record(hopper(), CHIRP), later=5.0).cut(8.0, 16.0)
    assert align(simulation, seen).offset == pytest.approx(5.0, abs=1e-6)


def test_of_the_many_offsets_of_a_repeating_command_the_true_one_is_taken():
    one = record(hopper(), MULTISINE, delays=NONE, std=0.0)
    assert align(one, resampled(record(hopper(), MULTISINE), later=5.0)).offset == pytest.approx(
        5.0, abs=1e-6
    )


def test_without_a_command_the_forcing_s_phase_aligns():
    one = record(hopper(), SILENCE, delays=NONE, std=0.0)
    found = align(one, resampled(record(hopper(), SILENCE), later=0.37))
    assert found.by == "forcing"
    assert found.offset % 1.0 == pytest.approx(0.37, abs=1e-4)


def test_with_neither_the_motions_are_aligned_and_a_delay_is_not_claimed(simulation):
    found = compare(bare(simulation), [bare(record(hopper(), CHIRP, delays=(0.0, 0.03)))])
    assert found.alignment.by == "output"
    assert not {"measurement_delay", "input_delay"} & set(names(found))


def test_another_excitation_is_called_not_comparable_in_one_line(simulation):
    found = compare(simulation, [record(hopper(), CHIRP | {"amplitude": 0.7})])
    assert not found.comparable
    assert found.headline.startswith("Not comparable: different excitation (the commands differ by 30 %")
    assert "\n" not in found.headline
    assert found.explanations == ()


def test_with_a_model_another_excitation_is_compared_through_it(simulation):
    real = hidden("coulomb_friction", force=0.05, transition=0.002)
    found = compare(simulation, [record(real, CHIRP | {"amplitude": 0.7}, delays=NONE)], hopper())
    assert found.comparable and found.through_model
    assert names(found)[0] == "velocity"


def test_a_command_that_began_elsewhere_in_the_forcing_s_cycle_is_noticed(simulation):
    late = {"type": "sequence", "parts": [{"type": "silence", "length": 2.3}, CHIRP]}
    found = compare(simulation, [record(hopper(), late, delays=(0.02, 0.0))])
    assert found.alignment.offset == pytest.approx(2.3, abs=1e-6)
    assert found.alignment.turn == pytest.approx(-0.3, abs=1e-6)
    assert found.slot == "command"
    assert "later in the forcing's cycle" in found.notes[0]


def test_of_several_recordings_the_one_of_the_same_experiment_is_compared(simulation):
    others = [
        record(hopper(), SILENCE, seed=1),
        record(hopper(), CHIRP, seed=2),
        record(hopper(), MULTISINE, seed=3),
    ]
    assert compare(simulation, others).recording == "record 2"


def test_a_recordings_outliers_are_left_out_and_told(simulation):
    clean = record(hopper(), CHIRP, delays=NONE)
    value = clean.output.value.copy()
    value[300::900] += 0.5
    found = compare(simulation, [replace(clean, output=replace(clean.output, value=value))])
    assert not found.parted
    assert sum("stand far off their neighbours" in note for note in found.notes) == 1


# where they part


@pytest.mark.parametrize("correlation", [0.0, 0.8])
def test_where_nothing_differs_but_noise_they_agree(simulation, correlation):
    found = compare(simulation, [record(hopper(), CHIRP, delays=NONE, correlation=correlation)])
    assert not found.parted and found.slot is None
    assert "agree within the noise" in found.headline


@pytest.mark.parametrize(
    ("delays", "expected"),
    [((0.0, 0.0151), {"measurement_delay": 0.0151}), ((0.02, 0.0), {"input_delay": 0.02}),
     ((0.0203, 0.0151), {"input_delay": 0.0203, "measurement_delay": 0.0151})],
)  # fmt: skip
def test_each_delay_is_found_on_its_side(simulation, delays, expected):
    found = compare(simulation, [resampled(record(hopper(), CHIRP, delays=delays), 2, 7.77)])
    sizes = {one.name: one.values["delay"][0] for one in found.explanations}
    assert sizes == pytest.approx(expected, abs=6e-4)


@pytest.mark.parametrize(
    ("element", "values", "slot", "name"),
    [
        ("cubic_stiffness", {"coefficient": 20000.0}, "force", "position"),
        ("coulomb_friction", {"force": 0.05, "transition": 0.002}, "force", "velocity"),
        ("stiffness_drift", {"rate": 0.005}, "force", "position, changing with time"),
        (
            "periodic_disturbance",
            {"amplitude": 0.1, "frequency": 3.3, "phase": 0.3},
            "force",
            "periodic_disturbance",
        ),
        ("actuator_saturation", {"limit": 1.5}, "actuator", "actuator force"),
        ("command_lag", {"time_constant": 0.02}, "command", "command_lag"),
        ("sensor_lag", {"time_constant": 0.02}, "sensor", "sensor_lag"),
        ("sensor_gain", {"gain": 1.05}, "sensor", "sensor_gain"),
        ("sensor_drift", {"rate": 1e-4}, "sensor", "sensor_drift"),
    ],
)
def test_a_concealed_effect_is_put_into_its_slot(simulation, element, values, slot, name):
    seen = resampled(record(hidden(element, **values), CHIRP, delays=NONE, seed=4), 2, 1.23)
    found = compare(simulation, [seen])
    assert found.slot == slot
    assert names(found)[0] == name
    assert found.explanations[0].explained > 0.85


def test_a_force_is_found_beside_both_delays(simulation):
    friction = hidden("coulomb_friction", force=0.03, transition=0.002)
    found = compare(simulation, [record(friction, CHIRP, delays=(0.02, 0.015))])
    assert {"input_delay", "velocity", "measurement_delay"} == set(names(found))
    sizes = [one.values["delay"][0] for one in found.explanations if one.values]
    assert sum(sizes) == pytest.approx(0.035, abs=2e-3)


def test_frequency_time_and_growth_of_a_drift_are_told(simulation):
    place = compare(simulation, [record(hidden("sensor_drift", rate=1e-4), CHIRP, delays=NONE)]).place
    assert place.growth > 3.0
    assert place.frequency < 0.2
    assert place.first is not None and place.first > 0.5


def test_a_difference_that_comes_with_the_cycle_is_told_with_its_harmonic():
    one = record(hopper(), SILENCE, delays=NONE, std=0.0)
    found = compare(one, [record(hopper(), SILENCE, delays=(0.0, 0.02))])
    assert found.place.harmonic == 1
    assert found.harmonics[0].late == pytest.approx(0.02, abs=5e-4)


def test_another_start_is_not_mistaken_for_physics():
    one = record(hopper(), SILENCE, delays=NONE, std=0.0)
    time = one.output.time
    ringing = 2e-3 * np.exp(-0.5 * time) * np.cos(2 * np.pi * 2.24 * time)
    found = compare(one, [replace(one, output=replace(one.output, value=one.output.value + ringing))])
    assert not found.parted
    assert "another start" in found.headline


def test_the_comparison_is_plain_json(simulation):
    found = compare(simulation, [record(hopper(), CHIRP)]).to_dict()
    assert {
        "slot",
        "phase",
        "state",
        "frequency",
        "harmonics",
        "time",
        "alignment",
        "explanations",
        "comparable",
    } <= set(found)
    json.dumps(found, allow_nan=False)


# bad input


def test_records_that_hardly_overlap_are_refused_with_one_line(simulation):
    with pytest.raises(InputError, match="periods of the motion in common|s in common"):
        compare(bare(simulation.cut(0.0, 0.5)), [bare(record(hopper(), CHIRP))])


def test_a_simulation_of_too_few_samples_is_refused(simulation):
    with pytest.raises(InputError, match="only 50 samples"):
        compare(simulation.cut(0.0, 0.05), [record(hopper(), CHIRP)])


def test_a_simulation_that_stands_still_is_refused(simulation):
    still = replace(simulation, output=replace(simulation.output, value=np.zeros(len(simulation.output))))
    with pytest.raises(InputError, match="the output never changes"):
        compare(still, [record(hopper(), CHIRP)])


def test_a_position_is_not_compared_with_a_velocity(simulation):
    with pytest.raises(InputError, match="holds a position, record 0 a velocity"):
        compare(simulation, [replace(record(hopper(), CHIRP), output_kind="velocity")])


def test_a_recording_in_millimetres_is_remarked(simulation):
    seen = record(hopper(), CHIRP)
    wrong = replace(seen, output=replace(seen.output, value=1000.0 * seen.output.value))
    assert any("check the units" in note for note in compare(simulation, [wrong]).notes)


def test_a_gap_in_the_recording_is_left_out(simulation):
    seen = record(hopper(), CHIRP, delays=(0.0, 0.0151))
    kept = (seen.output.time < 5.0) | (seen.output.time > 5.6)
    output = replace(seen.output, time=seen.output.time[kept], value=seen.output.value[kept])
    found = compare(simulation, [replace(seen, output=output)])
    assert not found.pair.used.all()
    assert names(found) == ["measurement_delay"]
