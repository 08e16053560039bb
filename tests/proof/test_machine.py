"""The concealed machine against closed forms and against an integrator of another make."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from rhythmid.proof.equations import EQUATIONS
from rhythmid.proof.machine import (
    TIMING,
    Effect,
    Forcing,
    Machine,
    _memory,
    constants,
    held_command,
    observe,
    stamp,
)
from rhythmid.proof.protocol import draw_runs
from rhythmid.proof.sizes import SIZES, motion_of

MACHINE = Machine(1.0, 200.0, 2.0, 0.2, 9.81)
LINEAR = Machine(1.0, 200.0, 0.0, 0.2, 9.81)
FORCING = Forcing(1.0, 1.0, 0.3)
QUIET = Forcing(0.0, 1.0, 0.0)
TIME = np.arange(3000) / 1000.0
BEFORE = 0.1  # [s] instead of the usual warm-up
NEED_MORE_MOTION = ("ground_contact_loss", "freeplay", "end_stop_contact", "travel_stop")


def _motion():
    rng = np.random.default_rng(1)
    runs, _ = draw_runs(rng, 1.0, math.sqrt(200.0) / (2 * math.pi), 1.0)
    return motion_of(
        MACHINE, FORCING, runs, [observe(MACHINE, [], FORCING, run.time, run.command) for run in runs]
    )


@pytest.fixture(scope="module")
def motion():
    return _motion()


def _by_scipy(effect: Effect, command: np.ndarray, samples: int) -> np.ndarray:
    """The same equations, called as plain Python and integrated from one jump of the command to the next by scipy."""
    one = EQUATIONS[effect.name]
    p = np.array([effect.parameters[name] for name in one.parameters])
    m = constants(MACHINE, FORCING)
    rest = 0.2 - 9.81 / 200.0
    held = _memory(MACHINE, [effect], rest, -BEFORE)

    def walk(t, z, u, accepted=False):
        x, v, s, ds = z[0], z[1], z[2:], np.zeros(len(z) - 2)

        def at(place, value, f=0.0):
            return (
                one.function(value, t, x, v, f, m, p, s, ds, held, accepted) if one.place == place else value
            )

        f = at("actuator", at("command", u) + math.cos(2 * math.pi * t + 0.3))
        leg = -200.0 * (x - 0.2) - (2.0 * v if v > 0 else 0.0)
        leg = at("contact", at("leg", leg, f), f)
        total = at("body", f + leg - 9.81, f)
        measured = at("sensor", x)
        return np.array([v, total, *ds]), measured

    z = np.array([rest, 0.0, *(share * rest for share in one.states)])
    out = []
    grid = np.arange(-round(BEFORE * 1000), samples + 1) / 1000
    edges = np.insert(grid, 1, grid[0] + 1e-4)  # the first step of the other integrator
    for begin, end in zip(edges, edges[1:]):
        u = command[round(begin * 1000)] if begin >= 0.0 else 0.0
        if begin >= 0.0:
            out.append(walk(begin, z, u)[1])
        walk(begin, z, u, True)  # what remembers sees the command jump
        solved = solve_ivp(lambda t, z: walk(t, z, u)[0], (begin, end), z, rtol=1e-8, atol=1e-11)  # noqa: B023
        z = solved.y[:, -1]
        walk(end, z, u, True)
    return np.array(out)


@pytest.mark.parametrize("name", sorted(set(SIZES) - set(TIMING)))
def test_every_concealed_effect_agrees_with_scipy_on_the_same_equations(name, motion, monkeypatch):
    monkeypatch.setattr("rhythmid.proof.machine.WARM_UP", BEFORE)
    parameters = SIZES[name](np.random.default_rng(3), motion)(0.6)
    parameters |= {"stiffness_jump": {"time": 0.1}, "reference_rate_limit": {"rate": 20.0}}.get(name, {})
    effect = Effect(name, parameters)
    command = motion.effort * np.sin(2 * np.pi * 4.0 * TIME)
    expected = _by_scipy(effect, command, 300)
    found = observe(MACHINE, [effect], FORCING, TIME, command)
    plain = observe(MACHINE, [], FORCING, TIME, command)
    assert found is not None and plain is not None
    assert np.abs(found.measured[:300] - expected).max() < 1e-6
    if name not in NEED_MORE_MOTION:
        assert np.abs(found.measured - plain.measured)[:300].max() > 1e-5


def test_a_free_mass_on_a_spring_rests_where_statics_put_it():
    seen = observe(MACHINE, [], QUIET, TIME, np.zeros(len(TIME)))
    assert seen is not None
    np.testing.assert_allclose(seen.measured, 0.2 - 9.81 / 200.0, atol=1e-12)


def test_a_held_command_gives_the_closed_form_step_response():
    late = 0.0123
    seen = observe(LINEAR, [], QUIET, TIME, np.ones(len(TIME)), input_delay=late)
    assert seen is not None
    omega = math.sqrt(200.0)
    expected = np.where(TIME > late, (1.0 - np.cos(omega * (TIME - late))) / 200.0, 0.0)
    np.testing.assert_allclose(seen.measured - seen.measured[0], expected, atol=1e-8)


def test_dry_friction_takes_four_sticking_widths_a_period_from_a_free_swing():
    force = 0.1
    seen = observe(LINEAR, [Effect("coulomb_friction", {"force": force})], QUIET, TIME, 5.0 * (TIME < 0.3))
    assert seen is not None
    swing = seen.measured[400:] - (0.2 - 9.81 / 200.0)
    tops = [swing[k] for k in range(1, len(swing) - 1) if swing[k - 1] < swing[k] >= swing[k + 1]]
    np.testing.assert_allclose(-np.diff(tops), 4.0 * force / 200.0, rtol=0.02)


def test_a_mass_sticks_where_friction_exceeds_every_force():
    seen = observe(MACHINE, [Effect("coulomb_friction", {"force": 3.0})], FORCING, TIME, np.zeros(len(TIME)))
    assert seen is not None
    assert np.ptp(seen.position) < 1e-3


def test_play_follows_only_beyond_its_gap_and_keeps_what_it_reached():
    held = np.zeros(1)
    play = EQUATIONS["backlash"].function
    path = [0.0, 1.0, 2.0, 1.5, 1.0, 0.5, 0.0, 0.8]
    out = [play(f, 0, 0, 0, 0, None, [1.0], None, None, held, True) for f in path]
    assert out == [0.0, 0.5, 1.5, 1.5, 1.5, 1.0, 0.5, 0.5]


def test_a_rate_limit_ramps_to_a_step_at_its_rate():
    slow = EQUATIONS["actuator_rate_limit"].function
    held = np.zeros(2)
    out = [slow(1.0, t, 0, 0, 0, None, [2.0], None, None, held, True) for t in (0.1, 0.2, 0.4, 0.5, 0.6)]
    np.testing.assert_allclose(out, [0.2, 0.4, 0.8, 1.0, 1.0])


def test_a_drive_that_looks_every_ten_milliseconds_takes_the_newest_command_that_has_arrived():
    arrival = np.arange(50) / 1000 + 0.0035
    ticks, value = held_command(arrival, np.arange(50.0), 0.010)
    np.testing.assert_allclose(ticks[:3], [0.010, 0.020, 0.030])
    np.testing.assert_allclose(value[:3], [6.0, 16.0, 26.0])


def test_stamps_follow_the_definitions_of_skew_and_drift():
    taken, delay = np.array([0.0, 10.0]), 0.05
    skewed = stamp(taken, delay, [Effect("clock_skew", {"skew": 1e-3})])
    np.testing.assert_allclose(skewed / 1.001 - delay, taken, atol=1e-12)
    drifted = stamp(taken, delay, [Effect("delay_drift", {"rate": 1e-3})])
    np.testing.assert_allclose(drifted - 1e-3 * drifted - delay, taken, atol=1e-12)


def test_a_machine_that_runs_away_is_reported_and_not_recorded():
    unstable = Effect("cubic_stiffness", {"coefficient": -1e7})
    assert observe(MACHINE, [unstable], Forcing(100.0, 2.0, 0.0), TIME, np.zeros(len(TIME))) is None
