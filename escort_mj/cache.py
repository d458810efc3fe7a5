"""What this machine keeps between runs: compiled kernels, and texts that take long to find out.

All lies in one folder, named by a digest of whatever it depends on: nothing stale is ever read.
"""

from __future__ import annotations

import hashlib
import importlib.metadata
import os
import platform
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path

FOLDER = "ESCORT_MJ_CACHE_DIR"


def sources(package: Path) -> list[Path]:
    """The files of the package that kernels and the constants in them come from, in order."""
    folders = (".", "compiler", "control/**", "scenario", "world")
    return sorted({source for folder in folders for source in package.glob(f"{folder}/*.py")})


def cache_key(package: Path = Path(__file__).parent) -> str:
    """Digest of everything machine code depends on: sources, versions, and the processor.

    A kernel holds constants of other files and the layout of MuJoCo's structures. A folder per digest makes a
    stale kernel impossible.

    Args:
        package: Where the package is.
    """
    import llvmlite.binding as llvm

    digest = hashlib.sha256()
    for name in ("mujoco", "dm-control", "numba", "llvmlite", "numpy"):
        digest.update(f"{name}={importlib.metadata.version(name)};".encode())
    digest.update(f"python={platform.python_version()};{llvm.get_process_triple()};".encode())
    digest.update(f"{llvm.get_host_cpu_name()};{llvm.get_host_cpu_features().flatten()};".encode())
    for name in ("NUMBA_CPU_NAME", "NUMBA_CPU_FEATURES", "NUMBA_OPT"):
        digest.update(f"{name}={os.environ.get(name)};".encode())
    for source in sources(package):
        content = source.read_bytes()
        digest.update(f"{source.relative_to(package).as_posix()}:{len(content)};".encode())
        digest.update(content)
    return digest.hexdigest()[:16]


@cache
def folder() -> Path:
    """Folder for machine code, by its key; a private temporary one where nothing can be written."""
    import platformdirs

    asked = os.environ.get(FOLDER)
    found = Path(asked) if asked else platformdirs.user_cache_path("escort_mj") / "kernels"
    found /= cache_key()
    try:
        found.mkdir(parents=True, exist_ok=True)
        if os.access(found, os.W_OK):
            return found
    except OSError:
        pass
    return Path(tempfile.mkdtemp(prefix="escort_mj-kernels-"))


def write(name: str, content: bytes) -> None:
    """Writes a file of the folder, at once or not at all, with a digest that tells if it is ever damaged."""
    handle, draft = tempfile.mkstemp(dir=folder(), prefix=f"{name}.")
    with os.fdopen(handle, "wb") as file:
        file.write(hashlib.sha256(content).digest() + content)
    os.replace(draft, folder() / name)


def read(name: str) -> bytes | None:
    """What was written; None where it is not there, or not as it was written."""
    try:
        kept = (folder() / name).read_bytes()
    except OSError:
        return None
    size = hashlib.sha256().digest_size
    return kept[size:] if kept[:size] == hashlib.sha256(kept[size:]).digest() else None


def remembered(name: str, make: Callable[[], str]) -> str:
    """A text that depends on nothing but sources and versions, made once on each machine.

    Args:
        name: Of the file; whatever else the text depends on must be in it.
        make: Makes the text.
    """
    kept = read(name)
    if kept is not None:
        return kept.decode()
    text = make()
    write(name, text.encode())
    return text
