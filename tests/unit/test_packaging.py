"""What is published: an sdist from which the wheel is made, that runs where nothing else of the project is."""

import ast
import os
import re
import shutil
import subprocess
import sys
import tarfile
import tomllib
import xml.etree.ElementTree as ElementTree
import zipfile
from email import message_from_bytes
from importlib.metadata import packages_distributions
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
ANALYSIS = ROOT / "analysis"
PROJECT = tomllib.loads((ANALYSIS / "pyproject.toml").read_text(encoding="utf-8"))["project"]
# with pip, for rosdep has no key for them or one for older versions
BY_PIP = {"backports", "lz4", "numba", "pint", "pydantic", "rich", "rosbags", "threadpoolctl", "typer"}
ROSDEP = {
    "matplotlib": "python3-matplotlib",
    "numpy": "python3-numpy",
    "scipy": "python3-scipy",
    "yaml": "python3-yaml",
}


def run(*command: object, cwd: Path, **variables: str) -> str:
    done = subprocess.run(
        list(map(str, command)), cwd=cwd, capture_output=True, text=True, timeout=600.0, check=False,
        env={name: value for name, value in os.environ.items() if name != "PYTHONPATH"} | variables,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-3000:]
    return done.stdout


def built(source: Path, what: str, out: Path) -> Path:
    """An sdist or wheel, made by the package's build backend as `python -m build --no-isolation` would."""
    out.mkdir()
    code = f"import setuptools.build_meta as b; b.build_{what}({str(out)!r})"
    run(sys.executable, "-W", "ignore", "-c", code, cwd=source)
    (made,) = out.iterdir()
    return made


@pytest.fixture(scope="module")
def wheel(tmp_path_factory) -> Path:
    """The wheel, made from the unpacked sdist."""
    folder = tmp_path_factory.mktemp("dist")
    shutil.copytree(
        ANALYSIS, folder / "source", ignore=shutil.ignore_patterns("*.egg-info", "build", "__pycache__")
    )
    with tarfile.open(built(folder / "source", "sdist", folder / "sdist")) as archive:
        archive.extractall(folder / "unpacked", filter="data")
    (unpacked,) = (folder / "unpacked").iterdir()
    return built(unpacked, "wheel", folder / "wheel")


@pytest.fixture(scope="module")
def site(wheel, tmp_path_factory) -> Path:
    """A folder into which pip installed the wheel and nothing else."""
    folder = tmp_path_factory.mktemp("site")
    run(
        sys.executable,
        "-m",
        "pip",
        "install",
        "--quiet",
        "--no-deps",
        "--no-index",
        "--no-compile",
        "--target",
        folder,
        wheel,
        cwd=folder,
    )
    return folder


def test_the_wheel_holds_every_file_of_the_package_and_the_licence(wheel):
    names = set(zipfile.ZipFile(wheel).namelist())
    wanted = {
        path.relative_to(ANALYSIS).as_posix()
        for path in (ANALYSIS / "rhythmid").rglob("*")
        if path.suffix in (".py", ".yaml", ".html", ".css", ".js") or path.name == "py.typed"
    }
    assert wanted <= names
    assert any(name.endswith("/LICENSE") for name in names)
    assert not any(name.startswith(("tests/", "docs/")) for name in names)


def test_the_metadata_says_what_the_package_is(wheel):
    archive = zipfile.ZipFile(wheel)
    (name,) = [one for one in archive.namelist() if one.endswith(".dist-info/METADATA")]
    said = message_from_bytes(archive.read(name))
    assert said["Name"] == "rhythmid" and said["License"] == "Apache-2.0"
    assert said["Requires-Python"] and "Programming Language :: Python :: 3.11" in said.get_all(
        "Classifier", []
    )
    assert {"batch", "excel", "hdf5", "legs", "notebook", "parquet", "report", "ros", "testing"} <= set(
        said.get_all("Provides-Extra", [])
    )
    assert any("hdl.handle.net" in one for one in said.get_all("Project-URL", []))


def test_the_python_on_the_package_page_runs_as_printed(tmp_path):
    page = (ANALYSIS / "README.md").read_text(encoding="utf-8")
    shown = re.search(r"```python\n(.*?)```", page, re.DOTALL)
    assert shown is not None
    (tmp_path / "shown.py").write_text(shown[1], encoding="utf-8")
    said = run(sys.executable, "shown.py", cwd=tmp_path, PYTHONPATH=str(ANALYSIS))
    assert "linear_spring.stiffness" in said and "Nothing of practical size is missing" in said


def test_the_installed_wheel_runs_without_the_checkout(site, tmp_path):
    code = "import rhythmid, rhythmid.cli; print(rhythmid.__file__)"
    where = run(sys.executable, "-P", "-c", code, cwd=tmp_path, PYTHONPATH=str(site))
    assert Path(where.strip()).is_relative_to(site)
    (tmp_path / "run.yaml").write_text(
        "model: m.yaml\nexcitation: {type: chirp, amplitude: 0.004, sweep: 0.5}\n"
    )
    shutil.copy(site / "rhythmid" / "models" / "paper_hopper.yaml", tmp_path / "m.yaml")
    command = (sys.executable, "-P", site / "bin" / "rhythmid")
    said = run(
        *command,
        "simulate",
        "m.yaml",
        "--experiment",
        "run.yaml",
        "--out",
        "bag",
        cwd=tmp_path,
        PYTHONPATH=str(site),
    )
    assert said.startswith("bag: 500 samples")


def imported(folder: Path) -> set[str]:
    """Top-level packages that a package's modules import anywhere."""
    found: set[str] = set()
    for path in folder.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                found |= {one.name.partition(".")[0] for one in node.names}
            elif isinstance(node, ast.ImportFrom) and node.level == 0 and node.module:
                found.add(node.module.partition(".")[0])
    return found - set(sys.stdlib_module_names)


def distributions(names: set[str], declared: frozenset[str] = frozenset()) -> set[str]:
    """What has to be installed for these imports; of several that bring the same one, one that is declared."""
    known = packages_distributions()
    choices = [{plain(one) for one in known[name]} for name in names if name in known]
    return {min(choice & declared or choice) for choice in choices}


def plain(requirement: str) -> str:
    """A requirement's normalised name, without extras, versions and markers."""
    return re.sub(r"[-_.]+", "-", re.split(r"[\[<>=!~ ;]", requirement, maxsplit=1)[0]).lower()


def test_every_requirement_is_used_and_everything_used_is_required():
    required = {plain(one) for one in PROJECT["dependencies"]}
    extra = {plain(one) for group in PROJECT["optional-dependencies"].values() for one in group}
    used = distributions(imported(ANALYSIS / "rhythmid") - {"rhythmid"}, frozenset(required | extra))
    assert required <= used, "a requirement that nothing imports"
    assert used <= required | extra, "imported, but required nowhere"


def test_the_manifests_name_all_that_their_packages_import():
    manifests = {
        ANALYSIS: [ANALYSIS / "rhythmid"],
        **{
            path: [path / path.name, path / "launch"]
            for path in (ROOT / "ros_ws" / "src").iterdir()
            if path.is_dir()
        },
    }
    for folder, code in manifests.items():
        declared = {
            one.text
            for one in ElementTree.parse(folder / "package.xml").getroot()
            if one.tag in ("depend", "exec_depend")
        }
        used = set().union(*(imported(part) for part in code)) - BY_PIP - {folder.name}
        if folder == ANALYSIS:
            used &= set(ROSDEP)  # the others are extras
        missing = {ROSDEP.get(name, name) for name in used} - declared
        assert not missing, (folder.name, missing)


def test_what_the_tour_writes_beside_the_experiments_is_not_installed(tmp_path):
    """The tour of the README runs in the folder of the experiments; installing again has to work after it."""
    source = tmp_path / "source"
    shutil.copytree(
        ROOT / "ros_ws" / "src" / "rhythmid_bringup", source,
        ignore=shutil.ignore_patterns("*.egg-info", "build", "__pycache__", "out"),
    )  # fmt: skip
    (source / "config" / "out" / "hop").mkdir(parents=True)
    install = ("setup.py", "--quiet", "install_data", "--install-dir", tmp_path / "installed")
    run(sys.executable, "-W", "ignore", *install, cwd=source)
    found = {
        path.name for path in (tmp_path / "installed" / "share" / "rhythmid_bringup" / "config").iterdir()
    }
    assert "lockstep.yaml" in found and "out" not in found
