"""Where in a plugin an error was raised."""

from __future__ import annotations

import traceback
from collections.abc import Callable
from typing import Any


def place_of(error: BaseException, function: Callable[..., Any]) -> str:
    """Where in a plugin an error was raised, and what it says: `custom_law.py:12: ZeroDivisionError: ...`."""
    file = function.__code__.co_filename
    lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == file]
    line = lines[-1] if lines else function.__code__.co_firstlineno
    words = " ".join(f"{type(error).__name__}: {error}".split())
    if isinstance(error, AttributeError) and "can't set attribute" in words:
        words += "; arrays are written in place, as in robots.tau[:] = ..."
    return f"{file}:{line}: {words}"
