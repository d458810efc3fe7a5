"""The reference pages that are made when the site is built, and that of Python, hold what they are about."""

import re

import pytest
from typer.testing import CliRunner

import escort_mj
from escort_mj.cli import app
from escort_mj.cli.values import values_read
from escort_mj.components.equations import kind_word
from escort_mj.scenario.kinds import EQUATIONS
from tests.docs.pages import DOCS, PAGES, REFERENCE, text_of

HELD = {
    "keys": "| `force_limit` |",
    "commands": "### check-plugin",
    "metrics": "| `hull_margin` | m |",
    "signals": "| `rho_hat` | N |",
    "values": "| `r.e` | behavior | vector | m |",
}


@pytest.mark.parametrize("page", HELD)
def test_a_page_is_what_the_program_prints(page: str) -> None:
    words = ["schema"] if page == "keys" else ["list", page]
    made = CliRunner().invoke(app, [*words, "--markdown"])
    assert made.exit_code == 0 and made.output == REFERENCE[DOCS / f"{page}.md"] + "\n"
    assert HELD[page] in made.output


def test_every_value_that_a_component_can_read_has_a_line_and_a_meaning() -> None:
    rows = [*values_read()]
    assert all(form and meaning for _, _, form, _, meaning in rows)
    for base in EQUATIONS:
        told = [name.removeprefix("r.") for each, name, *_ in rows if each == kind_word(base)]
        known = base.names().known
        assert len(told) == len(set(told)) and set(told) >= set(known) - set(base.scratch), base


def test_the_python_page_names_everything_as_users_import_it() -> None:
    page = (DOCS / "python.md").read_text()
    for name in set(dir(escort_mj)) - {
        "__version__",
        "EscortError",
        "ScenarioError",
    }:  # with all errors, below
        assert re.search(rf"\.\. auto(function|class):: escort_mj\.{name}\n", page), name


def test_pages_link_to_each_other_and_not_to_files_of_the_repository() -> None:
    for page in PAGES[1:]:
        assert "(docs/" not in text_of(page), page.name
