"""What a shell offers when Tab is pressed, asked as bash asks, and the help of every command."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

from escort_mj.cli import app, complete
from escort_mj.cli.group import SECTIONS

COMMANDS = typer.main.get_command(app).commands


def asked(*words: str) -> dict[str, str]:
    """How bash asks what may stand in the place of the last of the words."""
    return {
        "_ESCORT_MJ_COMPLETE": "complete_bash",
        "COMP_WORDS": " ".join(("escort-mj", *words)),
        "COMP_CWORD": str(len(words)),
    }


def offered(*words: str) -> set[str]:
    """What the program answers, in this process."""
    return {*CliRunner().invoke(app, [], env=asked(*words), prog_name="escort-mj").stdout.split()}


def answered(folder: Path, *words: str) -> set[str]:
    """What the program answers to bash."""
    code = (
        "import sys; sys.argv = ['escort-mj']; from escort_mj.cli.app import app; import escort_mj.cli; app()"
    )
    said = subprocess.run(
        [sys.executable, "-c", code],
        env=os.environ | asked(*words),
        cwd=folder,
        capture_output=True,
        text=True,
    )
    assert not said.stderr
    return set(said.stdout.split())


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a scenario, a run and a study."""
    for name in (
        "renders/main/outcome.json",
        "renders/studies/few/results.sqlite",
        "renders/.main/outcome.json",
    ):
        (tmp_path / name).parent.mkdir(parents=True)
        (tmp_path / name).touch()
    (tmp_path / "mine.yaml").touch()
    (tmp_path / "notes.txt").touch()
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_a_shell_asks(folder: Path) -> None:
    assert answered(folder, "run", "m") == {"main", "main_3d", "mine.yaml"}
    assert offered("sweep", "studies/min") == {"studies/minute"}
    assert offered("show", "ren") == {"renders/main"}
    assert "--no-video" in offered("run", "main", "--no")


def test_folders_of_results(folder: Path) -> None:
    assert complete.results("r") == ["renders/main", "renders/studies/few"]
    assert complete.results("renders/st") == ["renders/studies/few"]
    assert complete.runs(f"{folder}/renders/m") == [f"{folder}/renders/main"]
    assert complete.runs("nowhere/x") == []


def test_files_and_names(folder: Path) -> None:
    assert complete.scenarios("paper/case1") == ["paper/case1_2d", "paper/case1_3d"]
    assert complete.scenarios("./m") == ["./mine.yaml"]
    assert complete.scenarios("re") == ["renders/"]
    assert "studies/minute" in complete.studies("") and "main" not in complete.studies("")
    assert complete.runs_or_scenarios("r")[0] == "renders/main"


def test_keys_and_values() -> None:
    assert {"mission.radius=", "mission.outer="} <= set(complete.overrides("mission."))
    assert complete.overrides("robots.co") == ["robots.count="]
    assert complete.overrides("controller=ap") == ["controller=apd_smc"]
    assert complete.overrides("controller.anti_windup=") == [
        "controller.anti_windup=true",
        "controller.anti_windup=false",
    ]
    assert complete.overrides("nothing=") == []
    assert complete.laws("apd_smc,pd,p") == ["apd_smc,pd,pd_smc"]
    assert complete.outer_loops("n") == ["nsb"]


def test_every_command_is_listed_once() -> None:
    assert sorted(sum(SECTIONS.values(), ())) == sorted(COMMANDS)


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_says_what_it_does_with_an_example(name: str) -> None:
    words = " ".join(COMMANDS[name].help.split())
    assert f"Example: escort-mj {name}" in words
    assert all(option.help for option in COMMANDS[name].params), "an option says nothing"
