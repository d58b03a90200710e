"""Checks the site: links, anchors and pictures of the built pages, and the commands of their sources.

    python docs/check.py PROGRAM

Commands are lines of ```sh blocks that begin with faircurve or cargo run --release --. They run in a folder that is removed, with a copy
of examples/data. What is not to be run stands in a ```text block. What docs/gallery.py has run is not run again.
"""

import re
import shutil
import subprocess
import sys
import tempfile
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

from gallery import ENTRIES

ROOT = Path(__file__).parent.parent
SITE = ROOT / "site"
FETCHED = {"script", "img", "iframe", "source", "object"}


class Page(HTMLParser):
    """The anchors of a page, what it links to, and what a browser fetches for it."""

    def __init__(self, path: Path):
        super().__init__()
        self.anchors: set[str] = set()
        self.links: list[str] = []
        self.fetched: list[str] = []
        self.feed(path.read_text())

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = dict(attrs)
        self.anchors |= {given[name] or "" for name in ("id", "name") if name in given}
        for name in ("href", "src", "data"):
            if given.get(name):
                fetches = tag in FETCHED or (tag == "link" and given.get("rel") in ("stylesheet", "icon", "preload"))
                (self.fetched if fetches else self.links).append(given[name] or "")


def faults() -> list[str]:
    """What is wrong with links."""
    pages = {path: Page(path) for path in SITE.rglob("*.html")}
    found = []
    for path, page in pages.items():
        name = path.relative_to(SITE)
        for link in page.links + page.fetched:
            parts = urlsplit(link)
            if parts.scheme in ("mailto", "data"):
                continue
            if parts.scheme or parts.netloc:
                if link in page.fetched:
                    found.append(f"{name} fetches {link} from another host")
                continue
            if parts.path.startswith("/"):
                if name.name != "404.html":
                    found.append(f"{name}: {link} is absolute")
                continue
            target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            target = target / "index.html" if target.is_dir() else target
            if not target.exists():
                found.append(f"{name}: {link} leads nowhere")
            elif parts.fragment and target in pages and unquote(parts.fragment) not in pages[target].anchors | {"__tabbed_1"}:
                found.append(f"{name}: {link} has no such anchor")
    return found


def commands() -> dict[str, str]:
    """The commands, and the page that has each."""
    found: dict[str, str] = {}
    ran = {command for entry in ENTRIES for command in entry.commands.split("\n")}
    for path in [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]:
        if path.name in ("gallery.md", "options.md"):
            continue
        for block in re.findall(r"^ *```sh\n(.*?)^ *```", path.read_text(), re.M | re.S):
            for line in map(str.strip, block.splitlines()):
                if command := re.match(r"(?:faircurve|cargo run --release --) (.*?)(?: #.*)?$", line):
                    found.setdefault(command[1], str(path.relative_to(ROOT)))
    return {command: page for command, page in found.items() if command not in ran}


def failures(program: str) -> list[str]:
    """The commands that fail, or write less than they say."""
    found = []
    with tempfile.TemporaryDirectory() as folder:
        shutil.copytree(ROOT / "examples/data", Path(folder) / "examples/data")
        for command, page in commands().items():
            words = command.split()
            run = subprocess.run([program, *words, "--force"], cwd=folder, capture_output=True, text=True)
            written = [b for a, b in zip(words, words[1:]) if a in ("-o", "--picture", "--report")]
            missing = [name for name in written if not (Path(folder) / name).exists()]
            if run.returncode or missing:
                found.append(f"{page}: faircurve {command}: status {run.returncode}, not written: {missing}\n{run.stderr}")
    print(f"{len(commands())} commands ran, besides those of the gallery")
    return found


if __name__ == "__main__":
    wrong = faults() + failures(str(Path(sys.argv[1]).resolve()))
    print("\n".join(wrong))
    sys.exit(bool(wrong))
