"""A run of the graph that fails a test is shown at the line of the test, without the frames of the fixture."""

import pytest

from rhythmid import testing


@pytest.mark.parametrize(
    ("timeout", "said"), [(0.01, "did not end within 0.01 s and was stopped"), (60.0, "exit code 2")]
)
def test_the_fixture_hides_its_own_frames_and_chains_no_exception(tmp_path, timeout, said):
    with pytest.raises(pytest.fail.Exception, match=said) as failed:
        testing._run(["run", str(tmp_path / "absent.yaml")], {}, tmp_path, timeout)
    assert failed.value.__context__ is None and failed.value.__cause__ is None
    shown = [entry for entry in failed.traceback if not entry.ishidden(failed)]
    assert [entry.path.name for entry in shown if "testing.py" in entry.path.name] == []
