"""Calls of what plugins bring: whatever goes wrong in one becomes one error that says where in the plugin."""

from __future__ import annotations

import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from escort_mj import stopping
from escort_mj.errors import NotLoggedError, PluginCallError

_PACKAGE = __name__.partition(".")[0]


def is_plugins(function: Callable[..., Any]) -> bool:
    """Return whether a function is a plugin's, or a user's, rather than one that ships."""
    return not str(getattr(function, "__module__", "")).startswith(f"{_PACKAGE}.")


def place_of(error: BaseException, function: Callable[..., Any]) -> str:
    """Where in a plugin an error was raised, and what it says: `custom_law.py:12: ZeroDivisionError: ...`."""
    file = function.__code__.co_filename
    lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == file]
    line = lines[-1] if lines else function.__code__.co_firstlineno
    words = " ".join(f"{type(error).__name__}: {error}".split()).removesuffix(":")
    if isinstance(error, AttributeError) and "can't set attribute" in words:
        words += "; arrays are written in place, as in robots.tau[:] = ..."
    return f"{file}:{line}: {words}"


@contextmanager
def calling(function: Callable[..., Any]) -> Iterator[None]:
    """Call a plugin's function within, and check there what it returned; a context manager.

    Args:
        function: Of the plugin.

    Raises:
        PluginCallError: For whatever is raised within, `SystemExit` and the like too; it names file and line.
        NotLoggedError: If a log of real robots does not contain what is asked for.
        KeyboardInterrupt: If a user interrupts it.
    """
    try:
        yield
    except (NotLoggedError, PluginCallError):
        raise
    except BaseException as error:  # `SystemExit` would end the program as if all were well
        if isinstance(error, KeyboardInterrupt) and stopping.is_users():
            raise
        raise PluginCallError(place_of(error, function)) from error
