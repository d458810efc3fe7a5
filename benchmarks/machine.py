"""What measured: the machine and the versions, said beside every number."""

from __future__ import annotations

import os
import platform
from importlib.metadata import version
from pathlib import Path

from benchmarks.document import table

PACKAGES = ("escort-mj", "mujoco", "numba", "numpy")


def describe() -> dict[str, str]:
    """Processor, cores this process may use, and versions."""
    lines = Path("/proc/cpuinfo").read_text().splitlines() if Path("/proc/cpuinfo").exists() else []
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return {
        "processor": names[0] if names else platform.processor() or platform.machine(),
        "cores": str(len(os.sched_getaffinity(0))),
        "system": platform.system(),
        "Python": platform.python_version(),
        **{name: version(name) for name in PACKAGES},
    }


def tables(machine: dict[str, str]) -> dict[str, str]:
    """The description as one row."""
    return {"machine": table(list(machine), [list(machine.values())])}
