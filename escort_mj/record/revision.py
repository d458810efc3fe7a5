"""Which revision of the user's own repository a run belongs to."""

from __future__ import annotations

import subprocess
from functools import lru_cache

PATIENCE = 5.0  # s, for a repository too large to be looked through
_begun: list[subprocess.Popen[str]] = []  # whoever takes one out waits for it, alone of all threads


def ask_for_revision() -> None:
    """Start git: it answers while something else is done."""
    if (asked := _ask()) is not None:
        _begun.append(asked)


@lru_cache(maxsize=1)
def git_revision() -> str | None:
    """Commit of the repository that the current directory lies in, `-dirty` where its files were changed.

    Asked of git once for a process.

    Returns:
        None outside of repositories, in one without a commit, and where there is no git.
    """
    asked: subprocess.Popen[str] | None
    try:
        asked = _begun.pop()
    except IndexError:
        asked = _ask()
    if asked is None:
        return None
    try:
        said, _ = asked.communicate(timeout=PATIENCE)
    except subprocess.TimeoutExpired:
        asked.kill()
        said, _ = asked.communicate()
    return said.strip() or None if asked.returncode == 0 else None


def _ask() -> subprocess.Popen[str] | None:
    command = ["git", "describe", "--always", "--dirty", "--abbrev=40", "--exclude=*"]
    try:
        return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    except OSError:
        return None
