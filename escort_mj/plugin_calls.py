"""Calls of what plugins bring: whatever goes wrong in one becomes one error that says where in the plugin.

A plugin computes and returns. While it is called, or loaded, it may not end the process, start threads or
other processes, send signals, print to standard output, warn, or change what the whole process shares, such
as the working directory. What Python lets it do against that is refused where it happens, or found afterwards
and put right; what takes too long is broken off.
"""

from __future__ import annotations

import _sitebuiltins
import _thread
import atexit
import ctypes
import math
import os
import signal
import sys
import sysconfig
import threading
import time
import traceback
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import partial
from threading import get_ident
from time import monotonic
from types import CodeType
from typing import Any

from escort_mj import stopping, supervised
from escort_mj.errors import NotLoggedError, PluginCallError, visible
from escort_mj.shared_state import Output, SharedState, is_shared

LOOK = 0.25  # s between two looks at calls that take long
ENDED = 3  # exit code of such a process
MOST = 2000  # characters of an error's text that are told
MODULES = "escort_mj_plugin_"
"""How the names of modules of plugin files begin."""

_PACKAGE = __name__.partition(".")[0]
_STANDARD = sysconfig.get_path("stdlib")
_REFUSED = {
    "os.fork": "starts a process",
    "os.forkpty": "starts a process",
    "os.posix_spawn": "starts a process",
    "os.spawn": "starts a process",
    "os.system": "starts a process",
    "subprocess.Popen": "starts a process",
    "os.exec": "replaces the process",
    "os.kill": "sends a signal",
    "os.killpg": "sends a signal",
    "signal.pthread_kill": "sends a signal",
    "os.chdir": "changes the working directory",
    "os.putenv": "changes the environment",
    "os.unsetenv": "changes the environment",
    "resource.prlimit": "changes limits of the process",
    "resource.setrlimit": "changes limits of the process",
    "gc.get_objects": "searches the memory of the process",
    "gc.get_referents": "searches the memory of the process",
    "gc.get_referrers": "searches the memory of the process",
    "sys.addaudithook": "watches the process",
}
"""What Python announces before it is done (PEP 578), in words."""
_CHANGES_FILES = frozenset(
    ("os.chmod", "os.link", "os.mkdir", "os.remove", "os.rename", "os.rmdir", "os.symlink", "os.truncate")
)
_REDEFINES = frozenset(("object.__setattr__", "object.__delattr__"))  # `__code__`, `__bases__` and the like
_WRITES = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND
_UNANNOUNCED = (
    (os, "_exit", "ends the process (os._exit)"),
    (os, "abort", "ends the process (os.abort)"),
    (_sitebuiltins.Quitter, "__call__", "ends the process (quit, exit), and closes standard input"),
    (atexit, "register", "has something called when the process ends"),
    (os, "closerange", "closes files of the process"),
    (os, "mkfifo", "writes, moves or removes files"),
    (os, "mknod", "writes, moves or removes files"),
    (os, "write", "writes to standard output"),
    (os, "writev", "writes to standard output"),
    (signal, "raise_signal", "sends a signal"),
    (threading, "_start_new_thread", "starts a thread"),
    (_thread, "start_new_thread", "starts a thread"),
)
"""What it does not announce."""
_exit = os._exit


class Trespass(BaseException):  # noqa: N818 - an `except Exception` of the plugin is not to catch it
    """What a plugin does and may not do."""


class _Call:
    """A call under way.

    Attributes:
        function: Which; None while a plugin is loaded or its parameters are checked.
        file: The plugin's file.
        loads: Whether it is loaded: modules that it imports may do what a plugin may not.
        outer: The call during which it was called; None if it was not.
        is_under_way: Whether it has not returned; one of a step is kept for the next.
        began: When [s].
        trespass: What it did and may not do, where it caught the error.
        overdue: Since when its time is over; infinite if it is not [s].
    """

    def __init__(self, function: Callable[..., Any] | None, file: str, loads: bool) -> None:
        self.function, self.file, self.loads = function, file, loads
        self.outer: _Call | None = None
        self.is_under_way = True
        self.began, self.trespass, self.overdue = monotonic(), "", math.inf


_calls: dict[int, _Call] = {}  # by thread
_late = threading.local()  # .words: of functions that took too long, by their code


@contextmanager
def waiting_once() -> Iterator[None]:
    """Call within no function again that took too long, but raise its error at once; a context manager."""
    _late.words = {}
    try:
        yield
    finally:
        del _late.words


def is_plugins(function: Callable[..., Any]) -> bool:
    """Return whether a function is a plugin's, or a user's, rather than one that ships."""
    return not str(getattr(function, "__module__", "")).startswith(f"{_PACKAGE}.")


def place_of(error: BaseException, function: Callable[..., Any]) -> str:
    """Where in a plugin an error was raised, and what it says: `custom_law.py:12: ZeroDivisionError: ...`."""
    return _told(error, function.__code__)


def blamed(error: BaseException) -> str:
    """Where in the file of a plugin an error was raised, as of `place_of`; empty if it was in none."""
    frames = traceback.walk_tb(error.__traceback__)
    own = [one for one, _ in frames if str(one.f_globals.get("__name__", "")).startswith(MODULES)]
    return _told(error, own[-1].f_code) if own else ""


def _told(error: BaseException, code: CodeType) -> str:
    file, line = code.co_filename, code.co_firstlineno
    lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == file]
    text = visible(text_of(error, file)[:MOST])
    words = " ".join(f"{type(error).__name__}: {text}".split()).removesuffix(":")
    if isinstance(error, AttributeError) and "can't set attribute" in words:
        words += "; arrays are written in place, as in robots.wish_velocity[:] = ..."
    return f"{file}:{lines[-1] if lines else line}: {words.removeprefix('Trespass: ')}"


def text_of(error: object, file: str) -> str:
    """Return the text of an error that a plugin raised; empty where it cannot be had.

    Args:
        error: Its methods may be the plugin's own.
        file: The plugin's.
    """
    text, call = "", begin(None, file)
    with suppress(BaseException):
        text = str(error)
    end(call)
    return text


@contextmanager
def calling(function: Callable[..., Any], of_log: bool = False) -> Iterator[None]:
    """Call a plugin's function within, and check there what it returned; a context manager.

    Args:
        function: Of the plugin; one that ships is called as it is.
        of_log: Whether it is asked of a log of real robots, which does not contain everything.

    Raises:
        PluginCallError: For whatever is raised within, `SystemExit` and the like too, and for whatever the
            plugin does and may not do; it names file and line.
        NotLoggedError: If a log of real robots lacks what is asked for; of a run, this is an error.
        KeyboardInterrupt: If a user interrupts it.
    """
    late: dict[Any, str] = getattr(_late, "words", {})
    try:
        if is_plugins(function):
            if words := late.get(function.__code__):
                raise PluginCallError(words)
            with confined(function.__code__.co_filename, function):
                yield
        else:
            yield
    except PluginCallError:
        raise
    except BaseException as error:  # `SystemExit` would end the program as if all were well
        if isinstance(error, KeyboardInterrupt) and stopping.is_users():
            raise
        if isinstance(error, NotLoggedError) and of_log:
            raise
        words = place_of(error, function)
        if supervised.too_long() in words:
            late[function.__code__] = words
        raise PluginCallError(words) from error


@contextmanager
def confined(file: str, function: Callable[..., Any] | None = None, loads: bool = False) -> Iterator[None]:
    """Run a plugin's code within, which may not do what ends or changes the process; a context manager.

    Args:
        file: The plugin's.
        function: What is called; None while the plugin is loaded or its parameters are checked.
        loads: Whether it is loaded.

    Raises:
        Trespass: For what the plugin did and may not do, unless another error is on its way.
    """
    _prepare()
    before, call = SharedState(loads, _refuse), begin(function, file, loads)
    try:
        yield
    except Trespass as error:
        error.args = (call.trespass,)
        raise
    finally:
        replaced = before.restored_builtins()
        end(call)
        changed = before.changed()
    if found := call.trespass or replaced or changed:
        raise Trespass(found)


@contextmanager
def watched() -> Iterator[list[str]]:
    """Simulate within, where plugins are called in every step; a context manager.

    Yields:
        Receives at the end, in words, what of that which the whole process shares is another now; it is put
        right again.
    """
    _prepare()
    before, found = SharedState(False, _refuse), list[str]()
    try:
        yield found
    finally:
        replaced, changed = before.restored_builtins(), before.changed()
        if replaced or changed:
            found.append(replaced or changed)


def begin(function: Callable[..., Any] | None, file: str, loads: bool = False) -> _Call:
    """Note that this thread calls a plugin's function; `end` ends it."""
    call, before = _Call(function, file, loads), _calls.get(get_ident())
    call.outer = before if before is not None and before.is_under_way else None
    _calls[get_ident()] = call
    if supervised.own_page is not None:
        supervised.own_page.tell(file if function is None else place_in(function))
    return call


def end(call: _Call) -> None:
    """Note that a call of this thread has ended."""
    thread = get_ident()
    if call.outer is None:
        _calls.pop(thread, None)
    else:
        _calls[thread] = call.outer
    if supervised.own_page is not None:
        supervised.own_page.tell("")


def step(function: Callable[..., Any], first: bool, call: Callable[[], Any]) -> Any:
    """Do what a plugin does in every step; all that it may not do is looked for once.

    Args:
        function: Of the plugin, which names it.
        first: Whether it is the first call of a mission.
        call: Calls the function.

    Returns:
        What the call returned.

    Raises:
        Trespass: For what it did and may not do.
    """
    if first:
        with confined(function.__code__.co_filename, function):
            returned = call()
        if supervised.own_page is not None:
            supervised.own_page.tell(place_in(function), timed=False)  # until another is called
        return returned
    if type(sys.stdout) is not Output and sys.stdout is not None:
        sys.stdout = Output(sys.stdout, _refuse)
    thread = get_ident()
    known = _calls.get(thread)
    outer = None
    if known is None or known.function is not function or known.is_under_way:
        outer = known if known is not None and known.is_under_way else None
        known = _calls[thread] = _Call(function, function.__code__.co_filename, False)
    known.began, known.is_under_way = monotonic(), True
    try:
        returned = call()
    except Trespass as error:
        error.args = (known.trespass,)
        raise
    finally:
        # It is kept for the next step: a new one would take longer than some laws.
        known.is_under_way = False
        if outer is not None:
            _calls[thread] = outer
        elif known.trespass:
            del _calls[thread]
    if known.trespass:
        raise Trespass(known.trespass)
    return returned


def place_in(function: Callable[..., Any]) -> str:
    """Where a function of a plugin begins, and its name."""
    return f"{function.__code__.co_filename}:{function.__code__.co_firstlineno}: {function.__qualname__}"


def _under_way() -> _Call | None:
    """The call of a plugin's function in which this thread is."""
    call = _calls.get(get_ident())
    return call if call is not None and call.is_under_way else None


def _refuse(words: str) -> None:
    """Raise an error if this thread is in a plugin's code.

    Raises:
        Trespass: Where it is.
    """
    call = _under_way()
    if call is not None:
        call.trespass = call.trespass or f"a plugin must not do this: it {words}"
        raise Trespass(call.trespass)


def _audit(event: str, arguments: tuple[Any, ...]) -> None:
    """Refuse what a plugin may not do, before Python does it."""
    if event in _REFUSED and (call := _under_way()) is not None:
        by_signal = sys._getframe(1).f_code.co_filename == stopping.__file__  # a user's second interrupt
        if not by_signal and (not call.loads or _is_own(call.file)):
            _refuse(_REFUSED[event])
    elif event in _CHANGES_FILES or (event == "open" and _writes(*arguments)):
        if (call := _under_way()) is not None and _is_own(call.file):
            _refuse("writes, moves or removes files")
    elif event in _REDEFINES and is_shared(arguments[0]):
        if (call := _under_way()) is not None and _is_own(call.file):
            _refuse(f"replaces {arguments[1]} of {getattr(arguments[0], '__qualname__', arguments[0])}")


def _writes(path: Any, _: Any, flags: Any) -> bool:
    """Whether a file is opened to be written, other than standard error and the one that keeps nothing."""
    return isinstance(flags, int) and bool(flags & _WRITES) and path not in (2, os.devnull, "/dev/stderr")


def _is_own(file: str) -> bool:
    """Whether a file does what is being done, by itself or through Python's library.

    A package may do it, and Python where it keeps what it has compiled of a module.
    """
    frame: Any = sys._getframe(2)
    while frame is not None and _is_pythons(frame.f_code.co_filename):
        if frame.f_code.co_name == "set_data":
            return False
        frame = frame.f_back
    return frame is not None and frame.f_code.co_filename == file


def _is_pythons(file: str) -> bool:
    """Whether a file is of Python's library."""
    return file.startswith((_STANDARD, "<frozen")) and "-packages" not in file


def _guard(module: Any, name: str, words: str) -> None:
    """Have a function of Python refuse to be called by plugins; of this, Python announces nothing."""
    usual = getattr(module, name)

    def guarded(*arguments: Any, **more: Any) -> Any:
        call, caller = _under_way(), sys._getframe(1).f_code.co_filename
        allowed = name.startswith("write") and arguments[:1] != (1,)
        if call is not None and not allowed and (not call.loads or _is_own(call.file)):
            libraries = module is atexit and caller != call.file  # they clean up
            if not libraries and caller != stopping.__file__:  # a user's second interrupt
                _refuse(words)
        return usual(*arguments, **more)

    setattr(module, name, guarded)


def _warnings_are_errors() -> None:
    """Make warnings that a plugin's file causes errors; that something will be taken away is none."""
    first = ("error", None, Warning, 0)
    known = [(each[0], each[1], each[2], each[4]) for each in warnings.filters if _is_of_plugins(each[3])]
    if first in known:
        return
    warnings.filterwarnings("error", module=MODULES)
    for one in (DeprecationWarning, PendingDeprecationWarning, FutureWarning, ImportWarning, ResourceWarning):
        warnings.filterwarnings("default", category=one, module=MODULES)


def _is_of_plugins(module: Any) -> bool:
    return module is not None and getattr(module, "pattern", module) == MODULES


_prepared = False
_preparing = threading.Lock()


def _prepare() -> None:
    """Watch what plugins do from now on, and how long it takes."""
    global _prepared
    _warnings_are_errors()
    if _prepared:
        return
    with _preparing:
        if _prepared:
            return
        sys.addaudithook(_audit)
        for module, name, words in _UNANNOUNCED:
            _guard(module, name, words)
        sys.unraisablehook = partial(_lost, sys.unraisablehook)
        threading.Thread(target=_watch, daemon=True, name="watch over plugins").start()
        _prepared = True


def _lost(otherwise: Callable[[Any], object], lost: Any) -> None:
    """Note an error that Python could only print, as in `__del__`, where a plugin raised it."""
    call, interrupts = _under_way(), issubclass(lost.exc_type, KeyboardInterrupt)
    if call is None or (interrupts and stopping.is_users()):
        otherwise(lost)
    else:
        words = f"raises {lost.exc_type.__name__} where nothing can catch it, as in __del__"
        call.trespass = call.trespass or f"a plugin must not do this: it {words}"


def _watch() -> None:
    """Break off calls that take too long; end a supervised process where they take no notice."""
    while True:
        time.sleep(LOOK)
        limit, now = supervised.timeout() or math.inf, time.monotonic()
        for thread, call in _calls.copy().items():
            if not call.is_under_way or now - call.began < limit:
                continue
            if math.isinf(call.overdue):
                call.overdue = now
                call.trespass = supervised.too_long()
                ctypes.pythonapi.PyThreadState_SetAsyncExc(ctypes.c_ulong(thread), ctypes.py_object(Trespass))
            elif supervised.own_page is not None and now - call.overdue > supervised.GRACE:
                supervised.own_page.tell(f"{_line_of(thread, call)}: {call.trespass}", timed=False)
                _exit(ENDED)


def _line_of(thread: int, call: _Call) -> str:
    """File and line of a plugin at which a thread is."""
    frame = sys._current_frames().get(thread)
    while frame is not None:
        if frame.f_code.co_filename == call.file:
            return f"{call.file}:{frame.f_lineno}"
        frame = frame.f_back
    return call.file
