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


def test_a_module_that_another_process_has_written_meanwhile_is_not_replaced(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setenv("RHYTHMID_CACHE", str(tmp_path))
    module = Module(f"here = {str(tmp_path)!r}\n\n\ndef run():\n    return here\n")
    theirs = tmp_path / f"{module.name}.py"
    theirs.write_text(module.text)
    before = theirs.stat()
    exists = Path.exists
    monkeypatch.setattr(Path, "exists", lambda path: path != theirs and exists(path))
    assert load_run.__wrapped__(module)() == str(tmp_path)
    after = theirs.stat()
    assert (before.st_ino, before.st_mtime_ns) == (after.st_ino, after.st_mtime_ns)
    assert [path.name for path in tmp_path.glob("*kernel*") if path.is_file()] == [theirs.name]


def test_a_module_that_fails_is_not_left_half_loaded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("RHYTHMID_CACHE", str(tmp_path))
    failing = Module(f"here = {str(tmp_path)!r}\nraise ValueError(here)\n")
    for _ in range(2):
        with pytest.raises(ValueError, match=str(tmp_path)):
            load_run(failing)
