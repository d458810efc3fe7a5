import os
import subprocess
import sys

import pytest

from escort_mj import gl

FAULT = "libEGL.so.1 is missing"


def as_probe(monkeypatch, tmp_path, source):
    """Puts a script in the place of the probing child."""
    script = tmp_path / "probe.py"
    script.write_text(source)
    monkeypatch.setattr(gl, "__file__", str(script))


@pytest.fixture
def faults(monkeypatch):
    """What the probes shall find, back end by back end; MUJOCO_GL is unset."""
    found = {"egl": None, "osmesa": None}
    monkeypatch.setattr(gl, "probe", lambda backend="egl": found[backend])
    monkeypatch.delenv("MUJOCO_GL", raising=False)
    return found


@pytest.fixture
def apt(monkeypatch):
    """Records commands instead of running them; `failing` holds words whose commands fail."""

    class Recorder:
        def __init__(self):
            self.commands: list[str] = []
            self.failing: set[str] = set()

        def __call__(self, command, **_):
            self.commands.append(" ".join(command))
            failed = any(word in command for word in self.failing)
            if "update" in command:
                self.failing.clear()
            return subprocess.CompletedProcess(command, int(failed), stdout="E: no such package\n")

    recorder = Recorder()
    monkeypatch.setattr(gl.subprocess, "run", recorder)
    monkeypatch.setattr(gl.shutil, "which", lambda program: f"/usr/bin/{program}")
    monkeypatch.setattr(gl.os, "geteuid", lambda: 0)
    return recorder


def test_probe_tells_the_truth_about_mujoco():
    """EGL works by our own probe exactly where MuJoCo can render with it."""
    script = "import mujoco; c = mujoco.GLContext(8, 8); c.make_current(); c.free()"
    environment = {**os.environ, "MUJOCO_GL": "egl"}
    mujoco = subprocess.run([sys.executable, "-c", script], env=environment, capture_output=True, text=True)
    assert (gl.probe() is None) == (mujoco.returncode == 0), mujoco.stderr


def test_probe_survives_a_driver_that_crashes(monkeypatch, tmp_path):
    as_probe(monkeypatch, tmp_path, "import os, signal; os.kill(os.getpid(), signal.SIGSEGV)")
    assert gl.probe() == "the egl driver crashed with SIGSEGV"


def test_probe_survives_a_driver_that_hangs(monkeypatch, tmp_path):
    as_probe(monkeypatch, tmp_path, "import time; time.sleep(60)")
    monkeypatch.setattr(gl, "_PROBE_TIMEOUT", 0.2)
    assert gl.probe() == "the egl driver gave no answer within 0.2 s"


def test_probe_repeats_what_went_wrong(monkeypatch, tmp_path):
    as_probe(monkeypatch, tmp_path, "raise ValueError('device x')")
    assert gl.probe() == "the egl probe failed: ValueError: device x"


@pytest.mark.parametrize(
    ("present", "fault"),
    [((), "libEGL.so.1 is missing"), (("libEGL.so.1",), "libGL.so.1 is missing")],
)
def test_egl_fault_names_the_missing_library(monkeypatch, present, fault):
    monkeypatch.setattr(gl, "_load", lambda *names: object() if set(names) & set(present) else None)
    assert gl._egl_fault() == fault


@pytest.mark.parametrize(
    ("asked", "broken", "backend", "reason"),
    [
        (None, [], "egl", "EGL works"),
        (None, ["egl"], "osmesa", f"OSMesa works, EGL does not: {FAULT}"),
        (None, ["egl", "osmesa"], None, FAULT),
        ("disable", [], "egl", "EGL works"),
        ("OSMesa", [], "osmesa", "MUJOCO_GL=osmesa is set"),
        ("egl", ["egl"], None, f"MUJOCO_GL=egl is set, but {FAULT}"),
        ("glfw", ["egl", "osmesa"], "glfw", "MUJOCO_GL=glfw is set"),
    ],
)
def test_choose_backend(monkeypatch, faults, asked, broken, backend, reason):
    if asked:
        monkeypatch.setenv("MUJOCO_GL", asked)
    faults.update(dict.fromkeys(broken, FAULT))
    assert gl.choose_backend() == (backend, reason)


@pytest.mark.parametrize(
    ("asked", "broken", "settled"),
    [("", [], "disable"), ("egl", [], "egl"), ("egl", ["egl"], "disable"), ("glfw", ["egl"], "glfw")],
)
def test_make_import_safe(monkeypatch, faults, asked, broken, settled):
    monkeypatch.setenv("MUJOCO_GL", asked)
    faults.update(dict.fromkeys(broken, FAULT))
    gl.make_import_safe()
    assert os.environ["MUJOCO_GL"] == settled


def test_install_as_root(faults, apt):
    assert gl.install()
    assert apt.commands == [f"env DEBIAN_FRONTEND=noninteractive {gl.INSTALL_COMMAND.removeprefix('sudo ')}"]


def test_install_updates_stale_package_lists(faults, apt):
    apt.failing.add("install")
    assert gl.install()
    assert [command.split()[3] for command in apt.commands] == ["install", "update", "install"]


def test_install_by_sudo_only_without_a_password(monkeypatch, faults, apt):
    monkeypatch.setattr(gl.os, "geteuid", lambda: 1000)
    assert gl.install()
    assert all(command.startswith("sudo -n ") for command in apt.commands)

    apt.commands.clear()
    apt.failing.add("true")
    assert not gl.install()
    assert apt.commands == ["sudo -n true"]


def test_install_leaves_a_system_without_apt_alone(monkeypatch, faults, apt):
    monkeypatch.setattr(gl.shutil, "which", lambda program: None)
    assert not gl.install()
    assert apt.commands == []


def test_main_never_fails_a_run(monkeypatch, faults, capsys):
    faults.update(egl=FAULT, osmesa=FAULT)
    monkeypatch.setattr(gl, "install", lambda: False)
    assert gl.main_gl(["--install"]) == 0
    output = capsys.readouterr().out
    assert FAULT in output
    assert gl.INSTALL_COMMAND in output
    assert gl.main_gl([]) == 1


def test_main_says_that_it_works(faults, capsys):
    assert gl.main_gl([]) == 0
    assert capsys.readouterr().out == "Videos can be rendered: EGL works.\n"
