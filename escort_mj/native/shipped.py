"""What comes with the package made: machine code of all kernels, and texts that take long to make.

Set-up makes it for this machine's level of processors, a wheel carries it for every level. It counts as long
as the sources are those that it was made from; what is missing is made when it is first needed, and cached.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

from escort_mj.native import levels
from escort_mj.native.cache import kernels, source_digest, version

FOLDER = Path(__file__).with_name("machine_code")
MANIFEST = "manifest.json"
CODE = ".o"


def shipped_file(name: str) -> bytes | None:
    """Return a file that ships; None where there is none, or it is damaged or of other sources."""
    digest = _manifest().get("files", {}).get(name)
    if digest is None:
        return None
    try:
        code = (FOLDER / levels.level().name / name).read_bytes()
    except OSError:
        return None
    return code if hashlib.sha256(code).hexdigest() == digest else None


def remembered(name: str, make: Callable[[], str]) -> str:
    """Return a text that ships, or is made once on each machine.

    Args:
        name: Of the file; all that the text depends on beside sources and versions must be in it.
        make: Makes the text.
    """
    kept = shipped_file(name) or kernels.read(name)
    if kept is not None:
        return kept.decode()
    text = make()
    kernels.write(name, text.encode())
    return text


def count() -> int:
    """Return how many kernels ship for this machine."""
    return sum(name.endswith(CODE) for name in _manifest().get("files", {}))


def numba_version() -> str:
    """Return the version of numba that made what ships or, where nothing ships, will compile here."""
    return str(_manifest().get("numba") or version("numba"))


def write(folder: Path, files: dict[str, bytes]) -> None:
    """Write files with their manifest, which comes last: what has no manifest is not read."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / MANIFEST).unlink(missing_ok=True)
    for stale in set(folder.iterdir()) - {folder / name for name in files}:
        stale.unlink()
    for name, code in files.items():
        (folder / name).write_bytes(code)
    digests = {name: hashlib.sha256(code).hexdigest() for name, code in files.items()}
    manifest = {"sources": source_digest(), "numba": version("numba"), "files": digests}
    (folder / MANIFEST).write_text(json.dumps(manifest, indent=1), "utf-8")


def is_current(folder: Path) -> bool:
    """Whether a folder has what is made of the present sources."""
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
