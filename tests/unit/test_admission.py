"""Admission: which records a diagnosis can use, what is left out of them, and what is said of that."""

from dataclasses import replace

import numpy as np
import pytest

from machines import SHORT, hopper, records
from rhythmid.diagnose.admission import admitted, check_driven
from rhythmid.errors import InputError
from rhythmid.identify.comparable import check_comparable
from rhythmid.identify.series import prepare
from rhythmid.model import Model
from rhythmid.record.record import Channel, Record

FREE = Model.from_text("""
inertia: {mass: {value: 1.0, unit: kg}}
force:
  - linear_spring: {stiffness: {value: 180.0, unit: N/m}, rest_length: {value: 0.0, unit: m}}
  - viscous_damper: {damping: {value: 0.4, unit: N*s/m}}
""")
TIME = 1e-3 * np.arange(8000)


@pytest.fixture(scope="module")
def given() -> list[Record]:
    return records(hopper(), SHORT[:2])


def swing(decay: float) -> Record:
    """A free swing at 2 Hz whose size falls with this rate [1/s]."""
    return Record("swing", Channel(TIME, 0.05 * np.exp(-decay * TIME) * np.cos(4.0 * np.pi * TIME), "m"))


def test_tidy_records_are_admitted_as_they_are_without_a_word(given):
    found = admitted(given[:1], given[1:], hopper())
    assert found.notes == ()
    for before, after in zip(given, (*found.records, *found.holdout), strict=True):
        np.testing.assert_array_equal(before.output.value, after.output.value)


def test_records_and_held_out_ones_are_kept_apart(given):
    found = admitted(given[1:], given[:1], hopper())
    assert [one.name for one in found.records] == ["record 1"]
    assert [one.name for one in found.holdout] == ["record 0"]


def test_outliers_are_left_out_and_told_once_a_record(given):
    value = given[0].output.value.copy()
    value[500::900] += 0.5
    found = admitted([replace(given[0], output=replace(given[0].output, value=value))], (), hopper())
    assert found.records[0].output.value.max() < 0.4
    assert len(found.notes) == 1 and given[0].name in found.notes[0]


def test_a_free_decay_needs_no_input_and_motion_that_hardly_decays_is_remarked_on():
    assert check_driven([swing(0.4)], FREE) is None
    assert check_driven([swing(0.02)], FREE) is None  # little, but steadily
    said = check_driven([swing(0.0)], FREE)
    assert said is not None and "taken for a free motion" in said
    assert admitted([swing(0.0)], (), FREE).records[0].name == "swing"


def test_a_speed_that_coasts_down_decays():
    """A machine that turns ever more slowly changes its speed as much at the end as at the start."""
    slow = Record("coasting", Channel(TIME, 3.0 - 0.28 * TIME, "m/s"), output_kind="velocity")
    assert check_driven([slow], FREE) is None
    steady = replace(slow, output=Channel(TIME, 3.0 + 0.1 * np.sin(9.0 * TIME), "m/s"))
    assert check_driven([steady], FREE) is not None


def test_records_of_which_only_the_forcing_is_known_are_used_with_a_remark(given):
    alone = [replace(one, input=None) for one in given]
    said = check_driven(alone, hopper())
    assert said is not None and "counts as missing physics" in said
    assert check_driven(given, hopper()) is None


@pytest.mark.parametrize("factor", [1000.0, 0.001])
def test_records_in_units_a_thousand_apart_are_refused_by_name(given, factor):
    other = replace(given[1], output=replace(given[1].output, value=factor * given[1].output.value))
    with pytest.raises(InputError, match="record 0 and record 1 do not look like one machine in one unit"):
        check_comparable(prepare([given[0], other]))
    check_comparable(prepare(given))


def test_records_of_one_sine_each_are_of_one_machine_however_small_the_fastest_motion_is(given):
    """A mass without a spring moves by a four-hundredth when it is driven at twenty times the frequency."""
    slow, fast = (
        replace(one, output=replace(one.output, value=size * (1.0 + np.sin(pulse * one.output.time))))
        for one, size, pulse in ((given[0], 1.0, 6.0), (given[1], 1.0 / 400.0, 120.0))
    )
    check_comparable(prepare([slow, fast]))


@pytest.mark.parametrize("zero", [-80.0, 327.0])
def test_records_whose_encoders_have_zeros_far_apart_are_of_one_machine(given, zero):
    other = replace(given[1], output=replace(given[1].output, value=given[1].output.value + zero))
    check_comparable(prepare([given[0], other]))


def test_an_output_that_never_changes_is_refused(given):
    still = replace(
        given[0], output=replace(given[0].output, value=np.full(len(given[0].output.value), 0.15))
    )
    with pytest.raises(InputError, match="the output never changes"):
        check_comparable(prepare([still]))


def test_an_effort_that_a_holding_controller_makes_of_the_output_is_told():
    place = 1e-6 * np.cumsum(np.random.default_rng(5).standard_normal(len(TIME)))
    held = Record("held", Channel(TIME, place, "m"), Channel(TIME, 3.0 - 9000.0 * place, "N"))
    (note,) = [one for one in admitted([held], [], FREE).notes if "copy" in one]
    assert note.startswith("held: input: it is a copy of the output (correlation -1.00000 at once)")
