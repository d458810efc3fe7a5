"""Standard output and error that a command can always write to, and lines that are safe to print."""

from __future__ import annotations

import contextlib
import io
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, TextIO

import typer

from escort_mj.errors import one_line
from escort_mj.stopping import fill_standard_files

_OBEYED = (*range(0x7F, 0xA0), *range(0x2028, 0x202F), *range(0x2066, 0x206A))
ESCAPED = {code: f"\\u{code:04x}" for code in _OBEYED}


@dataclass
class Output:
    """How much the present command prints.

    Attributes:
        quiet: Whether it prints errors and failed verdicts only.
        verbose: Whether it names its stages with their times, and prints tracebacks.
        json: Whether it prints one JSON document, and no text.
    """

    quiet: bool = False
    verbose: bool = False
    json: bool = False


OUTPUT = Output()


def say(line: str, err: bool = False) -> None:
    """Print one line for people, whatever text of a user's is in it.

    Args:
        line: What to print; made safe by `errors.one_line`.
        err: Whether it goes to standard error.
    """
    typer.echo(one_line(line), err=err)


def tell(line: str) -> None:
    """Print one line of a result at once, unless the command prints JSON."""
    if not OUTPUT.json:
        say(line)


def printable_json(text: str) -> str:
    """Return JSON text with the characters escaped that terminals or GitHub's runners would obey."""
    return text.translate(ESCAPED).replace("##[", "##\\u005b")


class _Lasting(io.FileIO):
    """A file descriptor whose reader may leave: what is written after that is dropped."""

    def write(self, data: Any, /) -> int:
        try:
            return super().write(data) or 0
        except BrokenPipeError:
            return len(data)


@contextlib.contextmanager
def lasting_streams() -> Iterator[None]:
    """Make standard streams that are closed, or whose reader leaves (`| head`), take text and drop it.

    A command goes on to its end and returns its own exit code. Streams that were closed before the start lead
    to the null device, so that no file of a run gets their number.
    """
    fill_standard_files()
    before = sys.stdout, sys.stderr
    streams = sys.stdout, sys.stderr = [_lasting(stream, number) for number, stream in enumerate(before, 1)]
    try:
        yield
    finally:
        for stream in streams:  # a plugin may have put others in their place
            stream.flush()
        sys.stdout, sys.stderr = before


def _lasting(stream: TextIO | None, number: int) -> TextIO:
    """Return a stream as the one given, or as the one of a number where that is closed."""
    errors = "backslashreplace"
    if stream is None:
        return io.TextIOWrapper(io.BufferedWriter(_Lasting(number, "w", closefd=False)), "utf-8", errors)
    try:
        raw = _Lasting(stream.fileno(), "w", closefd=False)
    except OSError:  # a stream of no file, as tests have
        return stream
    stream.flush()
    return io.TextIOWrapper(
        io.BufferedWriter(raw),
        stream.encoding,
        errors,
        line_buffering=getattr(stream, "line_buffering", False),
    )
