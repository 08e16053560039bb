"""Hooks of MkDocs: pages that are generated, documents from elsewhere in the repository, and links between the two.

Documents of the repository (README files, the changelog) link to files; on the site those links lead to pages.
"""

import os.path
import posixpath
import re
from pathlib import Path
from typing import Any

import command_reference  # beside this file
import notebook
import result_reference
from mkdocs.structure.files import File, Files

ROOT = Path(__file__).parents[2]
GENERATED = {"cli.md": command_reference.page, "schema.md": result_reference.page}
ELSEWHERE = {  # page: document of the repository
    "nodes.md": "ros_ws/README.md",
    "changelog.md": "CHANGELOG.md",
    "contributing.md": "CONTRIBUTING.md",
    "quality.md": "QUALITY_DECLARATION.md",
}
NOTEBOOKS = {f"notebook_{path.stem}.md": path for path in (ROOT / "docs" / "notebooks").glob("*.ipynb")}
LAST = "changelog.md"  # in the results of a search: it holds every word
PAGES = {document: page for page, document in ELSEWHERE.items()} | {
    path.relative_to(ROOT).as_posix(): page for page, path in NOTEBOOKS.items()
}
LINK = re.compile(r"\[([^\]\n]*)\]\(([^)\s#]+)(#[^)\s]*)?\)")


def on_files(files: Files, config: Any) -> Files:
    """Add the pages that are not files of docs/."""
    for page, make in GENERATED.items():
        files.append(File.generated(config, page, content=make()))
    for page, path in NOTEBOOKS.items():
        files.append(File.generated(config, page, content=notebook.page(path)))
    for page, document in ELSEWHERE.items():
        files.append(File.generated(config, page, content=(ROOT / document).read_text(encoding="utf-8")))
    return files


def on_page_markdown(markdown: str, page: Any, files: Files, **_: Any) -> str:
    """Turn links to files of the repository into links to their pages."""
    uri = page.file.src_uri
    if uri == LAST:
        page.meta["search"] = {"boost": 0.1}
    folder = posixpath.dirname(ELSEWHERE.get(uri, f"docs/{uri}"))

    def led(link: re.Match[str]) -> str:
        text, target, anchor = link[1], link[2], link[3] or ""
        document = posixpath.normpath(posixpath.join(folder, target))
        found = document.removeprefix("docs/")
        if uri not in NOTEBOOKS:  # whose link to the notebook itself is meant
            found = PAGES.get(document, found)
        if file := files.get_file_from_path(found):
            if text.endswith(".md") and file.page is not None:
                text = file.page.title  # a name of a file says little on a site
            return f"[{text}]({os.path.relpath(found, posixpath.dirname(uri) or '.')}{anchor})"
        if "://" not in target and (ROOT / document).exists():  # not part of the site
            return text if text.startswith("`") else f"`{document}`"
        return link[0]

    return LINK.sub(led, markdown)
