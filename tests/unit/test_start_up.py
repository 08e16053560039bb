"""Who stops a run before it begins is told that nothing was recorded, whatever the interruption becomes on its way."""

import os
import signal

import pytest
import typer

from rhythmid_bringup.start_up import STOPPED, start_up


def interrupt(number, becomes=None, begun=False):
    """A start-up that a signal interrupts."""
    with start_up() as state:
        state.begun = begun
        try:
            os.kill(os.getpid(), number)
        except KeyboardInterrupt:
            if becomes is None:
                raise
            raise becomes from None


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("becomes", [None, ImportError("a library was not initialised")])
def test_a_signal_ends_it_with_one_line_and_exit_code_0(number, becomes, capsys):
    with pytest.raises(typer.Exit) as end:
        interrupt(number, becomes)
    assert end.value.exit_code == 0
    assert capsys.readouterr().err.splitlines() == [STOPPED]


def test_a_run_that_has_begun_is_not_said_to_have_recorded_nothing(capsys):
    with pytest.raises(KeyboardInterrupt):
        interrupt(signal.SIGINT, begun=True)
    assert capsys.readouterr().err == ""


def test_an_error_without_a_signal_passes_and_the_signals_are_given_back():
    before = signal.getsignal(signal.SIGTERM)
    with pytest.raises(ValueError, match="mine"), start_up():
        raise ValueError("mine")
    assert signal.getsignal(signal.SIGTERM) is before
