"""What the demonstrations share: the command line, run as a user would, and the seal on what is concealed."""

import hashlib
import subprocess
import sys
from pathlib import Path


def rhythmid(*arguments: str | Path) -> None:
    """Run the command and end with its exit code if it fails."""
    line = ["rhythmid", *map(str, arguments)]
    print("$", *line, flush=True)
    code = subprocess.call([sys.executable, "-m", "rhythmid.cli", *line[1:]])
    if code:
        sys.exit(code)


def seal_of(path: Path) -> str:
    """The SHA-256 of a file, by which everybody sees that it has not been changed."""
    return hashlib.sha256(path.read_bytes()).hexdigest()
