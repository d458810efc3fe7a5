"""Which process writes a run, and whether it still lives."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any


def identify() -> dict[str, Any]:
    """What tells this process from every other one, those that get its number later among them."""
    return {"pid": os.getpid(), "process_start": _start(os.getpid())}


def alive(identity: Mapping[str, Any]) -> bool:
    """Whether the process of an identity still runs."""
    try:
        pid = int(identity.get("pid") or -1)
    except (TypeError, ValueError):
        return False
    if pid <= 0:
        return False
    try:
        os.kill(pid, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except PermissionError:  # it runs, as another user
        pass
    return _start(pid) == identity.get("process_start")


def _start(pid: int) -> str | None:
    """When a process started: the machine's boot and the kernel's ticks since; None where nothing tells.

    A zombie has ended: its start is None as well.
    """
    try:
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
        boot = Path("/proc/sys/kernel/random/boot_id").read_text().strip()
    except OSError:
        return None
    return None if fields[0] == "Z" else f"{boot} {fields[19]}"
