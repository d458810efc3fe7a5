"""Can this machine draw without a screen? Found out before MuJoCo is imported.

MuJoCo reads MUJOCO_GL once, and `import mujoco` itself fails where the back end it names is missing. So
the simulation runs with MUJOCO_GL=disable, a child process draws, and `choose_backend` says with what.
Every probe is a child process too: a broken driver may hang or crash, and libraries once loaded stay.
"""

from __future__ import annotations

import argparse
import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable
from ctypes import CDLL, CFUNCTYPE, POINTER, byref, c_char_p, c_int, c_uint, c_void_p
from typing import Any

PACKAGES = ("libegl1", "libgl1", "libgl1-mesa-dri")
_APT_INSTALL = ("install", "-y", "--no-install-recommends", *PACKAGES)
INSTALL_COMMAND = " ".join(("sudo", "apt-get", *_APT_INSTALL))

_PROBE_TIMEOUT = 60.0  # [s]
_APT_TIMEOUT = 600.0  # [s]


def probe(backend: str = "egl") -> str | None:
    """Tells why a rendering back end does not work here.

    Args:
        backend: "egl" or "osmesa".

    Returns:
        None when the back end works, else the reason.
    """
    command = [sys.executable, "-I", "-S", __file__, "--probe", backend]
    try:
        child = subprocess.run(command, capture_output=True, text=True, timeout=_PROBE_TIMEOUT)
    except subprocess.TimeoutExpired:
        return f"the {backend} driver gave no answer within {_PROBE_TIMEOUT:g} s"
    if child.returncode < 0:
        return f"the {backend} driver crashed with {signal.Signals(-child.returncode).name}"
    if child.returncode > 0:
        return f"the {backend} probe failed: {_last_line(child.stderr)}"
    return child.stdout.strip() or None


def choose_backend() -> tuple[str | None, str]:
    """Choose what the rendering child shall be given as MUJOCO_GL.

    A MUJOCO_GL that the user set is kept; "disable" counts as unset, because the simulation sets that itself.

    Returns:
        The back end, or None where nothing can be drawn, and the reason.
    """
    asked = os.environ.get("MUJOCO_GL", "").lower()
    if asked == "glfw":  # needs a screen, and only opening a window would tell
        return asked, "MUJOCO_GL=glfw is set"
    if asked in _PROBES:
        if fault := probe(asked):
            return None, f"MUJOCO_GL={asked} is set, but {fault}"
        return asked, f"MUJOCO_GL={asked} is set"
    fault = probe("egl")
    if fault is None:
        return "egl", "EGL works"
    if probe("osmesa") is None:
        return "osmesa", f"OSMesa works, EGL does not: {fault}"
    return None, fault


def make_import_safe() -> None:
    """Disables rendering here unless a MUJOCO_GL that works is set. To be called before `import mujoco`."""
    asked = os.environ.get("MUJOCO_GL", "").lower()
    if not asked or (asked in _PROBES and probe(asked)):
        os.environ["MUJOCO_GL"] = "disable"


def install() -> bool:
    """Installs Mesa's software EGL where no one need be asked: by apt, as root or with password-free sudo.

    Returns:
        Whether EGL works afterwards.
    """
    become_root = _become_root()
    if become_root is None or shutil.which("apt-get") is None:
        return False

    def apt(*arguments: str) -> subprocess.CompletedProcess[str]:
        command = [*become_root, "env", "DEBIAN_FRONTEND=noninteractive", "apt-get", *arguments]
        return subprocess.run(
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            timeout=_APT_TIMEOUT,
        )

    print(f"Installing Mesa's software renderer ({' '.join(PACKAGES)}) ...", flush=True)
    try:
        outcome = apt(*_APT_INSTALL)
        if outcome.returncode:  # a fresh container has no package lists, an old machine stale ones
            apt("update")
            outcome = apt(*_APT_INSTALL)
    except subprocess.TimeoutExpired:
        print(f"apt-get gave no answer within {_APT_TIMEOUT:g} s.")
        return False
    if outcome.returncode:
        print(f"apt-get failed: {_last_line(outcome.stdout)}")
    return probe() is None


def main_gl(arguments: list[str] | None = None) -> int:
    """Runs `python -m escort_mj.gl [--install]`: says whether videos can be rendered here.

    Returns:
        The exit code. With --install it is always 0: a run without a video is still a run.
    """
    parser = argparse.ArgumentParser(prog="python -m escort_mj.gl", description=__doc__.splitlines()[0])
    parser.add_argument("--install", action="store_true", help="install Mesa's EGL if missing and allowed")
    parser.add_argument("--probe", choices=_PROBES, help=argparse.SUPPRESS)
    options = parser.parse_args(arguments)
    if options.probe:
        print(_PROBES[options.probe]() or "")
        return 0
    backend, reason = choose_backend()
    if backend is None and options.install and install():
        backend, reason = choose_backend()
    if backend is None:
        print(f"No video can be rendered: {reason}. All else works. This command adds Mesa's EGL:")
        print(f"    {INSTALL_COMMAND}")
    else:
        print(f"Videos can be rendered: {reason}.")
    return 0 if backend or options.install else 1


def _become_root() -> list[str] | None:
    """What to put before a command to run it as root, or None where root cannot be had silently."""
    if os.geteuid() == 0:
        return []
    sudo = ["sudo", "-n"]
    if shutil.which("sudo") and subprocess.run([*sudo, "true"], capture_output=True).returncode == 0:
        return sudo
    return None


def _last_line(text: str) -> str:
    return (text.strip() or "it said nothing").splitlines()[-1]


def _load(*names: str) -> CDLL | None:
    """Load the first of these shared libraries that is there."""
    for name in names:
        try:
            return CDLL(name)
        except OSError:
            continue
    return None


def _egl_fault() -> str | None:
    """Create a current OpenGL context through EGL, as MuJoCo does. Run only in a child process."""
    egl = _load("libEGL.so.1")
    if egl is None:
        return "libEGL.so.1 is missing"
    if _load("libOpenGL.so.0", "libGL.so.1", "libGLESv2.so.2") is None:
        return "libGL.so.1 is missing"

    def function(name: str, result: Any, *arguments: Any) -> Callable[..., Any] | None:
        egl.eglGetProcAddress.restype, egl.eglGetProcAddress.argtypes = c_void_p, [c_char_p]
        address = egl.eglGetProcAddress(name.encode())
        return CFUNCTYPE(result, *arguments)(address) if address else None

    query_devices = function("eglQueryDevicesEXT", c_uint, c_int, POINTER(c_void_p), POINTER(c_int))
    platform_display = function("eglGetPlatformDisplayEXT", c_void_p, c_uint, c_void_p, c_void_p)
    if query_devices is None or platform_display is None:
        return "libEGL.so.1 cannot open a display without a screen"
    devices, count = (c_void_p * 16)(), c_int()
    query_devices(len(devices), devices, byref(count))
    usable = devices[: count.value]
    if (index := os.environ.get("MUJOCO_EGL_DEVICE_ID")) is not None:
        usable = usable[int(index) :][:1]
    for device in usable:
        display = c_void_p(platform_display(0x313F, device, None))  # EGL_PLATFORM_DEVICE_EXT
        if display and egl.eglInitialize(display, None, None):
            return None if _egl_context(egl, display) else "EGL opens no OpenGL context"
    return "EGL finds no device, not even a software one (libgl1-mesa-dri brings one)"


def _egl_context(egl: CDLL, display: c_void_p) -> bool:
    """Make an OpenGL context current on the display, with no surface, and tell whether that worked."""
    wanted = (
        (0x3024, 8),  # EGL_RED_SIZE
        (0x3023, 8),  # EGL_GREEN_SIZE
        (0x3022, 8),  # EGL_BLUE_SIZE
        (0x3021, 8),  # EGL_ALPHA_SIZE
        (0x3025, 24),  # EGL_DEPTH_SIZE
        (0x3026, 8),  # EGL_STENCIL_SIZE
        (0x3033, 1),  # EGL_SURFACE_TYPE: EGL_PBUFFER_BIT
        (0x3040, 8),  # EGL_RENDERABLE_TYPE: EGL_OPENGL_BIT
    )
    none = 0x3038  # EGL_NONE ends the list
    attributes = (c_int * 17)(*(number for pair in wanted for number in pair), none)
    config, count = c_void_p(), c_int()
    egl.eglChooseConfig(display, attributes, byref(config), 1, byref(count))
    if count.value == 0 or not egl.eglBindAPI(0x30A2):  # EGL_OPENGL_API
        return False
    egl.eglCreateContext.restype = c_void_p
    context = c_void_p(egl.eglCreateContext(display, config, None, None))
    return bool(context) and bool(egl.eglMakeCurrent(display, None, None, context))


def _osmesa_fault() -> str | None:
    """Make an OSMesa context. Run only in a child process."""
    osmesa = _load("libOSMesa.so.8", "libOSMesa.so.6", "libOSMesa.so")
    if osmesa is None:
        return "libOSMesa.so.8 is missing (libosmesa6 brings it)"
    osmesa.OSMesaCreateContextExt.restype = c_void_p
    rgba, depth, stencil, accumulation = 0x1908, 24, 8, 0
    context = osmesa.OSMesaCreateContextExt(rgba, depth, stencil, accumulation, None)
    return None if context else "OSMesa opens no OpenGL context"


_PROBES: dict[str, Callable[[], str | None]] = {"egl": _egl_fault, "osmesa": _osmesa_fault}

if __name__ == "__main__":
    sys.exit(main_gl())
