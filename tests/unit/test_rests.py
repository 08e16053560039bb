"""The share of samples that is left out for rests is told where it is of practical size."""

from functools import lru_cache

import numpy as np
import pytest
from axes import axis, axis_model

from rhythmid.commands.model_line import model_lines
from rhythmid.identify.inverse_dynamics.applicability import applicable
from rhythmid.identify.inverse_dynamics.balance import Balance
from rhythmid.identify.inverse_dynamics.rests import told
from rhythmid.record.record import Channel, Record

RATE, LONG, FRICTION, NOISE = 250.0, 30.0, 0.8, 0.01  # [Hz], [s], [N], of the effort


@lru_cache
def stepped(dwell: float, jitter: float = 1e-5) -> Record:
    """An axis of 1 kg with 2 N s/m and Coulomb friction that moves by polynomials of least jerk and rests for about `dwell` [s] after
    each; what it balances meanwhile wanders within the friction. Positions have a noise of `jitter` [m]."""
    rng = np.random.default_rng(0)
    time = np.arange(round(LONG * RATE)) / RATE
    position, velocity, acceleration = np.zeros((3, len(time)))
    begins = dwell
    while begins < LONG:
        lasts, far = rng.uniform(0.35, 0.75), rng.uniform(0.05, 0.2) * rng.choice([-1.0, 1.0])
        s = np.clip((time - begins) / lasts, 0.0, 1.0)
        position += far * (10.0 * s**3 - 15.0 * s**4 + 6.0 * s**5)
        velocity += far / lasts * 30.0 * (s * (1.0 - s)) ** 2
        acceleration += far / lasts**2 * 60.0 * s * (1.0 - s) * (1.0 - 2.0 * s)
        begins += lasts + dwell * rng.uniform(0.6, 1.6)
    wanders = np.sin(4.0 * np.pi * np.cumsum(rng.uniform(0.05, 0.4, len(time))) / RATE)
    slides = acceleration + 2.0 * velocity + FRICTION * np.sign(velocity)
    effort = np.where(velocity == 0.0, FRICTION * wanders, slides)
    effort = effort + NOISE * effort.std() * rng.standard_normal(len(time))
    position = position + jitter * rng.standard_normal(len(time))
    return Record("steps", Channel(time, position, "m"), Channel(time, effort, "N"), hold="linear")


@pytest.mark.parametrize(("share", "said"), [(0.05, False), (0.83, True)])
def test_a_share_is_told_from_a_tenth_on(share, said):
    assert (told(share) is not None) is said


@pytest.mark.parametrize(
    ("record", "said"), [(stepped(1.5), True), (axis(length=10.0), False)], ids=["rests", "moves"]
)
def test_the_answer_and_check_tell_the_share_where_there_are_rests(tmp_path, record, said):
    model = axis_model()
    model.save(tmp_path / "model.yaml")
    share = Balance.of([record], model).stuck
    assert (share > 0.1) is said
    sentence = f"{share:.0%} of the samples are in or beside rests"
    assert (sentence in applicable([record], model).reason) is said
    assert (sentence in "\n".join(model_lines(tmp_path / "model.yaml", [record]))) is said
