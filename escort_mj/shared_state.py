"""What the whole process shares, such as standard streams, signals and Python's own functions.

It is looked at before and after code that must not change it, and put right.
"""

from __future__ import annotations

import builtins
import gc
import operator
import os
import random
import signal
import sys
import threading
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from functools import lru_cache
from types import FunctionType, ModuleType
from typing import Any, TextIO

import numpy as np

_PACKAGE = __name__.partition(".")[0]
_OWN = f"{_PACKAGE}."  # how names of this program's modules begin
_LIBRARIES = (
    *("builtins", "json", "math", "numpy", "numpy.linalg", "numpy.random"),
    *("os", "os.path", "random", "signal", "sys", "time", "warnings"),
)
_LISTS: tuple[list[Any], ...] = (gc.callbacks, sys.path, sys.meta_path, sys.path_hooks, sys.argv)
_WRAPPED = (classmethod, staticmethod, property)
_SIGNALS = sorted(int(number) for number in signal.valid_signals() if number < 32)


class Output:
    """Standard output, on which plugins may not write.

    Args:
        stream: What it is otherwise.
        refuse: Raises an error of these words where a plugin runs.
    """

    def __init__(self, stream: TextIO, refuse: Callable[[str], None]) -> None:
        self.stream, self.refuse = stream, refuse

    def write(self, text: str, /) -> int:
        """Write, but not for a plugin."""
        self.refuse(
            "prints to standard output, which is the command's; print(..., file=sys.stderr) is allowed"
        )
        return self.stream.write(text)

    def __getattr__(self, name: str) -> Any:
        if name in ("buffer", "close", "detach", "writelines"):
            self.refuse("writes to standard output, or closes it")
        return getattr(self.stream, name)


def _streams() -> tuple[Any, ...]:
    """The standard streams, whatever threads have put around them."""
    streams = sys.stdin, sys.stdout, sys.stderr
    return tuple(each.stream if isinstance(each, Output) else each for each in streams)


class SharedState:
    """What the whole process shares, as it was before a plugin's code ran.

    Args:
        loading: Whether the plugin is loaded, which may add modules, filters and functions of its own.
        refuse: See `Output`.
    """

    def __init__(self, loading: bool, refuse: Callable[[str], None]) -> None:
        self._loading = loading
        self._builtins = builtins.__dict__.copy()
        self._streams = sys.stdin, sys.stdout, sys.stderr
        self._output = Output(sys.stdout, refuse) if sys.stdout is not None else None
        if self._output is not None and not isinstance(sys.stdout, Output):
            sys.stdout = self._output
        self._now = _streams()
        self._copies = [None if file is None else os.dup(number) for number, file in enumerate(_files())]
        self._files, self._folder, self._environment = _files(), _folder(), dict(os.environ)
        self._errors, self._numpy, self._python = np.geterr(), np.random.get_state(), random.getstate()
        self._handlers, self._timer = _handlers(), signal.getitimer(signal.ITIMER_REAL)
        self._filters = list(warnings.filters)
        self._limits = sys.getrecursionlimit(), sys.gettrace(), sys.getprofile()
        self._lists, self._blocked = [[*one] for one in _LISTS], _blocked()
        every = sys.modules.copy()
        self._modules = {name: every[name] for name in every if not loading or name.startswith(_OWN)}
        self._members = [(one, vars(one).copy()) for one in _shared_modules()]

    def restored_builtins(self) -> str:
        """What of Python's own functions the plugin replaced, in words, put right again; empty for nothing.

        It calls none of them, and comes before all that does.
        """
        own, found = builtins.__dict__, ""
        for name, value in self._builtins.items():
            if name not in own or own[name] is not value:
                own[name] = value
                found = f"a plugin must not do this: it replaces {name} of Python"
        return found

    def changed(self) -> str:
        """What the plugin changed, in words, put right again; empty for nothing."""
        replaced = self._put_back()  # what follows calls functions of these modules
        found = []
        if _streams() != self._now:
            found.append("replaces a standard stream")
        sys.stdin, sys.stdout, sys.stderr = self._streams
        if _files() != self._files:
            found.append("closes or redirects a standard stream")
            for number, copy in enumerate(self._copies):
                if copy is not None:
                    os.dup2(copy, number)
        for copy in self._copies:
            if copy is not None:
                os.close(copy)
        if _folder() != self._folder:
            found.append("changes the working directory")
            with suppress(OSError):
                os.chdir(self._folder)
        if dict(os.environ) != self._environment:
            found.append("changes the environment")
            os.environ.clear()
            os.environ.update(self._environment)
        if np.geterr() != self._errors:
            found.append(
                "changes how NumPy reports errors (np.seterr); np.errstate does so for some lines only"
            )
            np.seterr(**self._errors)
        if not _same_state(np.random.get_state(), self._numpy) or random.getstate() != self._python:
            found.append("seeds or draws shared random numbers; numpy.random.default_rng(seed) has its own")
            np.random.set_state(self._numpy)
            random.setstate(self._python)
        found += self._changed_signals()
        if (sys.getrecursionlimit(), sys.gettrace(), sys.getprofile()) != self._limits:
            found.append("changes the interpreter")
            sys.setrecursionlimit(self._limits[0])
            sys.settrace(self._limits[1])
            sys.setprofile(self._limits[2])
        for one, before in zip(_LISTS, self._lists, strict=True):
            if not all(each in one for each in before) or any(map(_is_plugins, one)):
                found.append("changes what Python calls or imports (gc.callbacks, sys.path and the like)")
                one[:] = before
        strict = [each for each in warnings.filters if each[0] == "error" and each not in self._filters]
        if strict or (not self._loading and warnings.filters != self._filters):
            found.append("changes what becomes of warnings")
            warnings.filters[:] = self._filters  # type: ignore[index]
        if gone := {name: one for name, one in self._modules.items() if sys.modules.get(name) is not one}:
            sys.modules.update(gone)
        found += ["takes modules away"] * bool(gone) + replaced
        return f"a plugin must not do this: it {found[0]}" if found else ""

    def _put_back(self) -> list[str]:
        """Members of modules that are others now, in words, put right again."""
        found = []
        for module, before in self._members:
            if _is_same(before, vars(module)):
                continue
            for name, value in _replaced(before, vars(module)):
                found.append(f"replaces {module.__name__}.{name}")
                setattr(module, name, value)
            for name in _hiding(before, vars(module)) if isinstance(module, type) else ():
                found.append(f"replaces {module.__name__}.{name}")
                delattr(module, name)
        return found

    def _changed_signals(self) -> Iterator[str]:
        """Handlers and timers of signals that are others now, put right again."""
        if threading.current_thread() is not threading.main_thread():
            return
        for number, handler in self._handlers.items():
            if signal.getsignal(number) != handler:
                yield "handles signals"
                signal.signal(number, handler)
        if _blocked() != self._blocked:
            yield "blocks signals"
            signal.pthread_sigmask(signal.SIG_SETMASK, self._blocked)
        if signal.getitimer(signal.ITIMER_REAL)[0] > self._timer[0]:
            yield "sets a timer"
            signal.setitimer(signal.ITIMER_REAL, 0.0)


def _is_plugins(function: Any) -> bool:
    """Whether a plugin's file defines a function; libraries leave some of their own to be called."""
    return str(getattr(function, "__module__", "")).startswith(f"{_PACKAGE}_plugin_")


def is_shared(one: Any) -> bool:
    """Whether a function or class, or the class of anything else, is Python's, NumPy's or this program's."""
    kind = one if isinstance(one, type | FunctionType) else type(one)
    module = str(getattr(kind, "__module__", ""))  # types that are being made have none yet
    return module in _LIBRARIES or module.startswith(_OWN)


def _files() -> list[tuple[int, int] | None]:
    """What the standard files are."""
    found: list[tuple[int, int] | None] = []
    for number in range(3):
        try:
            status = os.fstat(number)
            found.append((status.st_dev, status.st_ino))
        except OSError:
            found.append(None)
    return found


def _folder() -> str:
    """The working directory; empty where it is gone."""
    try:
        return os.getcwd()
    except OSError:
        return ""


def _handlers() -> dict[int, Any]:
    """How signals are handled that Python can handle."""
    known = ((number, signal.getsignal(number)) for number in _SIGNALS)
    return {number: handler for number, handler in known if handler is not None}


def _blocked() -> set[int]:
    """Signals that this thread does not receive."""
    return {*signal.pthread_sigmask(signal.SIG_BLOCK, ())}


def _same_state(one: Any, other: Any) -> bool:
    """Whether two states of NumPy's random numbers are the same."""
    return bool(one[2:] == other[2:] and np.array_equal(one[1], other[1]))


def _shared_modules() -> list[Any]:
    """Modules and, of this package, their classes whose functions a plugin must not replace."""
    names = (*_LIBRARIES, *(name for name in sys.modules.copy() if name.startswith(_OWN)))
    modules = [module for name in names if isinstance(module := sys.modules.get(name), ModuleType)]
    ours = (module for module in modules if module.__name__.startswith(_PACKAGE))
    return [*modules, *(kind for module in ours for kind in _classes_of(module, len(vars(module))))]


@lru_cache(maxsize=4096)
def _classes_of(module: ModuleType, size: int) -> list[type]:
    """Classes that a module defines; worked out again where it has another number of members."""
    every = (value for value in vars(module).values() if isinstance(value, type))
    return [value for value in every if value.__module__ == module.__name__]


def _is_same(before: Mapping[str, Any], now: Mapping[str, Any]) -> bool:
    """Whether a module or class has the same members."""
    return len(before) == len(now) and all(map(operator.is_, before.values(), now.values()))


def _is_method(value: Any) -> bool:
    """Whether a member of a module or class is called, or looks like one that is."""
    return callable(value) or isinstance(value, _WRAPPED)


def _replaced(before: Mapping[str, Any], now: Mapping[str, Any]) -> list[tuple[str, Any]]:
    """Functions, classes and constants of a module or class that are others now, by name, as they were."""
    return [
        (name, value)
        for name, value in before.items()
        if now.get(name) is not value
        and (_is_method(value) or name.isupper())
        and not name.startswith("__pydantic")  # which it makes when they are first asked for
    ]


def _hiding(before: Mapping[str, Any], now: Mapping[str, Any]) -> list[str]:
    """Names of methods that a class has only now, and that hide what its bases or instances have."""
    return [name for name in now.keys() - before.keys() if _is_method(now[name])]
