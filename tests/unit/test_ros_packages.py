"""Where ROS 2 or rhythmid's nodes are not installed, one line says so, and what to install."""

import subprocess
import sys

import pytest

NO_NODES = "import rhythmid.cli as cli\ncli.entry_points = lambda group: ()\ncli.main()\n"
NO_LIVE = "import rhythmid.commands.watch as watch, rhythmid.cli as cli\nwatch.entry_points = lambda group: ()\ncli.main()\n"
NO_ROS = "import sys\nsys.modules['rclpy'] = None\nimport rhythmid.cli as cli\ncli.main()\n"


@pytest.mark.parametrize(
    ("installed", "arguments", "missing"),
    [
        (NO_NODES, ("run", "experiment.yaml", "--out", "bag"), "rhythmid_bringup"),
        (NO_NODES, ("run",), "rhythmid_bringup"),
        (NO_ROS, ("run", "experiment.yaml"), "rclpy"),
        (NO_LIVE, ("watch", "model.yaml"), "rhythmid_bringup"),
        (NO_ROS, ("watch", "model.yaml"), "rclpy"),
    ],
)
def test_it_is_refused_with_code_2_in_one_line_that_says_what_to_install(
    installed, arguments, missing, tmp_path
):
    done = subprocess.run(
        [sys.executable, "-c", installed, *arguments],
        capture_output=True, text=True, timeout=600.0, check=False, cwd=tmp_path,
    )  # fmt: skip
    assert done.returncode == 2 and done.stderr.count("\n") == 1, done.stderr
    assert f"{missing} is not installed" in done.stderr
    assert "make install" in done.stderr and "pip install" in done.stderr
    assert not list(tmp_path.iterdir())
