"""Wrong commands: one message of what is wrong, exit code 2, and nothing else happens."""

import shlex
from pathlib import Path

import pytest

from tests.corpus import assert_said, wrong
from tests.test_cli import command

__all__ = ["command"]


@pytest.mark.parametrize("case", wrong(Path(__file__).with_name("wrong")))
def test_a_wrong_command_is_one_message(command, make_run, tmp_path: Path, case) -> None:
    make_run(samples=5).rename(tmp_path / "run")
    before = {*tmp_path.rglob("*")}
    code, out, err = command(*shlex.split(case["text"]))
    assert (code, out) == (2, "")
    assert_said(" ".join(err.replace("│", " ").split()), case["said"])
    assert {*tmp_path.rglob("*")} == before
