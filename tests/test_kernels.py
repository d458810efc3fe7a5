"""Compiled kernels on disk: whatever they depend on is in the name of the folder where they lie."""

import ast
import os
import shutil
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import pytest
from numba.core.caching import IndexDataCacheFile

from escort_mj import kernels

PACKAGE = Path(kernels.__file__).parent


@pytest.fixture
def copied(tmp_path) -> Path:
    """A copy of the package's sources."""
    return Path(
        shutil.copytree(PACKAGE, tmp_path / "escort_mj", ignore=shutil.ignore_patterns("__pycache__"))
    )


@pytest.mark.parametrize("package", ["mujoco", "numba", "llvmlite", "numpy"])
def test_an_upgrade_changes_the_key(package: str, monkeypatch) -> None:
    before = kernels.cache_key()
    other = {package: version(package) + ".1"}
    monkeypatch.setattr(kernels.importlib.metadata, "version", lambda name: other.get(name) or version(name))
    assert kernels.cache_key() != before


@pytest.mark.parametrize(
    "source",
    [
        "kernels.py",
        "signals.py",
        "control/plan.py",
        "control/laws/sliding.py",
        "scenario/bodies.py",
        "world/step.py",
    ],
)
def test_a_change_of_a_source_changes_the_key(source: str, copied: Path) -> None:
    before = kernels.cache_key(copied)
    assert before == kernels.cache_key(), "the same sources elsewhere"
    with (copied / source).open("a") as file:
        file.write("\n")
    assert kernels.cache_key(copied) != before


def test_sources_that_change_places_change_the_key(copied: Path) -> None:
    before = kernels.cache_key(copied)
    one, other = copied / "control" / "nsb.py", copied / "control" / "outer.py"
    names = one.read_bytes(), other.read_bytes()
    one.write_bytes(names[1])
    other.write_bytes(names[0])
    assert kernels.cache_key(copied) != before


def test_what_kernels_import_is_in_the_key() -> None:
    """Constants that kernels take from elsewhere are frozen into machine code; numba does not look."""
    known = set(kernels.sources(PACKAGE))
    for folder in ("control", "world"):
        for source in (PACKAGE / folder).rglob("*.py"):
            for node in ast.walk(ast.parse(source.read_text())):
                name = getattr(node, "module", None) or ""
                if isinstance(node, ast.ImportFrom) and name.startswith("escort_mj."):
                    path = PACKAGE.parent / name.replace(".", "/")
                    assert {path.with_suffix(".py"), path / "__init__.py"} & known, name


def test_a_folder_of_the_users_is_divided_by_the_key_too(tmp_path) -> None:
    program = "import numba, escort_mj.kernels; print(numba.config.CACHE_DIR)"
    found = subprocess.run(
        [sys.executable, "-c", program],
        check=True, stdout=subprocess.PIPE, text=True, env={**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)},
    )  # fmt: skip
    assert Path(found.stdout.strip()) == tmp_path / kernels.cache_key()


def test_two_processes_that_compile_at_once_do_not_mix_up_their_code(tmp_path: Path) -> None:
    """Each has read the index before the other writes it: one entry may be lost, none may be the other's."""
    one, other = (IndexDataCacheFile(str(tmp_path), "kernels.kernel-1", "stamp") for _ in range(2))
    before = one._load_index()
    one.save("for doubles", "code for doubles")
    other._load_index = lambda: dict(before)
    other.save("for integers", "code for integers")
    del other._load_index
    found = {key: other.load(key) for key in ("for doubles", "for integers")}
    assert found["for integers"] == "code for integers"
    assert found["for doubles"] in ("code for doubles", None)
    one.save("for doubles", "code for doubles")
    assert (one.load("for doubles"), one.load("for integers")) == ("code for doubles", "code for integers")
