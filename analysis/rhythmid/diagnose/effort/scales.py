"""Scales of the measured motion and of the effort, for first guesses of elements' parameters."""

from dataclasses import replace

import numpy as np

from rhythmid.elements.element import OFTEN_ENOUGH, Scales
from rhythmid.identify.drive_changes import most_repeated
from rhythmid.identify.inverse_dynamics.balance import Balance
from rhythmid.identify.inverse_dynamics.estimate import EffortFit
from rhythmid.identify.position_lines import lines_below
from rhythmid.identify.record_scales import NO_SPRING, REST_LENGTH
from rhythmid.model import Model
from rhythmid.record.back_and_forth import some_record_comes_back
from rhythmid.record.pressed import some_part_is_pressed


def scales_at(balance: Balance, fit: EffortFit) -> Scales:
    """As `scales_of`, with the spectral lines over position that a fit leaves."""
    position, velocity, _ = balance.mechanical.T
    lines = lines_below(position, velocity, fit.residual, balance.bandwidth.effort)
    return replace(scales_of(balance, fit.model), residual_wavelengths=lines)


def scales_of(balance: Balance, model: Model) -> Scales:
    """Scales in the model's units; for a leg on a moving base, of its motion relative to the base."""
    motions = balance.motions
    position = np.concatenate([motion.leg_position for motion in motions])
    effort = np.concatenate([motion.effort for motion in motions])
    spread = max(max(float(np.std(motion.leg_position)) for motion in motions), 1e-12)
    line = balance.bandwidth.dominant
    inertial = model.mass.value * (2.0 * np.pi * line) ** 2
    spring = model.borrowed("linear_spring.stiffness", 0.0) or 0.0
    size = max(float(np.std(motion.effort)) for motion in motions)
    # without a spring the effort sets the scale of force: an axis may move slowly against large friction
    stiffness = spring if spring > NO_SPRING * inertial else max(inertial, size / spread)
    return Scales(
        position=spread,
        velocity=max(max(float(np.std(motion.leg_velocity)) for motion in motions), 1e-12),
        effort=size or stiffness * spread,
        centre=float(np.mean(position)),
        low=float(position.min()),
        high=float(position.max()),
        mass=model.mass.value,
        stiffness=float(stiffness),
        frequency=line,
        duration=max(float(motion.time[-1] - motion.time[0]) for motion in motions),
        period=1.0
        / (2.0 * balance.bandwidth.effort),  # faster changes are above the bandwidth and not visible
        peak_effort=float(np.abs(effort).max()),
        rest=None if REST_LENGTH in model.free else model.borrowed(REST_LENGTH, 0.0),
        displaced_base=any(motion.driven_by_base for motion in motions),
        comes_back=some_record_comes_back((one.record, one.leg_position) for one in motions),
        changes=min(most_repeated((one.record, one.effort, False) for one in motions), OFTEN_ENOUGH),
        pressed=some_part_is_pressed((one.leg_position, one.leg_velocity, one.effort) for one in motions),
    )
