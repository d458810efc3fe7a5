"""The tutorials, typed as they are printed: every command ends well."""

import re
import shlex
from pathlib import Path

import pytest

from tests.docs.pages import RUN, blocks, write_files
from tests.test_cli import call

DOCS = Path(__file__).parents[2] / "docs"
PAGES = ("start.md", "tutorial_study.md", "own_robot.md")


@pytest.mark.slow
@pytest.mark.parametrize("page", PAGES)
def test_a_tutorial_as_printed(page: str, monkeypatch, capfd, tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)
    write_files(f"docs/{page}", tmp_path)
    commands = [
        shlex.split(line)
        for block in blocks("")
        if block.place.startswith(f"docs/{page}") and block.runs
        for line in block.text.splitlines()
    ]
    assert len(commands) >= 4
    for program, *arguments in commands:
        assert program == "escort-mj"
        code, out, err = call(monkeypatch, capfd, *arguments)
        assert code == 0, f"{' '.join(arguments)}: {out}{err}"
    made = {path.relative_to(tmp_path).as_posix() for path in tmp_path.rglob("*")}
    named = set(re.findall(r"`(renders/[\w/.]*[\w.])/?`", (DOCS / page).read_text()))
    assert named and named <= made


def test_what_runs_is_marked() -> None:
    assert all(RUN in (DOCS / page).read_text() for page in PAGES)
