"""Supervision: a node that is silent, or that passes nothing on while it is sent more, has stopped working."""

import pytest

from rhythmid_bringup.liveness import SILENT_AFTER, Liveness, Relay

RELAYS = {"command_delay": Relay("excitation", "sent", delay=2.0)}


def watch(liveness, until, heard=lambda now: {}, figures=lambda now: {}, since=0.0, step=0.1):
    """What was found wrong from `since` to `until`, and when first."""
    now = since
    while now <= until:
        found = liveness.silent(now, heard(now)), liveness.stalled(figures(now))
        if any(found):
            return now, *found
        now += step
    return None


def test_a_node_that_tells_nothing_any_more_is_silent():
    found = watch(Liveness({}), 30.0, heard=lambda now: {"plant": int(min(now, 10.0)), "recorder": int(now)})
    assert found is not None
    at, silent, _ = found
    assert silent == ["plant"] and at == pytest.approx(10.0 + SILENT_AFTER, abs=0.3)


def test_nodes_that_tell_once_a_second_are_not_silent():
    assert watch(Liveness({}), 60.0, heard=lambda now: {"plant": int(now)}) is None


def test_a_supervisor_that_was_stopped_itself_blames_nobody():
    liveness = Liveness({})
    assert watch(liveness, 2.0, heard=lambda now: {"plant": int(now)}) is None
    assert watch(liveness, 1003.0, heard=lambda now: {"plant": int(now)}, since=1000.0) is None


@pytest.mark.parametrize(
    ("relayed", "stalls"),
    [
        (lambda sent: sent, False),
        (lambda sent: sent // 2, False),  # loses half, and works
        (lambda sent: min(sent, 2000), True),
        (lambda sent: 0, True),
    ],
)
def test_a_relay_that_passes_nothing_on_while_it_is_sent_more_has_stalled(relayed, stalls):
    def figures(now):
        sent = int(1000 * now)
        return {"excitation": {"sent": str(sent)}, "command_delay": {"relayed": str(relayed(sent))}}

    found = watch(Liveness(RELAYS), 30.0, figures=figures)
    assert (found is not None) == stalls
    if found is not None:
        assert found[2].startswith("command_delay has passed nothing on for 7 s")


def test_a_relay_that_is_sent_nothing_has_not_stalled():
    same = {"excitation": {"sent": "5000"}, "command_delay": {"relayed": "4990"}}
    assert watch(Liveness(RELAYS), 60.0, figures=lambda now: same) is None


def test_figures_that_were_not_told_yet_are_waited_for():
    assert watch(Liveness(RELAYS), 20.0, figures=lambda now: {"excitation": {"sent": str(now)[:1]}}) is None
