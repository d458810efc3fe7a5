"""The application: one command described alone, or all."""

import sys
import tempfile

import pytest
from typer.main import get_command

from escort_mj.cli import app as every_command
from escort_mj.cli.app import _application, run_program
from tests.limits import files_up_to


def test_a_command_alone_is_as_among_all(monkeypatch: pytest.MonkeyPatch) -> None:
    every = get_command(every_command).commands
    for name, command in every.items():
        monkeypatch.setattr(sys, "argv", ["escort-mj", name, "sweep"])
        alone = get_command(_application()).commands
        assert [*alone] == [name]
        described = [(option.name, option.opts, option.help) for option in command.params]
        assert described == [(option.name, option.opts, option.help) for option in alone[name].params]


@pytest.mark.parametrize("arguments", [[], ["--help"], ["no-such-command"], ["--version", "run"]])
def test_without_a_command_all_are_there(arguments: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "argv", ["escort-mj", *arguments])
    assert _application() is every_command


def test_that_no_disk_has_room_is_one_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(tempfile, "tempdir", None)
    monkeypatch.setattr(sys.modules[run_program.__module__], "_application", lambda: tempfile.gettempdir)
    with pytest.raises(SystemExit, match="3"), files_up_to(0):
        run_program()
    assert capsys.readouterr().err.startswith("escort-mj: a temporary file: cannot be written: No usable")
