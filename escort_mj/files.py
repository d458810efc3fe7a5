"""Files that outlive whatever ends the process: each is written beside its place and renamed when whole.

A folder that a process fills says by `identify` who that is: whoever finds it later knows with `alive`
whether it is still being filled.
"""

from __future__ import annotations

import errno
import fcntl
import json
import math
import os
import shutil
import threading
from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from escort_mj.errors import RunFolderError, UsageError, WriteError
from escort_mj.recognize import irregular

if TYPE_CHECKING:
    from pydantic import TypeAdapter

PARTIAL = ".partial"  # how the name of a file begins that is not whole yet; machine and process follow
MACHINE = os.uname().nodename
OWNER = "escort_mj.json"  # in a temporary folder: which process it is of


@contextmanager
def replaced(path: Path, durable: bool = False) -> Iterator[Path]:
    """Give a temporary name to write to; once written whole, the file moves into place.

    A device or a pipe, which cannot be replaced, is written directly.

    Args:
        path: The file.
        durable: Whether the content must have reached the disk before the file moves. Some file systems
            say only then that they are full.

    Raises:
        WriteError: For every OSError inside, and for names that no file can have; the temporary file is
            removed and `path` stays as it was.
    """
    try:
        os.fsencode(path)
    except UnicodeEncodeError:
        raise WriteError(path, OSError(errno.EILSEQ, os.strerror(errno.EILSEQ))) from None
    direct = os.path.exists(path) and not os.path.isfile(path)
    beside = f"{PARTIAL}.{MACHINE}.{os.getpid()}.{threading.get_native_id()}.{path.name}"
    temporary = path if direct else path.with_name(beside)
    try:
        yield temporary
        if not direct:
            if durable:
                _flush(temporary)
            os.replace(temporary, path)
    except WriteError:
        raise
    except OSError as error:
        raise WriteError(path, error) from None
    finally:
        if not direct:
            with suppress(OSError):
                temporary.unlink(missing_ok=True)


def _flush(path: Path) -> None:
    """Wait until a file's content is on the disk."""
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def is_partial(path: Path) -> bool:
    """Whether a file is one that `replaced` has not finished, or that a kill left so."""
    return path.name.startswith(PARTIAL)


def remove_left(folder: Path) -> None:
    """Remove what processes of this machine that have ended left in a folder half written."""
    begin = f"{PARTIAL}.{MACHINE}."
    for path in folder.glob(f"{begin}*"):
        process = path.name.removeprefix(begin).partition(".")[0]
        if process.isdecimal() and not alive({"pid": process, "process_start": _start(int(process))}):
            with suppress(OSError):
                path.unlink()


def temporary_folder() -> Path:
    """Return this process's folder for temporary files, which is multiprocessing's and goes with the process.

    The first call removes those of processes of this machine that were killed.
    """
    from multiprocessing.util import get_temp_dir

    folder = Path(get_temp_dir())
    if not (folder / OWNER).exists():
        for left in folder.parent.glob(f"pymp-*/{OWNER}"):
            with suppress(OSError, RunFolderError, AttributeError):
                owner = read_json(left)
                if owner.get("host") == MACHINE and not alive(owner):
                    shutil.rmtree(left.parent)
        with suppress(WriteError):
            write_json(folder / OWNER, identify() | {"host": MACHINE})
    return folder


def check_place(path: Path, kinds: Collection[str] = ()) -> None:
    """Refuse a file that cannot be written, before the work whose result it is to hold.

    Args:
        path: The file.
        kinds: Suffixes that it may have; empty for any.

    Raises:
        UsageError: If its suffix is another, it is a folder, or there is no folder for it.
    """
    if kinds and path.suffix not in kinds:
        raise UsageError(f"{path}: found the suffix {path.suffix or 'none'}; allowed are {', '.join(kinds)}")
    if os.path.isdir(path):
        raise UsageError(f"{path}: is a folder; expected a file")
    if not os.path.isdir(path.parent):
        raise UsageError(f"{path}: there is no folder {path.parent}")


def make_folder(path: Path) -> None:
    """Make a folder and those above it, where they are missing.

    Raises:
        WriteError: If that cannot be done.
    """
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise WriteError(path, error) from None


def write_bytes(path: Path, content: bytes | memoryview, durable: bool = False) -> None:
    """Write a file, whole or not at all; see `replaced`."""
    with replaced(path, durable) as temporary:
        temporary.write_bytes(content)


def write_text(path: Path, text: str) -> None:
    """Write a text file, whole or not at all."""
    write_bytes(path, text.encode())


def write_model(path: Path, text: str, assets: Mapping[str, bytes]) -> None:
    """Write MJCF, and beside it the files that it names.

    Args:
        path: The file.
        text: The MJCF.
        assets: Content of files by their paths from the folder of the MJCF.
    """
    for name, content in assets.items():
        make_folder((path.parent / name).parent)
        write_bytes(path.parent / name, content)
    write_text(path, text)


def json_text(value: Any, indent: int | None = 2) -> str:
    """Return a value as JSON, where what is not a finite number is null, and a path its text.

    Args:
        value: The value.
        indent: Spaces per level; None for one line.
    """
    return json.dumps(_plain(value), indent=indent, allow_nan=False, ensure_ascii=False)


def write_json(path: Path, value: Any) -> None:
    """Writes JSON; what is not a finite number becomes null."""
    write_text(path, json_text(value) + "\n")


def _plain(value: Any) -> Any:
    """A value as JSON can hold it."""
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, Path):
        return str(value)
    if hasattr(value, "tolist"):
        return _plain(value.tolist())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def read_text(path: Path) -> str:
    """Read a text file.

    Raises:
        RunFolderError: If it is missing or no text.
    """
    if kind := irregular(path):
        raise RunFolderError(f"{path}: is {kind}, not a file")
    try:
        return path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise RunFolderError(f"{path}: there is no such file; is this a run folder?") from None
    except (OSError, ValueError) as error:
        raise RunFolderError(f"{path}: cannot be read: {getattr(error, 'strerror', None) or error}") from None


def read_json(path: Path) -> Any:
    """Read JSON.

    Raises:
        RunFolderError: If the file is missing or is not JSON.
    """
    text = read_text(path)
    try:
        return json.loads(text)
    except (ValueError, RecursionError) as error:
        raise RunFolderError(f"{path}: cannot be read: {error}") from None


def checked(kind: Any, found: Any, path: Path, where: str = "") -> Any:
    """Return what was read, once it is what a type says.

    Args:
        kind: The type, as pydantic takes it.
        found: The data.
        path: Their file.
        where: Where in the file they are, as it stands before a key.

    Raises:
        RunFolderError: With the first entry that is wrong.
    """
    from pydantic import ValidationError

    try:
        return _adapter(kind).validate_python(found)
    except ValidationError as error:
        first = error.errors()[0]
        key = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in first["loc"])
        wrong = "is missing" if first["type"] == "missing" else f"is {str(first['input'])[:60]!r}"
        raise RunFolderError(f"{path}: is damaged: {where}{key.removeprefix('.') or 'it'} {wrong}") from None


@cache
def _adapter(kind: Any) -> TypeAdapter[Any]:
    from pydantic import TypeAdapter

    return TypeAdapter(kind)


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Let one process at a time look into a folder and claim it."""
    handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        with suppress(OSError):  # some network file systems lock no folders
            fcntl.flock(handle, fcntl.LOCK_EX)
        yield
    finally:
        os.close(handle)


def identify() -> dict[str, Any]:
    """Return what tells this process from every other one, those that get its number later among them."""
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
