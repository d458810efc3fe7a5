"""Machine code on disk: compiled by other processes, loaded by one that has no numba."""

import os
import shutil
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from escort_mj.native import artifacts, cache, shipped
from escort_mj.native.artifacts import Artifact

SMALL = Artifact("escort_mj.world.loop.step", "any_control_callback", None)
PROGRAM = """
import sys
from escort_mj.native import artifacts, cache, shipped
shipped.FOLDER = shipped.FOLDER / 'nowhere'
import escort_mj.world.loop.step
address = artifacts.address(artifacts.Artifact.named(sys.argv[1]))
print(address != 0, "numba" in sys.modules, cache.kernels.folder)
"""


def loaded(folder: Path, here: Path) -> list[str]:
    """A fresh process with a cache of its own: whether it has a piece, whether numba; and where."""
    found = subprocess.run(
        [sys.executable, "-c", PROGRAM, str(SMALL)],
        check=True, stdout=subprocess.PIPE, text=True, cwd=here,
        env={**os.environ, cache.FOLDER: str(folder)},
    )  # fmt: skip
    return found.stdout.split()


@pytest.fixture
def bare(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty cache for this process, which has loaded nothing and finds no machine code that ships."""
    monkeypatch.setattr(shipped, "shipped_file", lambda name: None)
    monkeypatch.setattr(cache.kernels, "folder", tmp_path)
    monkeypatch.setattr(artifacts, "_loaded", {})
    return tmp_path


def test_names_of_pieces() -> None:
    for piece in (SMALL, Artifact("escort_mj.control.conflicts", "weigh_tasks", None)):
        assert Artifact.named(str(piece)) == piece


def test_a_process_compiles_for_another_which_never_sees_numba(tmp_path: Path) -> None:
    """Nor does the compiler see a user's file by the name of a module."""
    (tmp_path / "numba.py").write_text("raise SystemExit(1)")
    has, numba, folder = loaded(tmp_path / "cache", tmp_path)
    assert (has, numba) == ("True", "False")
    file = Path(folder) / SMALL.file
    written = file.stat().st_mtime_ns, file.stat().st_ino
    assert loaded(tmp_path / "cache", tmp_path)[:2] == ["True", "False"]
    assert (file.stat().st_mtime_ns, file.stat().st_ino) == written, "compiled again"


def without_numba(monkeypatch: pytest.MonkeyPatch, executable: str) -> None:
    """As in a process that has not imported numba, and starts others so."""
    fresh = SimpleNamespace(executable=executable, modules={}, path=sys.path)
    monkeypatch.setattr(artifacts, "sys", fresh)


@pytest.mark.parametrize("executable", ["/nowhere/python", shutil.which("false")])
def test_where_no_other_process_compiles_this_one_does(
    bare: Path, monkeypatch: pytest.MonkeyPatch, executable: str
) -> None:
    """One cannot be started, the other ends at once; what is damaged is compiled again."""
    without_numba(monkeypatch, executable)
    artifacts.have([SMALL])
    file = bare / SMALL.file
    file.write_bytes(file.read_bytes()[:-1])
    assert artifacts.kept(SMALL) is None
    artifacts.have([SMALL])
    assert artifacts.kept(SMALL) is not None


def test_a_kernel_that_needs_numba_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from escort_mj.native.compiler.pieces import compile_piece

    monkeypatch.setattr(cache.kernels, "folder", tmp_path)
    with pytest.raises(RuntimeError, match="which only numba has"):
        compile_piece(Artifact(__name__, "that_prints", None))


def that_prints(axes: int | None):
    def prints(m: "int", d: "int") -> "None":
        print(m)

    return prints


def test_what_the_compiler_says_reaches_who_asked(bare: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Another process has tried in vain."""
    without_numba(monkeypatch, sys.executable)
    wrong = Artifact("escort_mj.world.loop.step", "nobody", None)
    with pytest.raises(AttributeError, match="nobody"):
        artifacts.have([wrong])
    assert artifacts.kept(wrong) is None
