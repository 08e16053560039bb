"""Records in which the machine stands still: refused where there are no others, else left out with a note."""

from dataclasses import replace

import numpy as np
import pytest

from machines import SHORT, hopper, records
from rhythmid.diagnose.admission import admitted
from rhythmid.errors import InputError
from rhythmid.identify.identify import identify
from rhythmid.record.record import Record

STEP = 1e-7  # of the sensor, as an encoder's beside a motion of nothing


@pytest.fixture(scope="module")
def moved() -> Record:
    return records(hopper(), SHORT[:1])[0]


def at_rest(record: Record) -> Record:
    """The record with an output that is noise of a step of its sensor."""
    noise = STEP * np.round(np.random.default_rng(1).normal(size=len(record.output.time)))
    return replace(record, name="rest", output=replace(record.output, value=noise))


def test_a_machine_that_stands_still_is_neither_identified_nor_diagnosed(moved: Record):
    for asked in (lambda one: identify(one, hopper()), lambda one: admitted([one], [], hopper())):
        with pytest.raises(
            InputError, match="rest: the machine stands still: .*; record it while it moves"
        ) as told:
            asked(at_rest(moved))
        assert "\n" not in str(told.value)


def test_of_several_records_those_at_rest_are_left_out_with_a_note(moved: Record):
    given = admitted([at_rest(moved), moved], [moved], hopper())
    assert {one.name for one in given.records} == {moved.name} and given.holdout
    (said,) = [note for note in given.notes if "stands still" in note]
    assert said.startswith("rest: ") and said.endswith("it is left out")


def test_records_for_judging_that_are_all_at_rest_are_refused(moved: Record):
    with pytest.raises(InputError, match="rest: the machine stands still"):
        admitted([moved], [at_rest(moved)], hopper())
