"""What is kept on disk: whatever it depends on is in the name of the folder where it lies."""

import ast
import importlib.metadata
import os
import shutil
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import llvmlite.binding
import pytest

from escort_mj.native import cache
from escort_mj.native.cache import Shelf
from escort_mj.native.levels import SHIPPED
from tests.limits import files_up_to

PACKAGE = Path(cache.__file__).parents[1]


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
    monkeypatch.setattr(importlib.metadata, "version", lambda name: other.get(name) or version(name))
    assert cache.cache_key() != before


READ = (
    "native/kernels.py",
    "native/compiler/machine.py",
    "signals.py",
    "memory/layout.py",
    "laws/sliding.py",
    "robots/attitude.py",
    "world/loop/step.py",
)
UNREAD = (
    "cli/app.py",
    "report/figures/drawing/style.py",
    "scenario/schema/scenario.py",
    "mission/__init__.py",
    "errors.py",
)  # by kernels


@pytest.mark.parametrize("source", [*READ, *UNREAD])
def test_a_change_of_a_source_that_kernels_read_changes_the_key(source: str, copied: Path) -> None:
    before = cache.cache_key(copied)
    assert before == cache.cache_key(), "the same sources elsewhere"
    with (copied / source).open("a") as file:
        file.write("\n")
    assert (cache.cache_key(copied) != before) == (source in READ)


def test_sources_that_change_places_change_the_key(copied: Path) -> None:
    before = cache.cache_key(copied)
    one, other = copied / "control" / "nsb.py", copied / "control" / "inner.py"
    names = one.read_bytes(), other.read_bytes()
    one.write_bytes(names[1])
    other.write_bytes(names[0])
    assert cache.cache_key(copied) != before


def test_every_module_with_a_kernel_is_in_the_key_and_what_it_imports() -> None:
    """Constants that kernels take from elsewhere are frozen into machine code; numba does not look."""
    known = set(cache.sources(PACKAGE))
    decorators = {"kernel", "inlined", "merged", "flat", "machine", "on_demand", "on_demand_unrolled"}
    for source in PACKAGE.rglob("*.py"):
        tree = ast.parse(source.read_text())
        kernels = [
            node
            for node in ast.walk(tree)
            if isinstance(node, ast.FunctionDef)
            for mark in node.decorator_list
            if getattr(mark.func if isinstance(mark, ast.Call) else mark, "id", None) in decorators
        ]
        if not kernels:
            continue
        assert source in known, source
        read = {node.id for each in kernels for node in ast.walk(each) if isinstance(node, ast.Name)}
        for node in tree.body:
            name = getattr(node, "module", None) or ""
            if isinstance(node, ast.ImportFrom) and name.startswith("escort_mj."):
                path = PACKAGE.parent / name.replace(".", "/")
                files = {path.with_suffix(".py"), path / "__init__.py"}
                if {*name.split(".")} & cache.NO_CONSTANTS:  # a whole room
                    assert not read & {each.asname or each.name for each in node.names}, (source, name)
                    continue
                assert files & known or files & {PACKAGE / each for each in cache.NO_CONSTANTS}, name


def test_the_digest_of_sources_is_worked_out_when_a_file_changes_and_only_then(copied, monkeypatch) -> None:
    found = []
    work_out = cache._digest
    monkeypatch.setattr(cache, "PACKAGE", copied)
    monkeypatch.setattr(cache, "digests", Shelf(lambda: copied.parent / "digests"))
    monkeypatch.setattr(cache, "_digest", lambda package: found.append(work_out(package)) or found[-1])
    source = copied / "laws/pd.py"

    def digest() -> str:
        return cache._own_digest.__wrapped__()

    assert digest() == digest() == found[0]
    source.write_text(source.read_text() + "GAIN = 1\n")
    assert digest() == digest() == found[1]
    (copied / "laws/other.py").write_text("GAIN = 2\n")
    assert digest() == digest() == found[2]
    assert len(found) == len({*found}) == 3


def test_another_system_has_another_key(monkeypatch) -> None:
    before = cache.cache_key()
    monkeypatch.setattr(llvmlite.binding, "get_process_triple", lambda: "another")
    assert cache.cache_key() != before


def test_another_level_of_processors_has_another_key(monkeypatch) -> None:
    keys = set()
    for level in SHIPPED:
        monkeypatch.setattr(cache, "level", lambda level=level: level)
        keys.add(cache.cache_key())
    assert len(keys) == len(SHIPPED)


def test_settings_of_the_compiler_are_in_the_key(monkeypatch) -> None:
    before = cache.cache_key()
    monkeypatch.setenv("NUMBA_CPU_NAME", "generic")
    assert cache.cache_key() != before


def shelf_of(folder: Path, **options) -> Shelf:
    """A shelf whose folder is made, or refused, when it is first used."""
    return Shelf(lambda: folder, **options)


def give_away(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A folder or file becomes another user's."""
    if os.geteuid() == 0:
        os.chown(path, 12345, -1)
    else:
        real = os.geteuid()
        monkeypatch.setattr(cache.os, "geteuid", lambda: real + 1)


@pytest.fixture(autouse=True)
def nothing_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cache, "_said", set())


def test_a_folder_of_the_users_is_divided_by_the_key_too(tmp_path, monkeypatch) -> None:
    monkeypatch.setenv(cache.FOLDER, str(tmp_path))
    assert shelf_of(cache.kernels._wanted()).folder == tmp_path / cache.cache_key()


def test_what_was_damaged_is_not_read(tmp_path: Path) -> None:
    shelf = shelf_of(tmp_path)
    shelf.write("name", b"content")
    assert shelf.read("name") == b"content"
    whole = (tmp_path / "name").read_bytes()
    for damaged in (b"", whole[:10], whole[:-1], whole[:-1] + b"x", b"x" + whole[1:]):
        (tmp_path / "name").write_bytes(damaged)
        assert shelf.read("name") is None, damaged
    shelf.write("name", b"content")
    assert shelf.read("name") == b"content"


def test_a_folder_is_this_users_alone_whatever_the_umask(tmp_path: Path) -> None:
    before = os.umask(0)
    try:
        shelf = shelf_of(tmp_path / "a" / "b")
        shelf.write("name", b"content")
    finally:
        os.umask(before)
    for path, mode in ((tmp_path / "a", 0o700), (shelf.folder, 0o700), (shelf.folder / "name", 0o600)):
        assert path.stat().st_mode & 0o777 == mode, path


@pytest.mark.parametrize("how", ["group", "everybody", "another"])
def test_a_folder_that_another_user_can_write_is_refused_once(tmp_path, monkeypatch, capsys, how) -> None:
    planted = tmp_path / "kernels"
    shelf_of(planted).write("name", b"planted")
    if how == "another":
        give_away(planted, monkeypatch)
    else:
        planted.chmod(0o770 if how == "group" else 0o777)
    for _ in range(2):
        shelf = shelf_of(planted)
        assert shelf.read("name") is None
        assert shelf.folder != planted
        assert shelf.folder.stat().st_mode & 0o777 == 0o700
        shelf.write("name", b"ours")
        assert shelf.read("name") == b"ours"
    (line,) = capsys.readouterr().err.splitlines()
    assert f"{planted}: " in line and "so it is not used" in line


@pytest.mark.parametrize("how", ["everybody", "another"])
def test_a_file_that_another_user_can_write_is_not_read(tmp_path, monkeypatch, capsys, how) -> None:
    shelf = shelf_of(tmp_path)
    shelf.write("name", b"planted")
    assert shelf.folder == tmp_path
    if how == "another":
        give_away(tmp_path / "name", monkeypatch)
    else:
        (tmp_path / "name").chmod(0o666)
    assert shelf.read("name") is None
    assert "is not used" in capsys.readouterr().err


def test_what_only_root_can_write_is_read_and_what_is_missing_made_elsewhere(
    tmp_path, monkeypatch, capsys
) -> None:
    """So a container's image brings its kernels to whatever user runs it."""
    shelf_of(tmp_path).write("name", b"content")
    access = os.access
    monkeypatch.setattr(cache.os, "access", lambda path, how: path != tmp_path and access(path, how))
    shelf = shelf_of(tmp_path)
    assert shelf.read("name") == b"content"
    assert capsys.readouterr().err == ""
    shelf.write("other", b"new")
    assert shelf.read("other") == b"new"
    assert not (tmp_path / "other").exists()
    assert len(capsys.readouterr().err.splitlines()) == 1


def test_where_nothing_can_be_written_it_is_kept_in_memory(tmp_path, capsys) -> None:
    shelf = shelf_of(tmp_path)
    assert shelf.folder == tmp_path
    with files_up_to(10):
        shelf.write("name", b"content")
        shelf.write("other", b"content")
    assert shelf.read("name") == b"content"
    assert not list(tmp_path.iterdir())
    assert len(capsys.readouterr().err.splitlines()) == 1


def test_a_folder_that_was_removed_meanwhile_is_made_again(tmp_path) -> None:
    shelf = shelf_of(tmp_path / "kernels")
    shelf.write("name", b"content")
    shutil.rmtree(shelf.folder)
    assert shelf.read("name") is None
    shelf.write("name", b"content")
    assert shelf_of(tmp_path / "kernels").read("name") == b"content"


def test_temporary_folders_go_with_their_process(tmp_path) -> None:
    (tmp_path / "kernels").mkdir()
    (tmp_path / "kernels").chmod(0o777)
    (tmp_path / "tmp").mkdir()
    program = """
import multiprocessing, sys
from pathlib import Path
from escort_mj.native.cache import Shelf
from escort_mj.native.levels import SHIPPED

def use(path):
    shelf = Shelf(lambda: Path(path))
    shelf.write("name", b"content")
    assert len(list(Path(sys.argv[2]).rglob("name"))) >= 1

use(sys.argv[1])
process = multiprocessing.get_context("fork").Process(target=use, args=sys.argv[1:2])
process.start()
process.join()
sys.exit(process.exitcode)
"""
    subprocess.run(
        [sys.executable, "-c", program, tmp_path / "kernels", tmp_path / "tmp"],
        check=True, env={**os.environ, "TMPDIR": str(tmp_path / "tmp")},
    )  # fmt: skip
    assert not list((tmp_path / "tmp").iterdir())


def test_old_keys_are_removed_and_nothing_else(tmp_path) -> None:
    keys = [f"{k:016x}" for k in range(cache.MOST_KEYS + 3)]
    for age, key in enumerate(keys):
        (tmp_path / key).mkdir()
        (tmp_path / key / "kernel.o").touch()
        os.utime(tmp_path / key, (1e9 - age, 1e9 - age))
    (tmp_path / "holiday").mkdir()
    (tmp_path / "0123456789abcdef.txt").touch()
    new = "f" * 16
    shelf_of(tmp_path / keys[-1], prune=True).folder  # noqa: B018 - used again, it is the latest
    shelf_of(tmp_path / new, prune=True).folder  # noqa: B018
    left = {path.name for path in tmp_path.iterdir()}
    assert left == {*keys[: cache.MOST_KEYS - 2], keys[-1], new, "holiday", "0123456789abcdef.txt"}


def test_files_of_a_pattern_are_trimmed_to_the_latest(tmp_path) -> None:
    shelf = shelf_of(tmp_path)
    for age, name in enumerate(("plugin.a.o", "plugin.b.o", "plugin.c.o", "own.o")):
        shelf.write(name, b"content")
        os.utime(tmp_path / name, (1e9 - age, 1e9 - age))
    shelf.trim("plugin.*.o", 2)
    assert {path.name for path in tmp_path.iterdir()} == {"plugin.a.o", "plugin.b.o", "own.o"}


def test_processes_that_write_the_same_file_leave_it_whole(tmp_path) -> None:
    program = """
import sys
from pathlib import Path
from escort_mj.native.cache import Shelf
from escort_mj.native.levels import SHIPPED
shelf = Shelf(lambda: Path(sys.argv[1]))
for _ in range(200):
    shelf.write("name", b"content" * 10_000)
    assert shelf.read("name") == b"content" * 10_000
"""
    processes = [subprocess.Popen([sys.executable, "-c", program, tmp_path]) for _ in range(3)]
    assert [process.wait() for process in processes] == [0, 0, 0]
    assert [path.name for path in tmp_path.iterdir()] == ["name"]
