"""What the process that workers are forked from imports first.

An interrupt kills that process, whatever it does. A worker that it had just forked is then known to no
command: it finds nothing of what it was to work with, and its error is not the user's.
"""

from __future__ import annotations

import os
import sys
from types import TracebackType

_SERVER = os.getpid()


def _report(kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> None:
    """Print an error, but for that of a worker whose forking process is gone."""
    if _SERVER in (os.getpid(), os.getppid()):
        sys.__excepthook__(kind, error, trace)


sys.excepthook = _report
