"""Files of other programs that are not supported, and how to convert each to a bag or a table."""

import os
from pathlib import Path

from rhythmid.errors import InputError

SAVE_AS_CSV = "save it as .csv in the program that wrote it"
KINDS = {
    ".bag": "a bag of ROS 1",
    ".xls": "a workbook of an old format", ".ods": "a workbook of another format",
    ".tdms": "a file of LabVIEW", ".mf4": "a file of measurements in MDF", ".mdf": "a file of measurements in MDF",
    ".psdata": "a file of PicoScope", ".sal": "a capture of Saleae's Logic",
    ".pkl": "a pickle, which may run any code", ".pickle": "a pickle, which may run any code",
}  # fmt: skip


def refuse_foreign(path: Path) -> None:
    """Raise InputError, one line with advice, where a path is a file of another program, or a directory with bags
    of ROS 1."""
    suffix = path.suffix.lower()
    if os.path.isdir(path):  # False for a name that is too long
        if not any(path.glob("*.bag")) or (path / "metadata.yaml").exists():
            return
        path, suffix = min(path.glob("*.bag")), ".bag"
    if suffix == ".bag":
        into = path.with_suffix("")
        raise InputError(
            f"{path}: is a bag of ROS 1, which is not read; convert it:  rosbags-convert --src {path} --dst {into}  (of the package rosbags)"
        )
    if suffix in KINDS:
        raise InputError(f"{path}: is {KINDS[suffix]}, which is not read; {SAVE_AS_CSV}")
