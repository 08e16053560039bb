"""Cleaning: what does not say where the machine was is left out of every analysis, and told; everything else is kept."""

from dataclasses import replace

import numpy as np
import pytest

from machines import CATALOGUE, SHORT, hopper, records
from rhythmid.compare.compare import compare
from rhythmid.diagnose.admission import admitted
from rhythmid.errors import InputError
from rhythmid.identify.identify import identify
from rhythmid.model import Model
from rhythmid.offline_run import simulate
from rhythmid.record.cleaning import cleaned
from rhythmid.record.record import Record

IMPACT = ("end_stop_contact", {"stiffness": 20000.0, "position": 0.14, "side": -1.0})
STICTION = ("coulomb_friction", {"force": 0.2, "transition": 1e-4})
PLAY = ("backlash", {"width": 0.4})
DAMPING = 2.0
OSCILLATOR = Model.from_text(f"""
inertia: {{mass: {{value: 1.0, unit: kg, fixed: true}}}}
force:
  - linear_spring: {{stiffness: {{value: 200.0, unit: N/m}}, rest_length: {{value: 0.0, unit: m, fixed: true}}}}
  - viscous_damper: {{damping: {{value: {DAMPING}, unit: N*s/m}}}}
""")
RUN = {
    "excitation": {
        "type": "multisine",
        "rms": 3.0,
        "period": 8.0,
        "periods": 2,
        "band": [0.3, 6.0],
        "seed": 4,
    },
    "forcing": {"amplitude": 0.0},
    "noise": {"measurement_std": 2e-5},
}
TOLD = "samples of the output that are clipped at"


@pytest.fixture(scope="module")
def given() -> list[Record]:
    return records(hopper(), SHORT[:2])


@pytest.fixture(scope="module")
def whole() -> Record:
    """A record of the oscillator whose sensor reaches far enough."""
    return simulate(OSCILLATOR, RUN).record


def limited(record: Record, share: float) -> Record:
    """The record of a sensor that goes no further than this quantile."""
    value = record.output.value
    return replace(record, output=replace(record.output, value=np.minimum(value, np.quantile(value, share))))


def cut_off(record: Record, share: float = 0.8) -> Record:
    """The record of a sensor whose range is this share of the motion's, on either side."""
    value = record.output.value
    limit = share * float(np.abs(value).max())
    return replace(record, output=replace(record.output, value=np.clip(value, -limit, limit)))


@pytest.mark.parametrize("std", [0.0, 1e-6, 1e-4])
@pytest.mark.parametrize(("name", "values"), [IMPACT, STICTION, PLAY])
def test_impacts_stiction_and_play_leave_no_sample_out(name, values, std):
    for one in records(hopper().with_element(CATALOGUE[name], values), SHORT, std=std):
        found = cleaned(one)
        assert found.record is one and found.notes == ()


def test_what_is_left_out_is_said_and_peaks_of_an_acceleration_are_kept(given):
    value = given[0].output.value.copy()
    value[[500, 900]] += 0.5
    broken = replace(given[0], output=replace(given[0].output, value=value))
    found = cleaned(broken)
    assert len(found.record.output) == len(broken.output) - 2
    (note,) = found.notes
    assert note == (
        f"{broken.name}: samples of the output that stand far off their neighbours are left out, 2 of "
        f"{len(broken.output)}, the first at t = 0.5151 s"
    )
    assert cleaned(replace(broken, output_kind="acceleration")).left_out == ()


def test_clipped_samples_and_their_neighbours_are_left_out_and_counted(given):
    clipped = limited(given[1], 0.97)
    found = cleaned(clipped)
    (left_out,) = found.left_out
    at_limit = clipped.output.value == clipped.output.value.max()
    assert (found.record.output.value == clipped.output.value.max()).sum() < 20  # shorter runs are peaks
    assert left_out.reason == "clipped" and left_out.total == len(clipped.output)
    assert left_out.count == len(clipped.output) - len(found.record.output)
    assert 200 < left_out.count <= 3 * at_limit.sum()


def test_an_outlier_beyond_the_sensors_limit_does_not_hide_it(whole):
    clipped = cut_off(whole)
    value = clipped.output.value.copy()
    value[np.argmin(np.abs(value))] = 5.0 * value.max()
    found = cleaned(replace(clipped, output=replace(clipped.output, value=value)))
    assert [one.reason for one in found.left_out] == ["outlier", "clipped"]


def test_a_sensor_that_is_clipped_most_of_the_time_is_refused(given):
    refused = limited(given[0], 0.3)
    with pytest.raises(InputError, match=r"% of the output is clipped at .* wider range"):
        cleaned(refused)
    with pytest.raises(InputError, match="wider range"):
        identify(refused, hopper())


def test_with_a_clipped_sensor_the_damping_is_the_true_one_and_a_note_tells(whole):
    guess = OSCILLATOR.with_values(
        {"viscous_damper.damping": 1.3 * DAMPING, "linear_spring.stiffness": 190.0}
    )
    found = identify(cut_off(whole), guess)
    damping = found.parameters["viscous_damper.damping"]
    assert abs(damping.value - DAMPING) < 3.0 * damping.std < 0.05 * DAMPING
    assert sum(TOLD in note for note in found.notes) == 1


def test_diagnose_and_compare_leave_out_what_identify_does(whole):
    clipped = cut_off(whole)
    (note,) = cleaned(clipped).notes
    assert TOLD in note
    assert note in identify(clipped, OSCILLATOR).notes
    assert note in admitted([clipped], [], OSCILLATOR).notes
    assert note in compare(whole, clipped).notes
