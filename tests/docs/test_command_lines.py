"""Command lines of the pages and of the program's own help: each is one that the program understands."""

import re
import shlex
from pathlib import Path
from typing import NamedTuple

import pytest
import typer

from escort_mj import api
from escort_mj.cli import app
from tests.docs.pages import PAGES, ROOT, blocks, text_of

COMMANDS = typer.main.get_command(app).commands
STUDIES = {"sweep", "tune", "falsify"}
TOP = {"--install-completion", "--help", "--version", "-h"}  # options of the program itself


class Line(NamedTuple):
    """A command line: where it stands, and its words after the program's name."""

    place: str
    words: tuple[str, ...]


def lines() -> list[Line]:
    """What stands in blocks for terminals, in YAML of other programs, and in examples of the help."""
    found = []
    for block in blocks("", "yaml", "bash"):
        for text in block.text.splitlines():
            found += calls(text, block.place)
    for name, command in COMMANDS.items():
        for example in re.findall(r"Example: (.*?)(?=\n\n|$)", command.help or "", re.DOTALL):
            found += calls(" ".join(example.split()), f"escort-mj {name} --help")
    return found


def calls(text: str, place: str) -> list[Line]:
    """Every call of the program in a line of a shell."""
    found = []
    for part in re.split(r"\s(?:&&|\||;|>)\s|;", re.sub(r"(^|\s)#.*", "", text)):
        match = re.search(r"^(?:\$ |- run: |- )?\s*(?:\S*/)?escort-mj (.+)$", part.strip())
        if match:
            found.append(Line(place, tuple(shlex.split(match[1]))))
    return found


LINES = lines()


@pytest.mark.parametrize("line", LINES, ids=[f"{line.place} {' '.join(line.words)}" for line in LINES])
def test_the_program_understands(line: Line, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    name, *words = line.words
    if name in TOP:
        return
    monkeypatch.chdir(tmp_path)
    for word in words:
        if word.startswith("renders/"):
            (tmp_path / word).mkdir(parents=True)
    exists(name, COMMANDS[name].make_context(name, words).params)


def exists(name: str, options: dict) -> None:
    """Whether shipped scenarios and studies are called what they are called here, and --set fits them."""
    given = [options.get("study"), options.get("scenario"), *(options.get("paths") or ())]
    for path in filter(None, given):
        if path.endswith((".yaml", "/")) or (ROOT / path).is_dir():
            continue
        if name in STUDIES or path.startswith("studies/"):
            assert api.study_path(path).is_file()
        else:
            api.load_scenario(path, options.get("overrides") or ())


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_commands_within_sentences_are_there(page: Path) -> None:
    for call in re.findall(r"`escort-mj ([^`]*)`", text_of(page)):
        name = call.split()[0].strip(",")
        assert name in TOP or name in COMMANDS, f"{page.name}: escort-mj {call}"
        known = set(TOP)
        for parameter in COMMANDS[name].params if name in COMMANDS else ():
            known.update(parameter.opts, parameter.secondary_opts)
        assert set(re.findall(r"--[a-z-]+", call)) <= known, f"{page.name}: escort-mj {call}"


def test_there_is_something_to_test() -> None:
    assert {line.words[0] for line in LINES} >= {"run", "check", "sweep", "report", "new", "doctor"}
