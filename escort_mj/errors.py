"""Errors: each error that a user can cause has a class, a message and an exit code."""

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
    """Return text as one line without control characters or workflow commands.

    The result is that of `visible`. In addition, `::` at the beginning, which would start a workflow command
    of GitHub, is separated.
    """
    return _COMMAND.sub(r"\1: ", visible(text))


def visible(text: str) -> str:
    """Return text without control characters.

    Line breaks and tabs become spaces. Other control characters, marks that change the direction of writing
    and halves of surrogate pairs become `?`. `##[`, which starts a workflow command anywhere, is separated.
    """
    return _OBEYED.sub("?", _BREAKS.sub(" ", text)).replace("##[", "# #[")


class EscortError(Exception):
    """Base class of all errors that escort_mj raises deliberately.

    Attributes:
        exit_code: Exit code of the command line for this error.
    """

    exit_code = 3


MOST_SHOWN = 20  # faults in words; beyond, something is wrong with the file as a whole


@dataclass(frozen=True)
class Fault:
    """One fault in an input file.

    Attributes:
        message: What was found and what is allowed, in one sentence.
        key: Key path such as `robots.overrides[1].mass`; empty for the file as a whole.
        line: 1-based line, or 0 if there is none (a command-line override).
        column: 1-based column, or 0.
        source: File name, or the origin of an override: `--set key=value`, or a key given in Python.
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


def _first_of(faults: Sequence[object]) -> str:
    """Return the first faults, one a line, and how many more there are."""
    more = len(faults) - MOST_SHOWN
    rest = [f"... and {more} more fault{'s' * (more > 1)}"] if more > 0 else []
    return "\n".join([*map(str, faults[:MOST_SHOWN]), *rest])


class ScenarioError(EscortError, ValueError):
    """An invalid scenario, with all its faults.

    Attributes:
        faults: All faults, in the order of the file.
    """

    exit_code = 2

    def __init__(self, faults: Sequence[Fault]) -> None:
        self.faults = tuple(faults)
        super().__init__(_first_of(self.faults))


class UsageError(EscortError, ValueError):
    """An invalid command or call, for example with a missing file or a folder of another kind."""

    exit_code = 2


class RobotError(UsageError):
    """A robot's model that does not exist, cannot be read, or cannot be driven."""


class OutsideError(RobotError):
    """A file outside of the folder that all files of a robot must be inside of.

    Attributes:
        file: The file.
    """

    def __init__(self, name: str, file: os.PathLike[str]) -> None:
        super().__init__(f"{name}: leads out of the robot's folder")
        self.name, self.file = name, file


class LogError(UsageError):
    """A log of real robots that cannot be judged, with all its faults.

    Attributes:
        faults: All faults, one sentence each.
    """

    def __init__(self, log: str | os.PathLike[str], faults: Sequence[str]) -> None:
        self.faults = tuple(faults)
        super().__init__(_first_of([one_line(f"{os.fspath(log)}: {fault}") for fault in self.faults]))


class NotLoggedError(EscortError, LookupError):
    """A signal that a log of real robots does not contain."""

    def __init__(self, name: str) -> None:
        super().__init__(f"the log does not contain {name}")


class PluginError(UsageError):
    """A plugin that does not exist, cannot be loaded, or is invalid."""


class PluginCallError(EscortError):
    """What a plugin did wrong when it was called, with its file and line."""


NO_PATH = (errno.ENAMETOOLONG, errno.ELOOP)
"""What the system says of a path that no file can have, wherever that is looked for."""
_PATH_AT_FAULT = frozenset(
    (errno.ENOENT, errno.ENOTDIR, errno.EISDIR, errno.EEXIST, errno.EACCES, errno.EPERM)
    + (*NO_PATH, errno.ETXTBSY, errno.EILSEQ)
)


class CompilerMissingError(UsageError):
    """A kernel must be compiled, but numba is not installed."""

    def __init__(self, why: str) -> None:
        super().__init__(f"{why}; numba would compile it: pip install 'escort-mj[compile]'")


class WriteError(EscortError, OSError):
    """A file that cannot be written. An earlier file of that name remains unchanged.

    The exit code is 2 if the path is wrong (no such folder, no permission), otherwise 3: the disk is full or
    read-only, a quota or limit is reached, or the device fails.

    Attributes:
        path: The file.
        reason: Message of the operating system.
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
    """MuJoCo stopped within a step, for example because its memory is too small."""


class RunFolderError(EscortError):
    """A run folder that cannot be read or written."""

    exit_code = 2


class BrokenRunError(RunFolderError):
    """A run whose folder became unwritable after the start (a full disk, a disconnected share)."""

    exit_code = 3


class RenderError(EscortError):
    """A video or figure that cannot be drawn. The run itself is complete."""
