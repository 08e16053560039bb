"""Encoder counts that begin again after each turn, and commands of the same range that do not."""

import numpy as np
import pytest

from rhythmid.record.encoder_turn import counts_of_turn

TIME = np.arange(400) * 0.02


@pytest.mark.parametrize("bits", [10, 12, 16])
def test_counts_that_begin_again_tell_the_counts_of_a_turn(bits):
    turn = 2.0**bits
    assert counts_of_turn(np.floor(turn * ((0.3 + 2.4 * np.sin(TIME)) % 1.0))) == turn


def test_a_command_of_16_bits_that_is_switched_on_is_no_encoder():
    """A drone's motor: from nothing to three quarters of the full command, then up and down by up to a third of it."""
    rng = np.random.default_rng(3)
    command = np.clip(40000.0 + 5000.0 * rng.standard_normal(400), 0.0, 65535.0)
    command[:40] = 0.0
    command[40:44] = [47000.0, 34000.0, 40000.0, 60000.0]
    command[44] = 30000.0
    assert counts_of_turn(np.rint(command)) == 0.0
