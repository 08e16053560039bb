"""Build docker/Dockerfile and run the services of docker/compose.yaml with buildah, where no container engine runs.

    python docker/without_engine.py [--folder out/docker] [--base-image IMAGE] [--keep]

The base image is made from the packages of this machine's own distribution (debootstrap), because no image registry may
be at hand: a stand-in for the Dockerfile's default, with the distribution's Python. Isolation is by chroot: file systems
are separate, network and shared memory are the host's, as compose.yaml asks for. Installs nothing; says what is missing.
"""

import argparse
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import yaml

ROOT = Path(__file__).parents[1]
COMPOSE = ROOT / "docker" / "compose.yaml"
CERTIFICATES = "/etc/ssl/certs:/etc/ssl/certs:ro"  # as this machine trusts, so may the build
IMAGE = "localhost/rhythmid"
BASE = "localhost/rhythmid-base"
PACKAGES = "ca-certificates,python3,python3-venv"


class Missing(Exception):
    """What this machine lacks for the build."""


class Buildah:
    """buildah with its storage in a folder of its own, so that root's other containers are left alone."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._command = ["buildah", "--root", str(folder / "store"), "--runroot", str(folder / "run")]
        self._environment = {**os.environ, "STORAGE_DRIVER": "vfs", "BUILDAH_ISOLATION": "chroot"}

    def __call__(self, *arguments: str) -> str:
        """Output of a command; its complaints go to the terminal."""
        done = subprocess.run(
            [*self._command, *arguments], env=self._environment, check=True, text=True, stdout=subprocess.PIPE
        )
        return done.stdout.strip()

    def has(self, image: str) -> bool:
        """Whether the storage holds an image."""
        found = subprocess.run(
            [*self._command, "inspect", "--type", "image", image], env=self._environment, capture_output=True
        )
        return found.returncode == 0

    def build(self, image: str, base: str) -> None:
        """Build the Dockerfile upon `base`."""
        subprocess.run(
            [*self._command, "bud", "--isolation", "chroot", "--network", "host", "--volume", CERTIFICATES, "--layers",
             "--build-arg", f"BASE_IMAGE={base}", "--file", str(ROOT / "docker" / "Dockerfile"), "--tag", image, str(ROOT)],
            env=self._environment, check=True,
        )  # fmt: skip

    def start(self, image: str, options: list[str], command: list[str]) -> tuple[str, subprocess.Popen[str]]:
        """Start the image's program with these arguments in a new container."""
        container = self("from", image)
        line = [
            *self._command,
            "run",
            "--isolation",
            "chroot",
            "--network",
            "host",
            *options,
            container,
            "--",
        ]
        process = subprocess.Popen(
            [*line, "rhythmid", *command], env=self._environment, text=True, start_new_session=True
        )
        return container, process


def check_tools() -> None:
    """Raise Missing unless the machine can do it."""
    lacking = [tool for tool in ("buildah", "debootstrap", "apt-get", "tar") if shutil.which(tool) is None]
    if lacking:
        raise Missing(
            f"{', '.join(lacking)} not found; on Debian: apt-get install --no-install-recommends buildah debootstrap"
        )
    if os.geteuid() != 0:
        raise Missing("debootstrap and chroot isolation need root")


def distribution() -> tuple[str, str]:
    """Mirror and code name of this machine's own distribution, as apt is configured."""
    listed = subprocess.run(
        ["apt-get", "indextargets", "--format", "$(REPO_URI) $(CODENAME)", "Created-By: Packages"],
        check=True, capture_output=True, text=True,
    ).stdout.split("\n")  # fmt: skip
    for line in listed:
        mirror, _, name = line.partition(" ")
        if mirror and re.fullmatch(r"[a-z]+", name):  # not bookworm-updates, not bookworm-security
            return mirror, name
    raise Missing("apt has no package lists; run apt-get update")


def make_base(buildah: Buildah, folder: Path) -> None:
    """A minimal system with Python, as an image."""
    mirror, name = distribution()
    print(f"making a base image of {name}", flush=True)
    system = folder / "system"
    shutil.rmtree(system, ignore_errors=True)
    subprocess.run(["debootstrap", "--variant=minbase", f"--include={PACKAGES}", name, str(system), mirror],
                   check=True, stdout=subprocess.DEVNULL)  # fmt: skip
    archive = folder / "system.tar"
    subprocess.run(["tar", "-C", str(system), "-cf", str(archive), "."], check=True)
    container = buildah("from", "scratch")
    buildah("add", "--quiet", container, str(archive), "/")
    buildah("config", "--env", "PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin", container)
    buildah("commit", "--quiet", "--rm", container, BASE)
    archive.unlink()
    shutil.rmtree(system)


def substituted(value: Any) -> Any:
    """${NAME:-default} in the values of a compose file, from the environment."""
    if isinstance(value, str):
        return re.sub(r"\$\{(\w+):-([^}]*)\}", lambda found: os.environ.get(found[1]) or found[2], value)
    if isinstance(value, dict):
        return {key: substituted(item) for key, item in value.items()}
    if isinstance(value, list):
        return [substituted(item) for item in value]
    return value


def innermost(pid: int) -> int:
    """The container's program: buildah's last descendant. Signals to buildah itself would kill, not end it."""
    for thread in Path(f"/proc/{pid}/task").iterdir():
        for child in (thread / "children").read_text(encoding="utf-8").split():
            return innermost(int(child))
    return pid


def options_of(service: dict[str, Any], volumes: Path) -> list[str]:
    """A compose service's volumes and environment as options of `buildah run`."""
    options = []
    for volume in service.get("volumes", []):
        source, target, *mode = volume.split(":")
        place = (COMPOSE.parent / source).resolve() if source.startswith((".", "/")) else volumes / source
        options += ["--volume", ":".join([str(place), target, *mode])]
    for name, setting in service.get("environment", {}).items():
        options += ["--env", f"{name}={setting}"]
    return options


def run_services(buildah: Buildah, volumes: Path) -> int:
    """`docker compose up --abort-on-container-exit`, then `run analysis`; the first exit code that is not 0."""
    services = substituted(yaml.safe_load(COMPOSE.read_text(encoding="utf-8"))["services"])
    graph = {name: service for name, service in services.items() if "profiles" not in service}
    running: dict[str, tuple[str, subprocess.Popen[str]]] = {}
    try:
        for name, service in graph.items():
            running[name] = buildah.start(IMAGE, options_of(service, volumes), service["command"])
        while all(process.poll() is None for _, process in running.values()):
            time.sleep(0.2)
        first = next(name for name, (_, process) in running.items() if process.returncode is not None)
        print(f"{first} has ended, the others follow", flush=True)
        for _, process in running.values():
            if process.poll() is None:
                os.kill(innermost(process.pid), signal.SIGINT)
        codes = {name: process.wait(timeout=30) for name, (_, process) in running.items()}
        print("exit codes:", codes, flush=True)
        if any(codes.values()):
            return 1
        analysis = services["analysis"]
        running["analysis"] = buildah.start(IMAGE, options_of(analysis, volumes), analysis["command"])
        return running["analysis"][1].wait()
    finally:
        for container, process in running.values():
            if process.poll() is None:
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()
            buildah("rm", container)


def main() -> int:
    parser = argparse.ArgumentParser(description="Build the image and run its containers with buildah.")
    parser.add_argument("--folder", type=Path, default=ROOT / "out" / "docker", help="storage and results")
    parser.add_argument("--base-image", help="an image of the storage to build upon, instead of making one")
    arguments = parser.parse_args()
    folder = arguments.folder.resolve()
    try:
        check_tools()
        folder.mkdir(parents=True, exist_ok=True)
        buildah = Buildah(folder)
        base = arguments.base_image or BASE
        if not arguments.base_image and not buildah.has(BASE):
            make_base(buildah, folder)
        buildah.build(IMAGE, base)
    except Missing as lacking:
        print(f"error: {lacking}", file=sys.stderr)
        return 2
    volumes = folder / time.strftime("run-%Y%m%d-%H%M%S")
    (volumes / "bags").mkdir(parents=True)
    os.chown(volumes / "bags", 1000, 1000)  # an engine gives a new volume the owner of the image's folder
    code = run_services(buildah, volumes)
    print(f"bag: {volumes / 'bags' / 'bag'}")
    return code


if __name__ == "__main__":
    sys.exit(main())
