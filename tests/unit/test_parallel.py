"""Work handed to forked processes comes back whole, also from processes that are killed."""

import os
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from patience import PATIENCE

from rhythmid.errors import InputError
from rhythmid.freed_memory import give_back
from rhythmid.parallel import AHEAD, cores, each, fork_map


def test_forked_workers_return_every_result_once_and_pass_on_refusals():
    def work(n: int) -> int:
        if n == 3:
            raise InputError("three is refused")
        return n * n

    found = dict(fork_map(work, list(range(6)), 2))
    assert {k: v for k, v in found.items() if k != 3} == {0: 0, 1: 1, 2: 4, 4: 16, 5: 25}
    assert str(found[3]) == "three is refused"


def test_a_worker_s_failure_is_raised_with_its_traceback():
    def work(n: int) -> int:
        return 1 // n

    with pytest.raises(RuntimeError, match="ZeroDivisionError"):
        list(fork_map(work, [0, 1], 2))


def test_the_rest_of_a_worker_that_was_killed_goes_to_another(tmp_path: Path):
    def work(n: int) -> int:
        if n == 2 and not (tmp_path / "killed").exists():
            (tmp_path / "killed").touch()
            os.kill(os.getpid(), signal.SIGKILL)
        return n * n

    assert dict(fork_map(work, list(range(7)), 2)) == {n: n * n for n in range(7)}


def test_work_that_kills_every_worker_is_raised():
    def work(n: int) -> int:
        if n == 1:
            os.kill(os.getpid(), signal.SIGKILL)
        return n

    with pytest.raises(RuntimeError, match="two workers died at the same work, exit code -9"):
        list(fork_map(work, [0, 1, 2], 2))


ORPHANS = """
import os, sys, time
from pathlib import Path
from rhythmid.parallel import {way}

def work(n):
    Path(sys.argv[1], str(os.getpid())).touch()
    return bytes(10_000_000)

for _ in {way}(work, list(range(8)), 2):
    time.sleep(1000.0)
"""


@pytest.mark.parametrize("way", ["fork_map", "fork_each"])
def test_workers_end_after_their_parent_was_killed(tmp_path: Path, way: str):
    parent = subprocess.Popen([sys.executable, "-c", ORPHANS.format(way=way), tmp_path])
    until = time.monotonic() + PATIENCE
    while len(workers := [int(one.name) for one in tmp_path.iterdir()]) < 2 and time.monotonic() < until:
        time.sleep(0.05)
    parent.kill()
    parent.wait()
    assert len(workers) == 2
    while any(_runs(pid) for pid in workers) and time.monotonic() < until:
        time.sleep(0.05)
    assert not any(_runs(pid) for pid in workers)


def _runs(pid: int) -> bool:
    """Whether a process runs; one that has ended may wait for whoever adopted it."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


def test_a_worker_does_its_own_parts_one_after_another():
    def within(start: int) -> list:
        return [result for _, result in fork_map(lambda n: start + n, [1, 2])]

    assert dict(fork_map(within, [10, 20], 2)) == {0: [11, 12], 1: [21, 22]}


def test_an_interruption_amid_a_fork_is_not_lost():
    code = """
import os, signal
from rhythmid.parallel import fork_map
os.register_at_fork(after_in_parent=lambda: signal.raise_signal(signal.SIGINT))
try:
    list(fork_map(abs, [1, 2], 2))
except KeyboardInterrupt:
    print("interrupted")
"""
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=600.0, check=True
    )
    assert (done.stdout, done.stderr) == ("interrupted\n", "")


def test_results_of_threads_keep_their_order_and_neither_they_nor_their_items_gather():
    taken, begun = 0, []

    def items():
        for n in range(200):
            begun.append(n - taken)
            yield n

    with ThreadPoolExecutor(2) as pool:
        for n, square in enumerate(each(lambda n: n * n, items(), pool)):
            assert square == n * n
            taken += 1
    assert taken == 200
    assert max(begun) <= AHEAD * cores() + 1


def test_free_memory_is_given_back_and_what_is_in_use_stays_as_it_is():
    kept = [bytes([n % 251]) * 1000 for n in range(1000)]
    give_back()
    assert kept == [bytes([n % 251]) * 1000 for n in range(1000)]
