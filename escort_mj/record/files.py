"""Files written whole or not at all."""

from __future__ import annotations

import contextlib
import json
import math
import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from escort_mj.errors import RunFolderError, WriteError
from escort_mj.recognize import irregular

TEMPORARY = ".partial"


@contextlib.contextmanager
def replaced(path: Path, durable: bool = False) -> Iterator[Path]:
    """Give a temporary name to write to; once written whole, the file moves into place.

    A device or a pipe, which cannot be replaced, is written directly.

    Args:
        path: The file.
        durable: Whether the content must have reached the disk before the file moves. Some file systems
            say only then that they are full.

    Raises:
        WriteError: For every OSError inside; the temporary file is removed and `path` stays as it was.
    """
    direct = os.path.exists(path) and not os.path.isfile(path)
    temporary = path if direct else path.with_name(f".{path.name}.{os.getpid()}{TEMPORARY}")
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
            with contextlib.suppress(OSError):
                temporary.unlink(missing_ok=True)


def _flush(path: Path) -> None:
    """Wait until a file's content is on the disk."""
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


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


def read_json(path: Path) -> Any:
    """Reads JSON.

    Raises:
        RunFolderError: If the file is missing or is not JSON.
    """
    if kind := irregular(path):
        raise RunFolderError(f"{path}: is {kind}, not a file")
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise RunFolderError(f"{path}: there is no such file; is this a run folder?") from None
    except (OSError, ValueError) as error:
        raise RunFolderError(f"{path}: cannot be read: {error}") from None


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
