"""Commands whose output nobody reads, or which have none to write to: their exit code stays their own."""

import os
import subprocess
import sys

import pytest

from escort_mj.cli.streams import lasting_streams, printable_json

SLOW = pytest.mark.slow
COMMAND = (sys.executable, "-m", "escort_mj")


def shell(line: str, folder, *arguments: str) -> int:
    """Exit code of the command in a line of a shell, where it stands as "$@"."""
    return subprocess.run(
        ["bash", "-c", line, "bash", *COMMAND, *arguments], cwd=folder, timeout=120, stderr=subprocess.DEVNULL
    ).returncode


@pytest.mark.slow_cases("no_reader")
@pytest.mark.parametrize(
    ("line", "arguments", "code"),
    [
        ('"$@" | true; exit ${PIPESTATUS[0]}', ("schema",), 0),
        pytest.param(
            '"$@" 2>&1 >/dev/null | true; exit ${PIPESTATUS[0]}', ("check", "nosuch.yaml"), 2, marks=SLOW
        ),
        ('"$@" 2>&-', ("run", "nosuch.yaml"), 2),
        pytest.param('"$@" 2>&-', ("check", "good.yaml"), 0, marks=SLOW),
        ('"$@" <&- >&- 2>&-', ("show", "."), 2),
    ],
    ids=["no_reader", "no_reader_of_errors", "closed_errors", "closed_errors_of_a_good_one", "all_closed"],
)
def test_the_exit_code_is_the_commands_own(line, arguments, code, tmp_path) -> None:
    (tmp_path / "good.yaml").write_text("name: good\nduration: 0.1\nrobots: {count: 2}\n")
    assert shell(line, tmp_path, *arguments) == code


def test_what_a_reader_that_left_would_get_is_dropped(monkeypatch) -> None:
    reading, writing = os.pipe()
    with open(writing, "w") as stream, monkeypatch.context() as patch:
        patch.setattr(sys, "stdout", stream)
        with lasting_streams():
            print("seen", flush=True)
            assert os.read(reading, 100) == b"seen\n"
            os.close(reading)
            print("dropped" * 100_000, flush=True)
        assert sys.stdout is stream


def test_json_for_terminals_is_the_same_json() -> None:
    text = '{"a": "##[error]\x9b\u2028"}'
    assert printable_json(text) == '{"a": "##\\u005berror]\\u009b\\u2028"}'
