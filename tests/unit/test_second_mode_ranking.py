"""A light, lightly damped second mode is what the score test names first."""

from dataclasses import replace

import numpy as np
import pytest

from rhythmid.diagnose.search.score_tests import changes_of, score, sizes_along, trajectories
from rhythmid.elements.candidates import candidates
from rhythmid.elements.catalogue import load_catalogue
from rhythmid.identify.output_error import estimate
from rhythmid.identify.series import prepare
from rhythmid.model import Model
from rhythmid.record.record import Channel, Record
from rhythmid.simulation.signal import zero_order_hold
from rhythmid.simulation.simulate import simulate

CATALOGUE = load_catalogue()
MACHINE = """
inertia: {mass: {value: 1.0, unit: kg, fixed: true}}
force:
  - linear_spring: {stiffness: {value: 227.4, unit: N/m}, rest_length: {value: 0.0, unit: m}}
  - viscous_damper: {damping: {value: 1.5, unit: N*s/m}}
"""
MODE = {"mass": 0.02, "frequency": 7.5, "damping_ratio": 0.01}  # beside a machine of 2.4 Hz
TIME = np.arange(8000) / 200.0
STD = 1e-4  # m of white noise


def command(kind: str) -> np.ndarray:
    """A chirp from 0.5 to 15 Hz, or held white noise; N."""
    if kind == "chirp":
        return 2.0 * np.sin(2 * np.pi * (0.5 + 0.5 * 14.5 * TIME / TIME[-1]) * TIME)
    return 2.0 * np.repeat(np.random.default_rng(3).standard_normal(len(TIME) // 4), 4)


@pytest.mark.parametrize(("kind", "line"), [("chirp", True), ("noise", False)])
def test_a_mode_of_two_per_cent_of_the_mass_and_one_per_cent_damping_scores_best(kind, line):
    nominal = Model.from_text(MACHINE, catalogue=CATALOGUE)
    machine = nominal.with_element(CATALOGUE["second_mode"], MODE)
    u = command(kind)
    y = simulate(machine, TIME, zero_order_hold(TIME, u)).output
    y = y + STD * np.random.default_rng(4).standard_normal(len(TIME))
    fit = estimate(nominal, prepare([Record(kind, Channel(TIME, y, "m"), Channel(TIME, u, "N"))]))
    known = trajectories(fit)
    sizes = sizes_along(known)
    scores = score(fit, changes_of(known, candidates(CATALOGUE, fit.model.setting, sizes).tried))
    others = [one for one in scores if one.element.name != "second_mode"]
    assert scores[0].element.name == "second_mode"
    assert scores[0].statistic > 1.3 * others[0].statistic
    assert 0.8 < scores[0].values["frequency"] / MODE["frequency"] < 1.25
    if line:  # the residual's line is the mode's, and only a light damping explains so sharp a one
        assert sizes.residual_frequency == pytest.approx(MODE["frequency"], rel=0.02)
        assert scores[0].values["damping_ratio"] == 0.01
        assert scores[0].start["mass"] == pytest.approx(MODE["mass"], rel=0.2)


def test_lightly_damped_guesses_stand_at_the_line_that_is_left(scales):
    starts = CATALOGUE["second_mode"].starts
    assert starts is not None
    light = [
        one["frequency"]
        for one in starts(replace(scales, residual_frequency=7.5))
        if one["damping_ratio"] < 0.05
    ]
    assert light and all(abs(frequency / 7.5 - 1.0) < 0.05 for frequency in light)
    assert all(one["damping_ratio"] == 0.1 for one in starts(replace(scales, residual_frequency=0.0)))
