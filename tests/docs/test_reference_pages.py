"""The reference pages that `make reference` writes are those that the code makes now."""

import re
from pathlib import Path

import pytest
from typer.testing import CliRunner

import escort_mj
from escort_mj.cli import app

DOCS = Path(__file__).parents[2] / "docs"


@pytest.mark.parametrize("page", ["commands", "metrics", "signals"])
def test_a_page_is_what_the_code_says(page: str) -> None:
    made = CliRunner().invoke(app, ["list", page, "--markdown"])
    assert made.exit_code == 0 and made.output == (DOCS / f"{page}.md").read_text()


def test_pages_hold_what_they_are_about() -> None:
    assert "### check-plugin" in (DOCS / "commands.md").read_text()
    assert "| `hull_margin` | m |" in (DOCS / "metrics.md").read_text()
    assert "| `rho_hat` | N |" in (DOCS / "signals.md").read_text()


def test_the_python_page_names_everything_as_users_import_it() -> None:
    page = (DOCS / "python.md").read_text()
    for name in set(dir(escort_mj)) - {
        "__version__",
        "EscortError",
        "ScenarioError",
    }:  # with all errors, below
        assert re.search(rf"\.\. auto(function|class):: escort_mj\.{name}\n", page), name


def test_pages_link_to_each_other_and_not_to_files_of_the_repository() -> None:
    for page in DOCS.glob("*.md"):
        assert "(docs/" not in page.read_text(), page.name
