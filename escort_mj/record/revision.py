"""Which revision of the user's own repository a run belongs to."""

from __future__ import annotations

import subprocess
from functools import lru_cache

PATIENCE = 5.0  # s, for a repository too large to be looked through


@lru_cache(maxsize=1)
def git_revision() -> str | None:
    """Commit of the repository that the current directory lies in, `-dirty` where its files were changed.

    Asked of git once for a process.

    Returns:
        None outside of repositories, in one without a commit, and where there is no git.
    """
    command = ["git", "describe", "--always", "--dirty", "--abbrev=40", "--exclude=*"]
    try:
        said = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=True)
    except (OSError, subprocess.SubprocessError):
        return None
    return said.stdout.strip() or None
