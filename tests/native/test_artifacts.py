"""Machine code on disk: compiled by other processes, loaded by one that has no numba."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from escort_mj.native import artifacts, cache
from escort_mj.native.artifacts import Piece

SMALL = Piece("escort_mj.world.loop.step", "any_control_callback", None)
PROGRAM = """
import sys
from escort_mj.native import artifacts, cache, shipped
shipped.FOLDER = shipped.FOLDER / 'nowhere'
import escort_mj.world.loop.step
sys.executable = sys.argv[1] or sys.executable
address = artifacts.address(artifacts.Piece.named(sys.argv[2]))
print(address != 0, "numba" in sys.modules, cache.kernels.folder)
"""


def loaded(folder: Path, executable: str = "", piece: Piece = SMALL, here: Path | None = None) -> list[str]:
    """A fresh process with a cache of its own: whether it has a piece, whether numba; and where."""
    found = subprocess.run(
        [sys.executable, "-c", PROGRAM, executable, str(piece)],
        check=True, stdout=subprocess.PIPE, text=True, cwd=here,
        env={**os.environ, cache.FOLDER: str(folder)},
    )  # fmt: skip
    return found.stdout.split()


def test_names_of_pieces() -> None:
    for piece in (SMALL, Piece("escort_mj.control.conflicts", "weigh_tasks", 2)):
        assert Piece.named(str(piece)) == piece


def test_a_process_compiles_for_another_which_never_sees_numba(tmp_path: Path) -> None:
    has, numba, folder = loaded(tmp_path)
    assert (has, numba) == ("True", "False")
    file = Path(folder) / f"{SMALL}.o"
    written = file.stat().st_mtime_ns, file.stat().st_ino
    assert loaded(tmp_path)[:2] == ["True", "False"]
    assert (file.stat().st_mtime_ns, file.stat().st_ino) == written, "compiled again"
    file.write_bytes(file.read_bytes()[:-1])
    assert loaded(tmp_path)[:2] == ["True", "False"]
    assert file.stat().st_ino != written[1], "damaged, and not compiled again"


def test_a_users_file_by_the_name_of_a_module_does_not_reach_the_compiler(tmp_path: Path) -> None:
    (tmp_path / "numba.py").write_text("raise SystemExit(1)")
    assert loaded(tmp_path / "cache", here=tmp_path)[:2] == ["True", "False"]


def test_where_no_process_can_be_started_this_one_compiles(tmp_path: Path) -> None:
    assert loaded(tmp_path, "/nowhere/python")[:2] == ["True", "True"]


def test_a_kernel_that_needs_numba_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from escort_mj.native.compiler.pieces import compile_piece

    monkeypatch.setattr(cache.kernels, "folder", tmp_path)
    with pytest.raises(RuntimeError, match="which only numba has"):
        compile_piece(Piece(__name__, "that_prints", None))


def that_prints(axes: int | None):
    def prints(m: "int", d: "int") -> "None":
        print(m)

    return prints


def test_what_the_compiler_says_reaches_who_asked(tmp_path: Path) -> None:
    wrong = Piece("escort_mj.world.loop.step", "nobody", None)
    with pytest.raises(subprocess.CalledProcessError):
        loaded(tmp_path, piece=wrong)
    assert artifacts.kept(wrong) is None
