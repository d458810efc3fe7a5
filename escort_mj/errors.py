"""The error tree: every fault a user can cause has one class, one message and one exit code."""

from __future__ import annotations

import errno
import os
import re
from collections.abc import Sequence
from dataclasses import dataclass

_BREAKS = re.compile("[\t-\r\x1c-\x1e\x85\u2028\u2029]+")
_OBEYED = re.compile("[\0-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069\ud800-\udfff]")
_COMMAND = re.compile(r"^(\s*):(?=:)")  # of GitHub's workflows


def one_line(text: str) -> str:
    """Return text as one line that terminals and the runners of GitHub's workflows only show.

    It is what `visible` returns, and `::` at its beginning, which would begin a workflow command, is pulled
    apart.
    """
    return _COMMAND.sub(r"\1: ", visible(text))


def visible(text: str) -> str:
    """Return text without control characters.

    Line breaks and tabs become spaces; other control characters, marks that turn the direction of writing and
    halves of surrogate pairs become `?`. `##[`, a workflow command wherever it stands, is pulled apart.
    """
    return _OBEYED.sub("?", _BREAKS.sub(" ", text)).replace("##[", "# #[")


class EscortError(Exception):
    """Root of every error that escort_mj raises on purpose.

    Attributes:
        exit_code: What the command line exits with when this error reaches it.
    """

    exit_code = 3


MOST_SHOWN = 100  # faults in words; beyond, something is wrong with the file as a whole


@dataclass(frozen=True)
class Fault:
    """One thing wrong with an input file.

    Attributes:
        message: What was found and what is allowed, in one sentence.
        key: Key path such as `robots.overrides[1].mass`; empty for the file as a whole.
        line: 1-based line, or 0 where there is none (a command-line override).
        column: 1-based column, or 0.
        source: File name, or what set it beside the file: `--set key=value`, or a key given in Python.
    """

    message: str
    key: str = ""
    line: int = 0
    column: int = 0
    source: str = ""

    def __str__(self) -> str:
        place = self.source
        if self.line:
            place += f":{self.line}:{self.column}"
        if place and self.key.startswith(place):  # a key that was set is its own place
            place = ""
        return one_line(": ".join(part for part in (place, self.key, self.message) if part))


class ScenarioError(EscortError, ValueError):
    """A scenario that cannot run as written; carries all its faults at once.

    Attributes:
        faults: Every fault found, in the order of the file.
    """

    exit_code = 2

    def __init__(self, faults: Sequence[Fault]) -> None:
        self.faults = tuple(faults)
        lines = [str(fault) for fault in self.faults[:MOST_SHOWN]]
        if more := len(self.faults) - len(lines):
            lines.append(f"... and {more} more faults")
        super().__init__("\n".join(lines))


class UsageError(EscortError, ValueError):
    """A command or call that cannot be carried out as asked (missing file, foreign folder ...)."""

    exit_code = 2


class PluginError(UsageError):
    """A plugin that is not there, cannot be loaded, or is not what it should be."""


_PATH_AT_FAULT = frozenset(
    (errno.ENOENT, errno.ENOTDIR, errno.EISDIR, errno.EEXIST, errno.EACCES, errno.EPERM)
    + (errno.ENAMETOOLONG, errno.ELOOP, errno.ETXTBSY)
)


class CompilerMissingError(UsageError):
    """Something has to be compiled, and numba is not installed."""

    def __init__(self, why: str) -> None:
        super().__init__(f"{why}; numba would compile it: pip install 'escort-mj[compile]'")


class WriteError(EscortError, OSError):
    """A file that cannot be written; an earlier file of that name stays as it was.

    Exit code 2 where its path is at fault (no such folder, no permission), else 3: the disk is full or
    read-only, a quota or a limit is reached, the device fails.

    Attributes:
        path: The file.
        reason: What the system says.
    """

    def __init__(
        self, path: str | os.PathLike[str], reason: OSError | str, exit_code: int | None = None
    ) -> None:
        words = reason if isinstance(reason, str) else reason.strerror or str(reason)
        if exit_code is None:
            known = isinstance(reason, OSError) and reason.errno in _PATH_AT_FAULT
            exit_code = 2 if known else 3
        super().__init__(f"{os.fspath(path)}: cannot be written: {words}")
        self.path, self.reason, self.exit_code = path, words, exit_code

    def __reduce__(self) -> tuple[type[WriteError], tuple[object, ...]]:
        return WriteError, (self.path, self.reason, self.exit_code)


class MujocoError(EscortError):
    """MuJoCo gave up in the middle of a step, as where its memory is too small."""


class RunFolderError(EscortError):
    """A run folder that cannot be read or written."""

    exit_code = 2


class BrokenRunError(RunFolderError):
    """A run that had begun and whose folder can no longer be written (a full disk, a share that is gone)."""

    exit_code = 3


class RenderError(EscortError):
    """A video or picture that could not be drawn; the run itself is not lost."""
