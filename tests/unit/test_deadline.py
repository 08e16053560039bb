"""A deadline: whoever is called while it is open knows when time is up, in forked processes too, and nobody afterwards."""

import math
import time

import pytest

from machines import CATALOGUE, SHORT, hopper, records
from rhythmid.deadline import SPENT, deadline, time_is_up, without_deadline
from rhythmid.diagnose.case import Untried
from rhythmid.diagnose.search.refit import run_trials
from rhythmid.diagnose.search.trial import Origin, propose
from rhythmid.identify import descent
from rhythmid.identify.descent import WHITE, descend, first_guess
from rhythmid.identify.free_run import prepare_run
from rhythmid.identify.output_error import start_only
from rhythmid.identify.series import prepare
from rhythmid.parallel import fork_map

PAST = -math.inf


def test_time_is_up_once_a_deadline_has_passed_and_while_it_is_open():
    assert not time_is_up()
    with deadline(time.monotonic() + 1e6):
        assert not time_is_up()
    with deadline(PAST):
        assert time_is_up()
    assert not time_is_up()


def test_of_several_deadlines_the_earliest_holds():
    with deadline(PAST), deadline(math.inf):
        assert time_is_up()
    with deadline(math.inf):
        with deadline(PAST):
            assert time_is_up()
        assert not time_is_up()


def test_what_has_to_be_done_has_no_deadline():
    with deadline(PAST):
        with without_deadline():
            assert not time_is_up()
        assert time_is_up()


def test_a_deadline_holds_in_forked_processes():
    with deadline(PAST):
        assert dict(fork_map(lambda _: time_is_up(), range(4), workers=2)) == dict.fromkeys(range(4), True)


def far_off():
    """A hopper with a wrong spring, its run over a record, and where that begins."""
    model = hopper().with_values({"linear_spring.stiffness": 260.0})
    run = prepare_run(model, prepare(records(hopper(), SHORT[:1])))
    return model, run, first_guess(model, run)


@pytest.mark.parametrize("iterations", [0, 1, 2])
def test_a_descent_ends_after_the_iteration_in_which_time_is_up_with_what_it_has(monkeypatch, iterations):
    model, run, starts = far_off()
    expected = descend(model, run, tuple(model.free), WHITE, starts, iterations)
    asked = iter(range(100))
    monkeypatch.setattr(descent, "time_is_up", lambda: next(asked) >= iterations)
    end = descend(model, run, tuple(model.free), WHITE, starts)
    assert end.chi2 == expected.chi2 and not end.converged
    assert end.message == SPENT


def test_proposals_that_no_time_is_left_for_are_told():
    model, run, starts = far_off()
    proposal = propose(model, CATALOGUE["coulomb_friction"], [{"force": 0.1, "transition": 0.01}], ())
    origin = Origin(tuple(starts), run.compiled.layout.states)
    with deadline(PAST):
        trials, excluded = run_trials([proposal], run.series, origin, WHITE, run.max_step)
    assert trials == [] and excluded == [Untried("coulomb_friction", SPENT)]


def test_initial_states_of_unseen_records_are_fitted_whatever_the_time():
    series = prepare(records(hopper(), SHORT[:1]))
    plain = start_only(hopper(), series, WHITE, 1e-3)
    with deadline(PAST):
        assert start_only(hopper(), series, WHITE, 1e-3).chi2 == plain.chi2
