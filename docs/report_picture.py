"""Draw `docs/report.png`: the beginning of a real report, that of the tutorial's diagnosis.

python docs/report_picture.py [PICTURE]       needs Chromium; the diagnosis takes about half a minute
"""

import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

DOCS = Path(__file__).parent
FILES = ("robot", "model", "small", "large", "unseen")
SIZE = (1080, 810)  # [px]: to the end of the signal path
LEFT_OUT = "<style>nav, .hint { display: none !important; } section { margin-top: 1rem !important; }</style>"  # no list of contents
COLOURS = 64  # of the palette: a page of text needs no more


def rhythmid(*arguments: str, cwd: Path) -> None:
    """Run the command, and fail when it fails."""
    subprocess.run([sys.executable, "-m", "rhythmid", *arguments], cwd=cwd, check=True)


def report(folder: Path) -> Path:
    """The page of the tutorial's diagnosis, made with the tutorial's own files."""
    tutorial = (DOCS / "tutorial.md").read_text(encoding="utf-8")
    for name in FILES:
        shown = re.search(rf"```\w+\n(# {name}\.yaml\n.*?)```", tutorial, re.DOTALL)
        assert shown is not None, name
        (folder / f"{name}.yaml").write_text(shown[1], encoding="utf-8")
    for name in ("small", "large", "unseen"):
        rhythmid(
            "simulate", "robot.yaml", "--experiment", f"{name}.yaml", "--out", f"bags/{name}", cwd=folder
        )
    rhythmid(
        "diagnose", "bags/small", "bags/large", "--model", "model.yaml", "--holdout", "bags/unseen",
        "--report", "page.html", cwd=folder,
    )  # fmt: skip
    return folder / "page.html"


def photograph(page: Path, picture: Path) -> None:
    """What a browser shows of the page before anything is scrolled, without the list of contents and with few colours."""
    from PIL import Image

    shown = page.with_name("shown.html")
    shown.write_text(
        page.read_text(encoding="utf-8").replace("</head>", f"{LEFT_OUT}</head>"), encoding="utf-8"
    )

    program = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
    if program is None:
        sys.exit("error: no Chromium found; install it, such as with: apt-get install chromium")
    subprocess.run(
        [
            program, "--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars",
            f"--window-size={SIZE[0]},{SIZE[1]}", f"--screenshot={picture}", shown.as_uri(),
        ],
        check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip
    Image.open(picture).convert("RGB").quantize(COLOURS, dither=Image.Dither.NONE).save(
        picture, optimize=True
    )


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as scratch:
        made = report(Path(scratch))
        photograph(made, Path(sys.argv[1] if len(sys.argv) > 1 else DOCS / "report.png").resolve())
