"""Where a file system is read-only, a store of results says so as a run does: exit code 3."""

import errno
import os
from pathlib import Path
from types import SimpleNamespace

import pytest

from escort_mj.errors import EscortError
from escort_mj.study.engine.store import FILE, Store


def code(folder: Path) -> int:
    with pytest.raises(EscortError) as caught:
        Store(folder)
    return caught.value.exit_code


@pytest.mark.parametrize(("number", "expected"), [(errno.EROFS, 3), (errno.EACCES, 2), (errno.ENOTDIR, 2)])
def test_a_folder_that_cannot_be_made(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: int, expected: int
) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(Path, "mkdir", refuse)
    assert code(tmp_path / "out") == expected


@pytest.mark.parametrize(("flags", "expected"), [(os.ST_RDONLY, 3), (0, 2)])
def test_a_file_that_cannot_be_opened(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, flags: int, expected: int
) -> None:
    (tmp_path / FILE).mkdir()
    monkeypatch.setattr(os, "statvfs", lambda _: SimpleNamespace(f_flag=flags))
    assert code(tmp_path) == expected
