"""The one place that configures numba: how kernels are compiled and where their machine code is kept."""

from __future__ import annotations

import hashlib
import importlib.metadata
import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import numba
import platformdirs

F = TypeVar("F", bound=Callable[..., Any])

# No reassociation and no "NaN cannot happen": kernels must agree with their NumPy twin and see a NaN.
OPTIONS: dict[str, Any] = {"error_model": "numpy", "fastmath": {"contract"}, "nogil": True}


def cache_key() -> str:
    """Digest of everything compiled kernels depend on.

    numba checks only the file a kernel stands in, not the kernels and constants that it uses, and not
    the layout of MuJoCo's structures. A folder per digest makes a stale kernel impossible.
    """
    digest = hashlib.sha256()
    for package in ("mujoco", "numba", "llvmlite", "numpy"):
        digest.update(f"{package}={importlib.metadata.version(package)};".encode())
    root = Path(__file__).parent
    for source in sorted([Path(__file__), *root.glob("control/**/*.py"), *root.glob("world/*.py")]):
        digest.update(source.read_bytes())
    return digest.hexdigest()[:16]


def _cache_folder() -> str:
    """Folder for compiled kernels; a private temporary one where the user's cache cannot be written."""
    folder = platformdirs.user_cache_path("escort_mj") / "kernels" / cache_key()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if os.access(folder, os.W_OK):
            return str(folder)
    except OSError:
        pass
    return tempfile.mkdtemp(prefix="escort_mj-kernels-")


if "NUMBA_CACHE_DIR" not in os.environ:
    numba.config.CACHE_DIR = _cache_folder()


def kernel(function: F) -> F:
    """Compiles a function of numbers and arrays to machine code at its first call, and caches it."""
    compiled: F = numba.njit(cache=True, **OPTIONS)(function)
    return compiled


def inlined(function: F) -> F:
    """Like `kernel`, for small functions that LLVM is to merge into their callers."""
    compiled: F = numba.njit(cache=True, forceinline=True, **OPTIONS)(function)
    return compiled
