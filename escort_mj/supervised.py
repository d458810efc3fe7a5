"""A command in a process of its own: however that ends, it is told, and the exit code is not 0 by mistake.

Not all that a plugin may do can be prevented: signals, an exit in machine code, a read where it may not. The
process that a user starts therefore only waits. The command says in shared memory which code of a plugin it
calls, and with what code it ends; a process that ends without that has been ended.
"""

from __future__ import annotations

import mmap
import os
import signal
import struct
import sys
import time
from collections.abc import Callable
from pathlib import Path

BROKEN, INTERRUPTED = 3, 130
TIMEOUT = "ESCORT_MJ_PLUGIN_TIMEOUT"
"""Environment variable: how long a call of a plugin may take [s]; 0 for any time."""
USUAL_TIMEOUT = 60.0  # s
GRACE = 5.0  # s after which a process is ended in which a call has not taken notice that its time is over
LOOK = 0.5  # s between two looks at calls that take long
LEAVING = 20.0  # s that a process may take to end once its command has
FORWARDED = (signal.SIGINT, signal.SIGTERM)

own_page: Page | None = None
"""Where this process says what it does; None if nobody reads it."""

_SIZE = 4096
_HEAD = struct.Struct("<iid")  # 1 once the command has ended, its exit code, when a call began [s]


class Page:
    """What a process is doing, in memory that another one reads."""

    def __init__(self, file: int = -1) -> None:
        """Share memory with the processes that are forked from this one, or through a file.

        Args:
            file: Descriptor of the file; -1 for none.
        """
        self._memory = mmap.mmap(file, _SIZE)

    def tell(self, words: str, timed: bool = True) -> None:
        """Say which code of a plugin is called; empty for none.

        Args:
            words: Its file and line.
            timed: Whether it is to return within the time for a call.
        """
        ended, code, _ = _HEAD.unpack_from(self._memory)
        text = words.encode("utf-8", "replace")[: _SIZE - _HEAD.size - 1] + b"\0"
        self._memory[_HEAD.size : _HEAD.size + len(text)] = text
        _HEAD.pack_into(self._memory, 0, ended, code, time.monotonic() if words and timed else 0.0)

    def end(self, code: int) -> None:
        """Say that the command has ended with an exit code."""
        _HEAD.pack_into(self._memory, 0, 1, code, 0.0)

    @property
    def code(self) -> int | None:
        """The exit code of the command; None before its end."""
        ended, code, _ = _HEAD.unpack_from(self._memory)
        return code if ended else None

    @property
    def words(self) -> str:
        """Which code of a plugin is called."""
        text = self._memory[_HEAD.size :]
        return text[: text.index(0)].decode("utf-8", "replace")

    @property
    def overdue(self) -> bool:
        """Whether a call takes so long that the process itself does not break it off."""
        began, limit = _HEAD.unpack_from(self._memory)[2], timeout()
        return bool(limit and began and time.monotonic() - began > limit + GRACE + LOOK)


def page_in(path: Path) -> Page:
    """Return the page that a file holds, which another process made or is to read.

    Args:
        path: The file; it is made where it is not there.
    """
    with open(path, "a+b") as file:
        file.truncate(_SIZE)
        return Page(file.fileno())


def timeout() -> float:
    """Return how long a call of a plugin may take [s]; 0 for any time."""
    try:
        return max(float(os.environ.get(TIMEOUT, USUAL_TIMEOUT)), 0.0)
    except ValueError:
        return USUAL_TIMEOUT


def too_long() -> str:
    """What is wrong with a call that takes too long, in words."""
    return f"takes longer than {timeout():g} s; {TIMEOUT} sets another limit"


def ending(status: int) -> str:
    """How a process ended, in words, by its exit code, or minus the number of the signal."""
    if status >= 0:
        return f"exit code {status}"
    known = -status in {*signal.Signals}
    return f"killed by {signal.Signals(-status).name if known else f'signal {-status}'}"


def told(words: str, status: int) -> str:
    """What ended a process, in words: what it called, and how it ended."""
    if "takes longer than" in words or not words:
        return words or f"the process ended: {ending(status)}"
    return f"{words}: the process ended while this was called: {ending(status)}"


def supervise(run: Callable[[Page], None]) -> None:
    """Run a command in a process that is forked, and end as it does.

    Args:
        run: The command; it returns, or raises an error, in the other process. Signals are blocked there.
    """
    page = Page()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {*FORWARDED, signal.SIGCHLD})
    for number in FORWARDED:
        signal.signal(number, lambda *_: None)  # or it would be lost where the shell has it ignored
    parent, child = os.getpid(), os.fork()
    if not child:
        _die_with(parent)
        signal.pthread_sigmask(signal.SIG_SETMASK, {*before, *FORWARDED})
        run(page)
        return
    status = _wait(child, page)
    code = page.code
    if code is None and status != INTERRUPTED:
        print(f"escort-mj: {told(page.words, status)}", file=sys.stderr)
        code = BROKEN
    os._exit(INTERRUPTED if code is None else code)


def _wait(child: int, page: Page) -> int:
    """Wait for a process, and pass signals on to it.

    Returns:
        Its exit code, or minus the number of the signal that killed it.
    """
    left = LEAVING
    while True:
        if signal_ := signal.sigtimedwait({*FORWARDED, signal.SIGCHLD}, LOOK):
            if signal_.si_signo in FORWARDED:
                os.kill(child, signal_.si_signo)
        else:
            left -= LOOK * (page.code is not None)
            if page.overdue:
                page.tell(f"{page.words}: {too_long()}", timed=False)
            if left <= 0.0 or "takes longer than" in page.words:
                os.kill(child, signal.SIGKILL)
        ended, status = os.waitpid(child, os.WNOHANG)
        if ended:
            return os.waitstatus_to_exitcode(status)


def _die_with(parent: int) -> None:
    """End this process when the one that waits for it is killed."""
    if sys.platform == "linux":
        import ctypes

        ctypes.CDLL(None).prctl(1, signal.SIGKILL)
    if os.getppid() != parent:
        os._exit(INTERRUPTED)
