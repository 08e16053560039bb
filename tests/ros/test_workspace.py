"""The workspace builds with colcon as any ROS 2 workspace does, and its executables run from the install space."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from patience import LONG

ROOT = Path(__file__).parents[2]
pytestmark = [
    pytest.mark.timeout(LONG),
    pytest.mark.skipif(
        not (shutil.which("colcon") or (Path(sys.executable).parent / "colcon").exists()),
        reason="colcon is not installed",
    ),
]


@pytest.fixture(scope="module")
def install(tmp_path_factory):
    """The install space of a workspace built from the sources."""
    folder = tmp_path_factory.mktemp("workspace")
    environment = {
        **os.environ,
        "AMENT_PREFIX_PATH": sys.prefix,
        "PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}",
    }
    sources = folder / "src"
    ignore = shutil.ignore_patterns("*.egg-info", "build", "__pycache__")
    shutil.copytree(ROOT / "analysis", sources / "analysis", ignore=ignore)
    shutil.copytree(ROOT / "ros_ws" / "src", sources / "nodes", ignore=ignore)
    done = subprocess.run(
        ["colcon", "--log-base", str(folder / "log"), "build", "--base-paths", str(sources),
         "--build-base", str(folder / "build"), "--install-base", str(folder / "install"), "--event-handlers", "console_cohesion+"],
        capture_output=True, text=True, timeout=LONG, env=environment, cwd=folder, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    assert "3 packages finished" in done.stdout
    return folder / "install"


def test_executables_and_shared_files_are_where_ros_looks_for_them(install):
    nodes, bringup = install / "rhythmid_nodes", install / "rhythmid_bringup"
    for executable in ("plant", "excitation", "delay_injector", "recorder"):
        assert os.access(nodes / "lib" / "rhythmid_nodes" / executable, os.X_OK)
    for name in ("rhythmid", "rhythmid_nodes", "rhythmid_bringup"):
        assert (install / name / "share" / name / "package.xml").is_file()
        assert (install / name / "share" / "ament_index" / "resource_index" / "packages" / name).is_file()
    share = bringup / "share" / "rhythmid_bringup"
    for file in (
        "launch/experiment.launch.py",
        "config/demo.yaml",
        "config/paper_hopper.yaml",
        "config/diagnostic_aggregator.yaml",
        "layouts/hopper.xml",
        "layouts/hopper.foxglove.json",
    ):
        assert (share / file).is_file()


def sourced(install, folder, *command):
    """Run a command in a shell that has sourced the workspace, as a user does."""
    script = f'source {install}/local_setup.bash && exec "$@"'
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    return subprocess.run(
        ["bash", "-c", script, "bash", *map(str, command)],
        capture_output=True, text=True, timeout=LONG, cwd=folder, env=environment, check=False,
    )  # fmt: skip


def test_the_installed_executables_run(install, tmp_path):
    node = install / "rhythmid_nodes" / "lib" / "rhythmid_nodes" / "delay_injector"
    done = sourced(install, tmp_path, node, "--ros-args", "-p", "delay:=-1.0")
    assert (done.returncode, done.stderr) == (2, "error: parameter delay = -1.0 must lie in [0, 10] s\n")


def test_the_installed_packages_run_an_experiment(install, tmp_path):
    where = "import rhythmid, rhythmid_nodes, rhythmid_bringup as b; print(rhythmid.__file__, rhythmid_nodes.__file__, b.__file__)"
    files = sourced(install, tmp_path, sys.executable, "-c", where).stdout.split()
    assert len(files) == 3 and all(file.startswith(str(install)) for file in files)
    experiment = install / "rhythmid_bringup" / "share" / "rhythmid_bringup" / "config" / "lockstep.yaml"
    done = sourced(install, tmp_path, sys.executable, "-m", "rhythmid.cli", "run", experiment, "--out", "bag")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "bag" / "metadata.yaml").is_file()
