"""What this machine keeps between runs: compiled kernels, texts and formations that take long to find.

Kernels lie in a folder named by a digest of whatever they depend on: nothing stale is ever read. What is read
is run, so a folder or a file that another user can write is not used. Each file begins with a digest of its
content: what is damaged is made again.
"""

from __future__ import annotations

import hashlib
import os
import platform
import re
import shutil
import stat
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import cache, cached_property
from pathlib import Path

from escort_mj.errors import WriteError
from escort_mj.files import replaced, temporary_folder
from escort_mj.native.levels import level

FOLDER = "ESCORT_MJ_CACHE_DIR"
PACKAGE = Path(__file__).parents[1]
MOST_KEYS = 8  # folders of kernels that are kept, the latest used: versions, environments, checkouts
AGAIN = "what is missing there is compiled again in each run"
ROOMS = (
    *(
        "native/compiler",
        "behaviors",
        "laws",
        "control",
        "control/outer_loops",
        "disturbances",
        "estimators",
        "policies",
        "monitor",
    ),
    *("memory", "world/loop"),
)
NO_CONSTANTS = {  # modules and rooms from which no kernel takes anything
    "scenario",
    *("__init__.py", "errors.py", "files.py", "plugin_calls.py", "stopping.py", "supervised.py"),
    *(f"native/{name}.py" for name in ("artifacts", "cache", "levels", "shipped")),
}
_IMPORT = re.compile(r"^from (escort_mj[\w.]*) import (\([^)]*\)|.*)", re.MULTILINE)
_KEY = re.compile(r"[0-9a-f]{16}")


def sources(package: Path) -> list[Path]:
    """Return the files that machine code depends on, in order: rooms with kernels, and what they import."""
    return [package / name for name in sorted(_read_sources(package))]


def _read_sources(package: Path) -> dict[str, bytes]:
    """The same files by their names in the package, with their contents."""
    begin = len(f"{package}/")
    names = {
        f"{folder}/{name}"[begin:]
        for folder, _, files in os.walk(package)
        for name in files
        if name.endswith(".py")
    }
    left = [name for name in names if os.path.dirname(name) in ROOMS]
    found: dict[str, bytes] = {}
    while left:
        source = left.pop()
        if source in found or NO_CONSTANTS & {source, source.split("/")[0]} or source not in names:
            continue
        found[source] = (package / source).read_bytes()
        for module, members in _IMPORT.findall(found[source].decode()):
            place = "/".join([*module.split(".")[1:], ""])
            left += [f"{place}__init__.py", f"{place[:-1]}.py"]
            left += [f"{place}{member}.py" for member in re.findall(r"\w+", members)]
    return found


def cache_key(package: Path = PACKAGE) -> str:
    """Digest of everything machine code depends on: sources, versions, and the level of the processor.

    A kernel holds constants of other files. A folder per digest makes a stale kernel impossible.

    Args:
        package: Where the package is.
    """
    import llvmlite.binding as llvm

    digest = hashlib.sha256()
    for name in ("mujoco", "dm-control", "numba", "llvmlite", "numpy"):
        digest.update(f"{name}={version(name)};".encode())
    digest.update(f"python={platform.python_version()};{llvm.get_process_triple()};{level()};".encode())
    for name in ("NUMBA_CPU_NAME", "NUMBA_CPU_FEATURES", "NUMBA_OPT"):
        digest.update(f"{name}={os.environ.get(name)};".encode())
    digest.update(source_digest(package).encode())
    return digest.hexdigest()[:16]


def version(package: str) -> str:
    """Return the version of an installed package; `none` for one that is not installed."""
    import importlib.metadata

    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return "none"


def source_digest(package: Path = PACKAGE) -> str:
    """Digest of the sources of all machine code that ships."""
    return _own_digest() if package == PACKAGE else _digest(package)


@cache
def _own_digest() -> str:
    """The digest of this package, worked out again when one of its files is another than the last time."""
    state = _state(PACKAGE)
    kept = digests.read(state)
    if kept is None:
        kept = _digest(PACKAGE).encode()
        digests.write(state, kept)
        digests.trim("*", MOST_KEYS)
    return kept.decode()


def _state(package: Path) -> str:
    """Names a state of a package's files, as tools that build programs do: by their times and sizes."""
    digest = hashlib.sha256(f"{package}".encode())
    left = [str(package)]
    while left:
        with os.scandir(left.pop()) as entries:
            for entry in sorted(entries, key=lambda one: one.name):
                if entry.is_dir(follow_symlinks=False):
                    left.append(entry.path)
                elif entry.name.endswith(".py"):
                    status = entry.stat()
                    digest.update(f"{entry.path}:{status.st_mtime_ns}:{status.st_size};".encode())
    return digest.hexdigest()


def _digest(package: Path) -> str:
    digest = hashlib.sha256()
    for name, content in sorted(_read_sources(package).items()):
        digest.update(f"{name}:{len(content)};".encode())
        digest.update(content)
    return digest.hexdigest()


def home() -> Path:
    """Folder of all that is kept: the one asked for, or one in the user's cache."""
    import platformdirs

    asked = os.environ.get(FOLDER)
    return Path(asked) if asked else platformdirs.user_cache_path("escort_mj")


class Shelf:
    """Files of one kind in a folder of this user's alone.

    A folder that cannot be written, but only by this user or root (an image's, say), is read. What cannot be
    written anywhere is kept in memory.
    """

    def __init__(self, wanted: Callable[[], Path], prune: bool = False) -> None:
        """Name a shelf.

        Args:
            wanted: Returns its folder.
            prune: Whether folders beside it that have not been used for long are removed.
        """
        self._wanted = wanted
        self._prune = prune
        self._unwritten: dict[str, bytes] = {}
        self.read_only: Path | None = None

    @cached_property
    def folder(self) -> Path:
        """Folder that files are written to; a temporary one where the wanted one cannot be used."""
        wanted = self._wanted()
        try:
            made = _make(wanted)
            if words := _unsafe(wanted.stat()):
                _say(f"{wanted}: {words}, so it is not used; {AGAIN}")
            elif os.access(wanted, os.W_OK | os.X_OK):
                with suppress(OSError):
                    os.utime(wanted)
                if made and self._prune:
                    _remove_oldest(wanted.parent, MOST_KEYS)
                return wanted
            else:
                self.read_only = wanted
        except OSError as error:
            _say(f"{wanted}: {error.strerror}; {AGAIN}")
        return Path(tempfile.mkdtemp(dir=temporary_folder()))

    def write(self, name: str, content: bytes) -> None:
        """Write a file, at once or not at all, with a digest that tells if it is ever damaged."""
        if self.read_only is not None:
            _say(f"{self.read_only}: cannot be written; {AGAIN}")
        try:
            with replaced(self.folder / name) as draft:
                _make(self.folder)  # another process may have removed it
                draft.touch(0o600)
                draft.write_bytes(hashlib.sha256(content).digest() + content)
        except WriteError as error:
            self._unwritten[name] = content
            _say(f"{self.folder}: cannot be written: {error.reason}; {AGAIN}")

    def read(self, name: str) -> bytes | None:
        """Return what was written; None where it is not there, or not as it was written."""
        if name in self._unwritten:
            return self._unwritten[name]
        for kept in self._contents(name):
            size = hashlib.sha256().digest_size
            if kept[:size] == hashlib.sha256(kept[size:]).digest():
                return kept[size:]
        return None

    def _contents(self, name: str) -> Iterator[bytes]:
        for folder in filter(None, (self.folder, self.read_only)):
            try:
                with open(folder / name, "rb") as file:
                    if words := _unsafe(os.fstat(file.fileno())):
                        _say(f"{folder / name}: {words}, so it is not used")
                    else:
                        yield file.read()
            except OSError:
                continue

    def trim(self, pattern: str, most: int) -> None:
        """Remove files of a pattern but for the latest."""
        _remove_all(sorted(self.folder.glob(pattern), key=_age)[most:])


kernels = Shelf(lambda: home() / ("" if os.environ.get(FOLDER) else "kernels") / cache_key(), prune=True)
formations = Shelf(lambda: home() / "formations")
digests = Shelf(lambda: home() / "digests")


def _make(folder: Path) -> bool:
    """Make a folder and those above it, for this user alone; whether it was missing."""
    missing = [path for path in (folder, *folder.parents) if not path.exists()]
    for path in reversed(missing):
        path.mkdir(mode=0o700, exist_ok=True)
    return bool(missing)


def _unsafe(status: os.stat_result) -> str:
    """Return why a folder or file may hold what another user put there; nothing where it may not."""
    if status.st_uid not in (0, os.geteuid()):
        return "belongs to another user"
    if status.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
        return "can be written by other users"
    return ""


def _remove_oldest(folder: Path, most: int) -> None:
    """Remove what other versions left: all folders named by a key, but for those used last."""
    keys = [path for path in folder.iterdir() if _KEY.fullmatch(path.name) and not path.is_symlink()]
    _remove_all(sorted(keys, key=_age)[most:])


def _remove_all(paths: list[Path]) -> None:
    for path in paths:
        if path.is_dir():
            shutil.rmtree(path, ignore_errors=True)
        else:
            with suppress(OSError):
                path.unlink()


def _age(path: Path) -> float:
    """Sort the latest first; what has just gone is the oldest."""
    try:
        return -path.stat().st_mtime
    except OSError:
        return 0.0


_said: set[str] = set()


def _say(words: str) -> None:
    """Tell the user once."""
    if words not in _said:
        _said.add(words)
        print(f"escort-mj: the cache {words}", file=sys.stderr)
