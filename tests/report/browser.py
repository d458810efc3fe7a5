"""Pages opened in a real headless browser, and taken apart without one."""

import json
import re
import shutil
import subprocess
from html.parser import HTMLParser
from pathlib import Path
from typing import Any, NamedTuple

import pytest

BROWSER = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
needs_browser = pytest.mark.skipif(BROWSER is None, reason="no Chromium here; apt-get install chromium")
FLAGS = (
    ["--headless", "--no-sandbox", "--disable-quic", "--no-first-run", "--disable-background-networking"]
    + ["--disable-component-update", "--disable-sync", "--use-angle=swiftshader"]
    + ["--enable-unsafe-swiftshader", "--enable-logging=stderr"]
)


class Page(HTMLParser):
    """Elements of a page, each with its attributes."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.elements: list[tuple[str, dict[str, str]]] = []
        self.open: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, {name: value or "" for name, value in attrs}))
        if tag not in ("meta", "link", "img", "br"):
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def all(self, name: str) -> list[dict[str, str]]:
        return [attributes for tag, attributes in self.elements if tag == name]


class Seen(NamedTuple):
    """What a browser saw of a page."""

    found: dict[str, Any]
    errors: list[str]


def look(path: Path, profile: Path, script: str) -> Seen:
    """Opens a page in a headless browser that no request can leave.

    Args:
        path: The page.
        profile: An empty folder.
        script: JavaScript that runs once the page is there, and calls `tell` with what it found.
    """
    assert BROWSER is not None
    probed = profile / path.name
    telling = """const tell = found => {
      const said = document.createElement("pre");
      said.id = "found";
      said.textContent = JSON.stringify(found);
      document.body.append(said);
    };"""
    text = path.read_text(encoding="utf-8")
    head, _, tail = text.rpartition("</body>")
    probe = f"<script>addEventListener('load', async () => {{ {telling}\n{script} }});</script></body>"
    probed.write_text(head + probe + tail, encoding="utf-8")
    flags = [*FLAGS, f"--user-data-dir={profile / 'profile'}", "--host-resolver-rules=MAP * ~NOTFOUND"]
    command = [BROWSER, *flags, "--virtual-time-budget=5000", "--dump-dom", probed.as_uri()]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120)
    found = re.search(r'<pre id="found">(.*?)</pre>', done.stdout)
    said = [line for line in done.stderr.splitlines() if ":CONSOLE" in line]
    return Seen(json.loads(found[1]) if found else {}, said)
