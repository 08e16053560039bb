"""Git LFS pointers in place of files that were not fetched (https://git-lfs.com/spec/v1)."""

from pathlib import Path

from rhythmid.errors import InputError

FIRST_LINE = b"version https://git-lfs.github.com/spec/"


def check_content(path: Path) -> None:
    """Raise InputError where a file is only a pointer to data. A file that cannot be opened is left to its reader."""
    try:
        with path.open("rb") as file:
            start = file.read(len(FIRST_LINE))
    except OSError:
        return
    if start == FIRST_LINE:
        raise InputError(f"{path}: is a pointer of Git LFS, not the data; fetch them with  git lfs pull")
