"""Is this machine fit for runs, and if not, what helps? Every check says what it found."""

from __future__ import annotations

import importlib.metadata
import os
import platform
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Literal, NamedTuple

from packaging.requirements import Requirement

from escort_mj import gl

GOOD: Literal["good"] = "good"
WARNING: Literal["warning"] = "warning"
BAD: Literal["bad"] = "bad"

LITTLE_SPACE = 1 << 30  # bytes
FOR_DEVELOPERS = ("docs", "test")  # extras
UNFIT = {"4.0.0": "its solver has a fault that 4.0.1 mended, and dm_control cannot step it"}  # of MuJoCo


class Examined(NamedTuple):
    """What one check found.

    Attributes:
        check: What was looked at.
        state: "good"; "warning": runs work, but something else does not; "bad": runs do not work.
        found: What is there.
        advice: What helps; empty where nothing has to.
    """

    check: str
    state: Literal["good", "warning", "bad"]
    found: str
    advice: str = ""


def examine_machine(folder: Path) -> Iterator[Examined]:
    """Looks at everything that runs, pictures and videos need.

    Args:
        folder: Folder in which runs will be written.
    """
    yield Examined("python", GOOD, f"{platform.python_version()} on {platform.platform()}")
    yield from _packages()
    yield _cores()
    yield _kernels()
    yield _output(folder)
    yield _rendering()
    yield _encoder()
    yield from _extras()


def _packages() -> Iterator[Examined]:
    """The packages that runs need, in the versions that they need."""
    needed = [Requirement(text) for text in importlib.metadata.requires("escort-mj") or ()]
    wrong, right = [], []
    for package in needed:
        if package.marker is not None and not package.marker.evaluate({"extra": ""}):
            continue
        version = _version(package.name)
        if version is None:
            wrong.append(f"{package.name} is missing")
        elif not package.specifier.contains(version, prereleases=True):
            wrong.append(f"{package.name} is {version}, needed is {package.specifier}")
        else:
            right.append(package.name)
    if wrong:
        yield Examined("packages", BAD, "; ".join(wrong), "pip install --upgrade escort-mj")
    else:
        yield Examined("packages", GOOD, f"all {len(right)} are there")
    mujoco = _version("mujoco") or ""
    if reason := UNFIT.get(mujoco):
        yield Examined("mujoco", BAD, f"{mujoco}: {reason}", f'pip install "mujoco!={mujoco}"')
    else:
        yield Examined("mujoco", GOOD, mujoco or "none")


def _version(package: str) -> str | None:
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return None


def _cores() -> Examined:
    from escort_mj.study.engine.parallel import cores

    return Examined("cores", GOOD, f"{cores()} of {os.cpu_count()} for studies and checks")


def _kernels() -> Examined:
    """Machine code: what ships, or what a first run compiles and later ones find."""
    from escort_mj.native import cache, shipped
    from escort_mj.native.levels import level

    if count := shipped.count():
        return Examined("kernels", GOOD, f"{count} ship as machine code for {level().name}")
    if _version("numba") is None:
        return Examined("kernels", BAD, f"none ship for {level().name}", "pip install 'escort-mj[compile]'")
    folder = cache.kernels.folder
    if folder.name != cache.cache_key():
        if (image := cache.kernels.read_only) is not None and any(image.glob("*.o")):
            return Examined("kernels", GOOD, f"compiled kernels in {image}, which this user cannot write")
        name = cache.FOLDER if cache.FOLDER in os.environ else "XDG_CACHE_HOME"
        advice = f"set {name} to a folder that only you can write"
        return Examined("kernels", WARNING, f"are kept in {folder}, which goes with this process", advice)
    kept = sum(1 for _ in folder.glob("*.o"))
    told = f"{kept} compiled kernels" if kept else "none compiled yet: the first run takes some seconds more"
    return Examined("kernels", GOOD, f"{told} in {folder}")


def _output(folder: Path) -> Examined:
    """Whether runs can be written."""
    there = next(path for path in (folder, *Path(os.path.realpath(folder)).parents) if path.is_dir())
    if not os.access(there, os.W_OK | os.X_OK):
        return Examined("output", BAD, f"{there} cannot be written", "run elsewhere, or give --out")
    free = shutil.disk_usage(there).free
    found = f"{free / 2**30:.1f} GiB free in {there}"
    return Examined("output", GOOD, found) if free > LITTLE_SPACE else Examined(
        "output", WARNING, found, "a run of an hour with its video takes about 1 GiB"
    )  # fmt: skip


def _rendering() -> Examined:
    """Whether videos can be drawn without a screen."""
    backend, reason = gl.choose_backend()
    if backend is None:
        return Examined("rendering", WARNING, reason, gl.INSTALL_COMMAND)
    return Examined("rendering", GOOD, reason)


def _encoder() -> Examined:
    """Whether videos can be encoded."""
    from escort_mj.report.video.encode import find_ffmpeg

    try:
        command = [find_ffmpeg(), "-version"]
        told = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True)
    except Exception as error:
        return Examined("ffmpeg", WARNING, f"{error}", "pip install --force-reinstall 'escort-mj[video]'")
    return Examined("ffmpeg", GOOD, " ".join(told.stdout.split()[2:3]))


def _extras() -> Iterator[Examined]:
    """What can be added."""
    metadata = importlib.metadata.metadata("escort-mj")
    needed = [Requirement(text) for text in importlib.metadata.requires("escort-mj") or ()]
    for extra in metadata.get_all("Provides-Extra") or ():
        if extra in FOR_DEVELOPERS:
            continue
        packages = [
            package.name
            for package in needed
            if package.marker is not None
            and package.marker.evaluate({"extra": extra})
            and not package.marker.evaluate({"extra": ""})
        ]
        missing = [name for name in packages if _version(name) is None]
        if missing:
            yield Examined(
                extra, GOOD, f"not installed ({', '.join(missing)})", f"pip install 'escort-mj[{extra}]'"
            )
        else:
            yield Examined(extra, GOOD, f"installed ({', '.join(packages)})")
