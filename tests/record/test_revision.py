import subprocess
from concurrent.futures import ThreadPoolExecutor

import pytest

from escort_mj.record.revision import ask_for_revision, git_revision


@pytest.fixture
def asked(tmp_path, monkeypatch):
    """Asks in an empty folder, as in a fresh process."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("GIT_CEILING_DIRECTORIES", str(tmp_path.parent))
    git_revision.cache_clear()
    yield git_revision.__wrapped__
    git_revision.cache_clear()


def git(*arguments: str) -> str:
    names = ("-c", "user.name=x", "-c", "user.email=x@y")
    return subprocess.run(["git", *names, *arguments], check=True, capture_output=True, text=True).stdout


def test_the_commit_and_whether_files_were_changed(asked, tmp_path):
    assert asked() is None
    git("init", "-q")
    assert asked() is None
    (tmp_path / "a").write_text("1")
    git("add", "a")
    git("commit", "-q", "-m", "a")
    commit = git("rev-parse", "HEAD").strip()
    assert len(commit) == 40 and asked() == commit
    git("tag", "v1")
    (tmp_path / "a").write_text("2")
    assert asked() == f"{commit}-dirty"


def test_without_git(asked, monkeypatch):
    monkeypatch.setenv("PATH", "")
    assert asked() is None


def test_many_threads_ask_at_once(asked, tmp_path):
    git("init", "-q")
    (tmp_path / "a").write_text("1")
    git("add", "a")
    git("commit", "-q", "-m", "a")
    for _ in range(3):
        ask_for_revision()
        with ThreadPoolExecutor(8) as threads:
            found = list(threads.map(lambda _: asked(), range(16)))
        assert {*found} == {git("rev-parse", "HEAD").strip()}
