"""An environment of its own for each peer, made on first use: what peers need must not meet what we need."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

CACHE = Path(".cache") / "peers"
REQUIREMENTS: dict[str, tuple[str, ...]] = {
    "irsim": ("ir-sim==2.12.0",),
    "orca": ("pyrvo==0.4.3", "numpy"),
    "vmas": ("torch==2.13.0", "vmas==1.5.2"),
    "pybullet": ("pybullet==3.2.7", "numpy"),
    "crazyflow": ("crazyflow==0.4.0",),
    # Not on PyPI; it reads its assets through pkg_resources, which newer setuptools no longer have.
    "gym_pybullet_drones": (
        "torch==2.13.0",
        "setuptools<81",
        "gym-pybullet-drones @ git+https://github.com/learnsyslab/gym-pybullet-drones@90b178a",
    ),
}


class NotInstalled(Exception):  # noqa: N818
    """Why a peer cannot be measured here."""


def python_of(peer: str) -> Path:
    """The interpreter of a peer's environment, made and filled if there is none.

    Args:
        peer: A key of `REQUIREMENTS`.

    Raises:
        NotInstalled: With what the installer said last.
    """
    folder = CACHE / peer
    python = folder / "bin" / "python"
    if (folder / "installed").exists():
        return python
    print(f"installing {', '.join(REQUIREMENTS[peer])} into {folder} ...", flush=True)
    uv = shutil.which("uv", path=Path(sys.executable).parent) or shutil.which("uv")
    if uv is None:
        raise NotInstalled("making an environment takes uv, and there is none")
    # pip and not uv fills it: who has set pip up for a build of PyTorch without CUDA, saves gigabytes.
    _run([uv, "venv", "--quiet", "--clear", "--seed", "--python", sys.executable, str(folder)])
    _run([str(python), "-m", "pip", "install", "--quiet", *REQUIREMENTS[peer]])
    (folder / "installed").touch()
    return python


def _run(command: list[str]) -> None:
    """Runs a step of an installation."""
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode:
        errors = [line for line in done.stderr.splitlines() if "error" in line.lower()]
        raise NotInstalled((errors or done.stderr.splitlines() or ["failed without a word"])[-1].strip())
