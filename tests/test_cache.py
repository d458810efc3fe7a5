"""What is kept on disk: whatever it depends on is in the name of the folder where it lies."""

import ast
import os
import shutil
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import llvmlite.binding
import pytest

from escort_mj import cache

PACKAGE = Path(cache.__file__).parent


@pytest.fixture
def copied(tmp_path) -> Path:
    """A copy of the package's sources."""
    return Path(
        shutil.copytree(PACKAGE, tmp_path / "escort_mj", ignore=shutil.ignore_patterns("__pycache__"))
    )


@pytest.mark.parametrize("package", ["mujoco", "dm-control", "numba", "llvmlite", "numpy"])
def test_an_upgrade_changes_the_key(package: str, monkeypatch) -> None:
    before = cache.cache_key()
    other = {package: version(package) + ".1"}
    monkeypatch.setattr(cache.importlib.metadata, "version", lambda name: other.get(name) or version(name))
    assert cache.cache_key() != before


@pytest.mark.parametrize(
    "source",
    [
        "kernels.py",
        "compiler/machine.py",
        "signals.py",
        "control/plan.py",
        "control/laws/sliding.py",
        "scenario/bodies.py",
        "world/step.py",
    ],
)
def test_a_change_of_a_source_changes_the_key(source: str, copied: Path) -> None:
    before = cache.cache_key(copied)
    assert before == cache.cache_key(), "the same sources elsewhere"
    with (copied / source).open("a") as file:
        file.write("\n")
    assert cache.cache_key(copied) != before


def test_sources_that_change_places_change_the_key(copied: Path) -> None:
    before = cache.cache_key(copied)
    one, other = copied / "control" / "nsb.py", copied / "control" / "nsb.py"
    names = one.read_bytes(), other.read_bytes()
    one.write_bytes(names[1])
    other.write_bytes(names[0])
    assert cache.cache_key(copied) != before


def test_what_kernels_import_is_in_the_key() -> None:
    """Constants that kernels take from elsewhere are frozen into machine code; numba does not look."""
    known = set(cache.sources(PACKAGE))
    for folder in ("control", "world"):
        for source in (PACKAGE / folder).rglob("*.py"):
            for node in ast.walk(ast.parse(source.read_text())):
                name = getattr(node, "module", None) or ""
                if isinstance(node, ast.ImportFrom) and name.startswith("escort_mj."):
                    path = PACKAGE.parent / name.replace(".", "/")
                    assert {path.with_suffix(".py"), path / "__init__.py"} & known, name


@pytest.mark.parametrize("asked", ["get_host_cpu_name", "get_process_triple"])
def test_another_processor_has_another_key(asked: str, monkeypatch) -> None:
    before = cache.cache_key()
    monkeypatch.setattr(llvmlite.binding, asked, lambda: "another")
    assert cache.cache_key() != before


def test_settings_of_the_compiler_are_in_the_key(monkeypatch) -> None:
    before = cache.cache_key()
    monkeypatch.setenv("NUMBA_CPU_NAME", "generic")
    assert cache.cache_key() != before


def test_a_folder_of_the_users_is_divided_by_the_key_too(tmp_path) -> None:
    program = "from escort_mj import cache; print(cache.folder())"
    found = subprocess.run(
        [sys.executable, "-c", program],
        check=True, stdout=subprocess.PIPE, text=True, env={**os.environ, cache.FOLDER: str(tmp_path)},
    )  # fmt: skip
    assert Path(found.stdout.strip()) == tmp_path / cache.cache_key()


@pytest.fixture
def folder(tmp_path: Path, monkeypatch) -> Path:
    """A cache of its own."""
    monkeypatch.setattr(cache, "folder", lambda: tmp_path)
    return tmp_path


def test_what_was_damaged_is_not_read(folder: Path) -> None:
    cache.write("name", b"content")
    assert cache.read("name") == b"content"
    whole = (folder / "name").read_bytes()
    for damaged in (b"", whole[:10], whole[:-1], whole[:-1] + b"x"):
        (folder / "name").write_bytes(damaged)
        assert cache.read("name") is None, damaged


def test_a_text_is_made_once(folder: Path) -> None:
    made = []
    for _ in range(2):
        assert cache.remembered("name", lambda: made.append(1) or "text") == "text"
    assert made == [1]
