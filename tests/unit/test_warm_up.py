"""Compiling ahead: through the code that users call, and without harm where it is not possible."""

import os
import subprocess
import sys

from rhythmid.warm_up import short_record


def test_the_record_of_the_warm_up_is_one_that_can_be_identified():
    record = short_record()
    assert record.duration > 10.0 and sorted(record.channels) == ["forcing", "input", "output"]


def test_where_nothing_can_be_kept_it_says_so_and_ends(tmp_path):
    (tmp_path / "file").touch()
    done = subprocess.run(
        [sys.executable, "-m", "rhythmid.warm_up"], capture_output=True, text=True, check=False, timeout=600,
        env={**os.environ, "RHYTHMID_CACHE": str(tmp_path / "file" / "cache")},
    )  # fmt: skip
    assert done.returncode == 1
    assert done.stderr.startswith("not done: ") and done.stderr.count("\n") == 1
