"""The site: no broken link, no page left out, no equation that is none; at night built, without a warning."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.docs.pages import REFERENCE, ROOT, text_of
from tests.docs.pages import SITE as PAGES

FENCED = re.compile(r"^```.*?^```", re.MULTILINE | re.DOTALL)


@pytest.fixture
def site(tmp_path: Path) -> Path:
    pytest.importorskip("furo", reason="the extra docs is not installed")
    command = [sys.executable, "-m", "sphinx", "--fail-on-warning", "--keep-going", "--quiet"]
    places = [ROOT / "docs", tmp_path / "html", "--doctree-dir", tmp_path / "doctrees"]
    made = subprocess.run([*command, *map(str, places)], capture_output=True, text=True)
    assert made.returncode == 0, made.stderr
    return tmp_path / "html"


@pytest.mark.slow
def test_every_page_is_there_needs_no_network_and_draws_its_equations(site: Path) -> None:
    for page in PAGES:
        text = (site / f"{page.stem}.html").read_text(encoding="utf-8")
        assert not re.search(
            r'(<script[^>]*src|<link rel="stylesheet"[^>]*href|<img[^>]*src)="(https?:)?//', text
        )
    for style in site.rglob("*.css"):
        assert not re.search(r"(@import|url\()\s*[\"']?(https?:)?//", style.read_text(encoding="utf-8"))
    text = (site / "concepts.html").read_text(encoding="utf-8")
    assert text.count("<svg xmlns") > 30 and "currentColor" in text
    assert "\\tau" not in re.sub(r'aria-label="[^"]*"', "", text)


def heads(page: Path) -> set[str]:
    """What links may name in a page: its headings, as GitHub and MyST write them."""
    text = FENCED.sub("", text_of(page))
    titles = re.findall(r"^#+ (.+)$", text, flags=re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", title).strip().lower().replace(" ", "-") for title in titles}


@pytest.mark.parametrize("page", [ROOT / "README.md", *PAGES], ids=lambda page: page.name)
def test_links_lead_somewhere(page: Path) -> None:
    links = re.findall(r"\]\(([^)\s]+)\)", text_of(page))
    for link in links:
        path, _, head = link.partition("#")
        if "://" not in link:
            target = page.parent / path if path else page
            assert target.exists() or target in REFERENCE, link
            assert not head or head in heads(target), link


def test_no_page_is_left_out() -> None:
    text = (ROOT / "docs" / "index.md").read_text(encoding="utf-8")
    trees = "\n".join(re.findall(r"^```{toctree}\n(.*?)^```", text, flags=re.MULTILINE | re.DOTALL))
    listed = re.findall(r"^(?:.*<([\w/]+)>|([\w/]+))$", trees, flags=re.MULTILINE)
    pages = [page.stem for page in PAGES if page.stem != "index"]
    pages += [f"notebooks/{book.stem}" for book in (ROOT / "examples").glob("*.ipynb")]
    assert sorted("".join(pair) for pair in listed) == sorted(pages)


def test_included_code_is_found() -> None:
    found = 0
    for page in PAGES:
        text = text_of(page)
        for path, options in re.findall(
            r"^```{literalinclude} (\S+)\n(.*?)^```", text, re.MULTILINE | re.DOTALL
        ):
            code = (page.parent / path).read_text(encoding="utf-8")
            for key, words in re.findall(r"^:([\w-]+): (.+)$", options, re.MULTILINE):
                name = words.strip('"').rpartition(".")[2]
                sought = rf"\b(def|class) {name}\b" if key == "pyobject" else re.escape(words.strip('"'))
                assert key == "language" or re.search(sought, code), (page.name, words)
                found += 1
    assert found > 5


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_equations_can_be_drawn(page: Path) -> None:
    ziamath = pytest.importorskip("ziamath", reason="the extra docs is not installed")
    text = re.sub(r"`[^`]*`", "", FENCED.sub("", text_of(page)))
    found = re.findall(r"\$\$(.+?)\$\$|(?<![\\$\w])\$([^$\n]+?)\$(?!\d)", text, flags=re.DOTALL)
    assert len(found) > 20 or page.name != "concepts.md"
    for block, inline in found:
        ziamath.Latex(block or inline, inline=bool(inline))
