"""Frequencies of effects that the records cannot tell from those of the motion."""

import math
from dataclasses import replace

import pytest

from machines import CATALOGUE
from rhythmid.diagnose.search.round import own_frequency
from rhythmid.elements.element import Scales

SIZES = Scales(
    position=0.02, velocity=0.1, effort=4.0, centre=0.1, low=0.07, high=0.13, mass=1.0, stiffness=200.0,
    frequency=2.0, duration=10.0, period=1e-2, forcing_frequency=2.0,
)  # fmt: skip


def apart_of(name: str, values: dict[str, float], sizes: Scales = SIZES) -> float:
    """Distance of an element's frequency from the motion's, in spectral lines."""
    return own_frequency(CATALOGUE[name], values, sizes)


@pytest.mark.parametrize(
    ("frequency", "synchronous"), [(2.0, True), (4.09, True), (1.91, True), (2.11, False), (3.3, False)]
)
def test_a_disturbance_that_the_records_cannot_tell_from_the_forcing_in_frequency_keeps_step_with_it(
    frequency, synchronous
):
    values = {"amplitude": 0.1, "frequency": frequency}
    assert (apart_of("periodic_disturbance", values) < 1.0) is synchronous
    unforced = apart_of("periodic_disturbance", values, sizes=replace(SIZES, forcing_frequency=0.0))
    assert unforced == math.inf
    for damping, as_narrow_as_a_line in ((0.1, False), (0.001, True)):
        mode = apart_of("second_mode", {"mass": 0.1, "frequency": frequency, "damping_ratio": damping})
        assert (mode < 1.0) is (synchronous and as_narrow_as_a_line)


@pytest.mark.parametrize(("frequency", "same"), [(2.5, True), (2.95, True), (3.5, False), (1.5, False)])
def test_a_resonance_between_the_frequencies_of_a_free_motions_swings_is_none_of_its_own(frequency, same):
    free = replace(SIZES, forcing_frequency=0.0, idle=True, frequency=2.4, swings=(2.0, 3.0), duration=10.0)
    values = {"mass": 0.01, "frequency": frequency, "damping_ratio": 0.001}
    assert (apart_of("second_mode", values, sizes=free) < 1.0) is same


@pytest.mark.parametrize(("apart", "same"), [(0.5, True), (-0.5, True), (3.0, False)])
def test_a_disturbance_at_the_frequency_of_a_free_motion_is_another_damping_or_stiffness(apart, same):
    free = replace(SIZES, forcing_frequency=0.0, idle=True)
    values = {"amplitude": 0.1, "frequency": free.frequency + apart / free.duration}
    assert (apart_of("periodic_disturbance", values, sizes=free) < 1.0) is same
