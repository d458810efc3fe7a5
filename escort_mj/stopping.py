"""Ctrl-C and a polite kill: what is under way ends in order, then `KeyboardInterrupt` ends what waits for it.

An interrupt is never a result. It passes through studies and searches as `KeyboardInterrupt`, and nothing of
the run that it hit is stored there; only the folder of that run says how far it came.
"""

from __future__ import annotations

import _thread
import atexit
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from types import FrameType
from typing import Any

SIGNALS = (signal.SIGINT, signal.SIGTERM)
EXIT_CODE = 130
PATIENCE = (
    1.0  # s within which a second signal is the same interrupt: `timeout` sends two, a terminal several
)
AGAIN = 0.02  # s after which an interrupt that was lost comes again

_mine = threading.local()


class Interrupted(KeyboardInterrupt):
    """An interrupt that says what is kept, and how to go on."""


@contextmanager
def keeping(words: Callable[[], str]) -> Iterator[None]:
    """Adds to an interrupt what is kept and how to go on; what was added further inside stays.

    Args:
        words: Says so; called when the interrupt has come.

    Raises:
        Interrupted: In place of a `KeyboardInterrupt` from within.
    """
    try:
        yield
    except Interrupted:
        raise
    except KeyboardInterrupt:
        raise Interrupted(words()) from None
    except Exception:
        if interrupted():
            raise Interrupted(words()) from None
        raise


def interrupted() -> bool:
    """Return whether the command of this process was interrupted: an error after that is the interrupt's."""
    return _command.first is not None and not _command.ended


def is_users() -> bool:
    """Return whether a `KeyboardInterrupt` that comes up here and now can be a user's: a signal raised it."""
    if threading.current_thread() is not threading.main_thread() or getattr(_mine, "reason", None):
        return False  # signals raise nothing in other threads, nor where they are deferred
    return signal.getsignal(signal.SIGINT) is not _command or interrupted()


def asked() -> str:
    """Whether what this thread is doing is to end: by which signal, or empty if it may go on."""
    if getattr(_mine, "deaf", False):
        return ""
    reason: Callable[[], str] | None = getattr(_mine, "reason", None)
    return reason() if reason is not None else ""


def end_with(unwanted: threading.Event) -> None:
    """Let this thread end its work once its results are no longer wanted; for the start of a thread.

    Args:
        unwanted: Set when that is so.
    """
    _mine.reason = lambda: "the thread that started it" if unwanted.is_set() else ""


@contextmanager
def deaf() -> Iterator[None]:
    """Within, `asked` is empty: for what machine code waits for, which cannot be left."""
    before, _mine.deaf = getattr(_mine, "deaf", False), True
    try:
        yield
    finally:
        _mine.deaf = before


@contextmanager
def deferred(hurry: Callable[[], None] | None = None) -> Iterator[None]:
    """Holds interrupts back while something ends in order; within, `asked` says that one has come.

    A second one, unless it comes at once, ends the process.

    Args:
        hurry: Called when the first one comes, to end what may be waited for.

    Raises:
        KeyboardInterrupt: At the end, if one has come; a handler of the signal gets it before.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        if asked():
            raise KeyboardInterrupt
        return
    noted: list[tuple[int, float]] = []

    def note(number: int, frame: FrameType | None) -> None:
        if noted and time.monotonic() - noted[0][1] > PATIENCE:
            signal.signal(number, signal.SIG_DFL)
            os.kill(os.getpid(), number)
        noted.append((number, time.monotonic()))
        if hurry is not None and len(noted) == 1:
            hurry()

    before = {
        number: signal.signal(number, note)
        for number in SIGNALS
        if signal.getsignal(number) not in (signal.SIG_IGN, None)
    }
    reason = getattr(_mine, "reason", None)
    _mine.reason = lambda: signal.Signals(noted[0][0]).name if noted else ""
    try:
        yield
    finally:
        _mine.reason = reason
        for number, handler in before.items():
            signal.signal(number, handler)
        if noted:
            signal.raise_signal(noted[0][0])
            raise KeyboardInterrupt


def _interrupt_later(thread: int) -> None:
    """Interrupt a thread after a moment."""
    time.sleep(AGAIN)
    signal.pthread_kill(thread, signal.SIGINT)


class _Command:
    """How the process of a command takes signals: the first is a `KeyboardInterrupt`, a later one ends it."""

    def __init__(self) -> None:
        self.first: float | None = None
        self.ended = False

    def __call__(self, number: int, frame: FrameType | None) -> None:
        now = time.monotonic()
        if self.first is not None and now - self.first <= PATIENCE:
            return
        if self.first is not None or self.ended:
            os._exit(EXIT_CODE)  # workers and compilers end when they miss this process
        self.first = now
        raise KeyboardInterrupt

    def unraisable(self, lost: Any) -> None:
        """Raise an interrupt again if Python could only print it, as in `__del__`."""
        if not issubclass(lost.exc_type, KeyboardInterrupt):
            sys.__unraisablehook__(lost)
        elif not self.ended:
            self.first = None
            # Here, it would be lost, as it would be while a thread of `threading` is waited for to start.
            main = threading.main_thread().ident
            assert main is not None, "it has started"
            _thread.start_new_thread(_interrupt_later, (main,))


_command = _Command()


def command(run: Callable[[], None]) -> None:
    """Run a command, for which this process was started: an interrupt becomes one line and exit code 130.

    It is one also where the process was started to ignore signals, as shells do with what runs in the
    background.

    Args:
        run: The command; what it is interrupted with says what is kept.
    """
    global _command
    _command = _Command()
    told = _listening()
    try:
        for number in SIGNALS:
            signal.signal(number, _command)
        sys.unraisablehook = _command.unraisable
        signal.pthread_sigmask(signal.SIG_UNBLOCK, SIGNALS)  # `supervise` keeps them until they are heard
        run()
    except BaseException as end:
        interrupt = _interrupt_in(end)
        if interrupt is None:
            raise
        kept = str(interrupt) if isinstance(interrupt, Interrupted) else "the same command begins again"
        if sys.stderr is not None:
            with suppress(OSError, ValueError):
                print(f"escort-mj: interrupted; {kept}", file=sys.stderr)
        atexit._run_exitfuncs()
        for stream in (sys.stdout, sys.stderr):
            with suppress(OSError, ValueError, AttributeError):  # closed, or its reader has left
                stream.flush()
        os._exit(EXIT_CODE)  # where it passed an `exec` of text, Python itself would end by SIGINT instead
    finally:
        _command.ended = True
        signal.set_wakeup_fd(-1)
        os.close(told)


def fill_standard_files() -> None:
    """Open the null device for standard streams that are closed, so that no other file gets their number."""
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            while os.open(os.devnull, os.O_RDWR) < number:  # the lowest free number is given
                pass


def _listening() -> int:
    """Start a thread that hears signals while the main one is in machine code, where Python's handlers wait.

    Returns:
        The end of a pipe to which Python writes them; closing it ends the thread.
    """
    fill_standard_files()
    heard, told = os.pipe()
    os.set_blocking(told, False)
    signal.set_wakeup_fd(told, warn_on_full_buffer=False)
    threading.Thread(target=_listen, args=(heard,), daemon=True).start()
    return told


def _listen(heard: int) -> None:
    """End the process at a second signal, unless its handler does so in time."""
    first: float | None = None
    with open(heard, "rb", buffering=0) as signals:
        while number := signals.read(1):
            now = time.monotonic()
            if number[0] not in SIGNALS:
                continue
            if first is not None and now - first > PATIENCE:
                time.sleep(PATIENCE)
                os._exit(EXIT_CODE)
            first = now if first is None else first


def _interrupt_in(end: BaseException) -> KeyboardInterrupt | None:
    """The interrupt that a process ends with, which libraries turn into an exit or an error of their own."""
    cause: BaseException | None = end
    if isinstance(end, SystemExit) and end.code != EXIT_CODE:
        return None
    if isinstance(end, Exception) and not interrupted():
        return None
    while cause is not None and not isinstance(cause, KeyboardInterrupt):
        cause = cause.__cause__ or cause.__context__
    return cause


def raise_if_interrupted() -> None:
    """Lets go on only what was not interrupted: some libraries make an interrupt an error of their own.

    Raises:
        KeyboardInterrupt: If an interrupt has come to the command.
    """
    if interrupted():
        raise KeyboardInterrupt
