"""The site: built without a warning: no broken link, no page left out, no equation that is none."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.docs.pages import ROOT

pytest.importorskip("furo", reason="the extra docs is not installed")


@pytest.fixture
def site(tmp_path: Path) -> Path:
    command = [sys.executable, "-m", "sphinx", "--fail-on-warning", "--keep-going", "--quiet"]
    places = [ROOT / "docs", tmp_path / "html", "--doctree-dir", tmp_path / "doctrees"]
    made = subprocess.run([*command, *map(str, places)], capture_output=True, text=True)
    assert made.returncode == 0, made.stderr
    return tmp_path / "html"


def test_every_page_is_there_needs_no_network_and_draws_its_equations(site: Path) -> None:
    for page in (ROOT / "docs").glob("*.md"):
        text = (site / f"{page.stem}.html").read_text(encoding="utf-8")
        assert not re.search(
            r'(<script[^>]*src|<link rel="stylesheet"[^>]*href|<img[^>]*src)="(https?:)?//', text
        )
    for style in site.rglob("*.css"):
        assert not re.search(r"(@import|url\()\s*[\"']?(https?:)?//", style.read_text(encoding="utf-8"))
    text = (site / "concepts.html").read_text(encoding="utf-8")
    assert text.count("<svg xmlns") > 30 and "currentColor" in text
    assert "\\tau" not in re.sub(r'aria-label="[^"]*"', "", text)


def test_links_of_the_readme_lead_somewhere() -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    links = [link for link in re.findall(r"\]\(([^)#]+)", text) if "://" not in link]
    assert links and all((ROOT / link).exists() for link in links)
