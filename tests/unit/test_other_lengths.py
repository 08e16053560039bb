"""Arrays that do not go with the time are left out, and `init` and `check` say which and why."""

import foreign
import numpy as np
import pytest
from foreign import moved, roles_of, tones
from scipy.io import savemat

from rhythmid.errors import InputError
from rhythmid.record.bag_report import quality_report
from rhythmid.record.other_lengths import length_notes
from rhythmid.record.signals import Signals
from rhythmid.record.table import Table
from rhythmid.start.start import guess

TIME = np.arange(4000) * foreign.STEP
FORCE = tones(1, TIME)
X, V = moved(FORCE, 0.05, 0.1, 6.0)
SIGNALS = "time: {column: t}\ninput: {column: f, unit: N}\noutput: {column: x, unit: m}\n"


@pytest.mark.parametrize(
    ("array", "why"),
    [
        (np.zeros(500), "has 500 values, the time 4000"),
        (np.zeros((500, 3)), "has 500 rows (500 x 3), the time 4000"),
        (np.zeros((3, 3000)), "has 3000 rows (3000 x 3), the time 4000"),
        (np.zeros((70, 4000)), "lies across (70 x 4000): transpose it"),
        (np.zeros((4000, 70)), "has 70 columns (4000 x 70); at most 64 are read"),
        (np.zeros((40, 3, 3)), "has 3 dimensions (40 x 3 x 3)"),
        (np.zeros(4000, dtype=complex), "holds complex numbers"),
    ],
)
def test_an_array_that_does_not_go_with_the_time_is_told_with_the_reason(tmp_path, array, why):
    np.savez(tmp_path / "run.npz", t=TIME, x=X, f=FORCE, speed=array)
    told = (
        f"left out, because they do not go with the time: speed: {why}; a channel may have a time: of its own"
    )
    found = guess(tmp_path / "run.npz")
    assert f"CHECK {told}" in found.lines() and "CHECK: left out, because" in found.signals
    report = quality_report(tmp_path / "run.npz", Signals.from_text(SIGNALS))
    assert f"  note: {told}" in report.lines()
    (tmp_path / "signals.yaml").write_text(f"tables: {{file: run.npz}}\n{SIGNALS}")
    assert f"  note: {told}" in quality_report(tmp_path / "signals.yaml").lines()


def test_a_few_parameters_are_no_recording(tmp_path):
    np.savez(tmp_path / "run.npz", t=TIME, x=X, f=FORCE, gains=np.ones(3), inertia=np.eye(3), mass=1.0)
    assert guess(tmp_path / "run.npz").inventory.notes == ()
    assert length_notes(Table.load(tmp_path / "run.npz"), len(TIME)) == ()


def test_many_parameters_do_not_hide_the_recording(tmp_path):
    parameters = {f"gains{number}": np.arange(3.0) for number in range(6)}
    np.savez(tmp_path / "run.npz", t=TIME, x=X, f=FORCE, **parameters)
    assert roles_of(tmp_path / "run.npz") == {"input": "f", "output": "x"}


def test_an_array_that_lies_across_is_read_a_row_a_signal_as_simulink_writes_it(tmp_path):
    savemat(tmp_path / "run.mat", {"log_theta": np.vstack([TIME, FORCE, X])})
    table = Table.load(tmp_path / "run.mat")
    np.testing.assert_array_equal(table.column("log_theta[2]"), X)
    assert str(guess(tmp_path / "run.mat").inventory.clock.column) == "log_theta[0]"


def test_a_file_of_arrays_that_are_too_wide_is_refused_with_their_shape(tmp_path):
    savemat(tmp_path / "run.mat", {"image": np.zeros((70, 80))})
    with pytest.raises(InputError, match=r"no column of numbers; image: has 80 columns \(70 x 80\)"):
        guess(tmp_path / "run.mat")
