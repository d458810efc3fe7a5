"""Machine code that comes with the package: of all kernels that ship, for a level of processors.

Set-up makes it for this machine, a wheel carries it for every level. It counts as long as the sources are
those that it was made from; where it is missing, kernels are compiled when they are first needed, and cached.
"""

from __future__ import annotations

import hashlib
import json
from functools import cache
from pathlib import Path
from typing import Any

from escort_mj.native import levels
from escort_mj.native.cache import source_digest, version

FOLDER = Path(__file__).with_name("machine_code")
MANIFEST = "manifest.json"


def shipped_code(name: str) -> bytes | None:
    """Return a file of machine code; None where it does not ship, is damaged, or is of other sources."""
    digest = _manifest().get("files", {}).get(name)
    if digest is None:
        return None
    try:
        code = (FOLDER / levels.level().name / name).read_bytes()
    except OSError:
        return None
    return code if hashlib.sha256(code).hexdigest() == digest else None


def count() -> int:
    """Return how many kernels ship for this machine."""
    return len(_manifest().get("files", {}))


def numba_version() -> str:
    """Return the version of numba that made what ships or, where nothing ships, will compile here."""
    return str(_manifest().get("numba") or version("numba"))


def write(folder: Path, files: dict[str, bytes]) -> None:
    """Write machine code with its manifest, which comes last: what has no manifest is not read."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / MANIFEST).unlink(missing_ok=True)
    for stale in set(folder.glob("*.o")) - {folder / name for name in files}:
        stale.unlink()
    for name, code in files.items():
        (folder / name).write_bytes(code)
    digests = {name: hashlib.sha256(code).hexdigest() for name, code in files.items()}
    manifest = {"sources": source_digest(), "numba": version("numba"), "files": digests}
    (folder / MANIFEST).write_text(json.dumps(manifest, indent=1), "utf-8")


def is_current(folder: Path) -> bool:
    """Whether a folder has machine code of the present sources."""
    return bool(_read_manifest(folder))


@cache
def _manifest() -> dict[str, Any]:
    return _read_manifest(FOLDER / levels.level().name)


def _read_manifest(folder: Path) -> dict[str, Any]:
    """The manifest of a folder; empty where there is none, or one of other sources."""
    try:
        manifest: dict[str, Any] = json.loads((folder / MANIFEST).read_text("utf-8"))
    except (OSError, ValueError):
        return {}
    return manifest if manifest.get("sources") == source_digest() else {}
