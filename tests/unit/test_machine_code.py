"""Generated modules are loaded once, whole, whoever asks for them first."""

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from rhythmid.simulation.machine_code import Module, load_run


def test_threads_that_ask_for_a_module_at_once_get_the_same_whole_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setenv("RHYTHMID_CACHE", str(tmp_path))
    slow = Module(
        f"import time\ntime.sleep(0.3)\nhere = {str(tmp_path)!r}\n\n\ndef run():\n    return here\n"
    )
    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(lambda _: load_run.__wrapped__(slow), range(4)))
    assert all(run is found[0] for run in found) and found[0]() == str(tmp_path)


def test_a_module_that_fails_is_not_left_half_loaded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("RHYTHMID_CACHE", str(tmp_path))
    failing = Module(f"here = {str(tmp_path)!r}\nraise ValueError(here)\n")
    for _ in range(2):
        with pytest.raises(ValueError, match=str(tmp_path)):
            load_run(failing)
