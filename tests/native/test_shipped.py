"""Machine code that ships: read where it is whole and of these sources, and enough without a compiler."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from escort_mj.errors import CompilerMissingError
from escort_mj.native import artifacts, cache, levels, shipped
from escort_mj.native.artifacts import Artifact
from escort_mj.native.compiler.ship import every_piece, every_text

FILES = {"one.o": b"machine code", "two.o": b"more of it"}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Where machine code for this machine ships, with two files in it."""
    monkeypatch.setattr(shipped, "FOLDER", tmp_path)
    shipped._manifest.cache_clear()
    place = tmp_path / levels.level().name
    shipped.write(place, FILES)
    yield place
    shipped._manifest.cache_clear()


def test_what_is_written_is_read(folder: Path) -> None:
    assert {name: shipped.shipped_file(name) for name in FILES} == FILES
    assert shipped.shipped_file("three.o") is None and shipped.count() == 2
    assert shipped.numba_version() == cache.version("numba")


def test_what_is_damaged_or_gone_is_not_read(folder: Path) -> None:
    (folder / "one.o").write_bytes(b"machine cod3")
    (folder / "two.o").unlink()
    assert shipped.shipped_file("one.o") is None and shipped.shipped_file("two.o") is None


@pytest.mark.parametrize("content", ["", "{}", "nonsense"])
def test_a_folder_without_its_manifest_does_not_count(folder: Path, content: str) -> None:
    (folder / shipped.MANIFEST).write_text(content)
    assert shipped.shipped_file("one.o") is None and not shipped.is_current(folder)


def test_other_sources_make_it_stale(folder: Path) -> None:
    manifest = json.loads((folder / shipped.MANIFEST).read_text())
    (folder / shipped.MANIFEST).write_text(json.dumps(manifest | {"sources": "0" * 64}))
    assert shipped.shipped_file("one.o") is None and shipped.count() == 0


def test_writing_again_leaves_nothing_of_before(folder: Path) -> None:
    shipped.write(folder, {"two.o": b"new"})
    assert sorted(path.name for path in folder.iterdir()) == ["manifest.json", "two.o"]


def test_a_text_that_ships_is_not_made(folder: Path) -> None:
    shipped.write(folder, FILES | {"a.json": b"{}"})
    shipped._manifest.cache_clear()
    assert shipped.remembered("a.json", pytest.fail) == "{}"
    assert shipped.count() == len(FILES), "texts are no kernels"


def test_another_text_is_made_once(folder: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(cache.kernels, "folder", tmp_path)
    made = []
    for _ in range(2):
        assert shipped.remembered("name", lambda: made.append(1) or "text") == "text"
    assert made == [1]


def test_without_a_compiler_what_does_not_ship_is_told(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(cache.kernels, "folder", tmp_path)
    monkeypatch.setattr(cache, "version", lambda package: "none")
    missing = Artifact("escort_mj.world.loop.step", "control_callback", 77)
    with pytest.raises(CompilerMissingError, match=r"ships for .*; numba would.*escort-mj\[compile\]"):
        artifacts.have([missing])


def test_everything_ships() -> None:
    """`make test` has compiled it: what tests run is what users run."""
    assert shipped.is_current(shipped.FOLDER / levels.level().name), "make machine-code"
    assert not [piece for piece in every_piece() if shipped.shipped_file(piece.file) is None]
    assert {name: shipped.shipped_file(name) for name in every_text()} == every_text()


def test_a_mission_needs_neither_numba_nor_a_cache(tmp_path: Path) -> None:
    program = """
import sys
sys.modules["numba"] = None
import escort_mj
from escort_mj.api import load_scenario
assert escort_mj.run(load_scenario("main", ["duration=0.1", "expect=[]"])).outcome.value == "completed"
"""
    environment = os.environ | {cache.FOLDER: str(tmp_path)}
    subprocess.run([sys.executable, "-c", program], check=True, env=environment)
    assert not list(tmp_path.rglob("*.o"))
