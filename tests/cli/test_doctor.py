"""What the doctor sees, and what it says where something is missing."""

import importlib.metadata
from pathlib import Path
from types import SimpleNamespace

import pytest

from escort_mj import gl
from escort_mj.cli import doctor
from escort_mj.cli.doctor import BAD, GOOD, WARNING, Examined, examine_machine
from escort_mj.native import cache, shipped


def found(folder: Path) -> dict[str, Examined]:
    return {finding.check: finding for finding in examine_machine(folder)}


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(gl, "choose_backend", lambda: ("egl", "EGL works"))


def test_a_machine_that_runs_these_tests_is_fit(tmp_path: Path) -> None:
    findings = found(tmp_path)
    assert all(finding.state != BAD for finding in findings.values())
    assert findings["mujoco"].found == importlib.metadata.version("mujoco")
    assert findings["ffmpeg"].state == GOOD
    assert str(tmp_path) in findings["output"].found
    assert {"tune", "dask"} <= findings.keys() and "test" not in findings


def test_no_rendering_is_no_end_of_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(gl, "choose_backend", lambda: (None, "libEGL.so.1 is missing"))
    finding = found(tmp_path)["rendering"]
    assert (finding.state, finding.found) == (WARNING, "libEGL.so.1 is missing")
    assert finding.advice == gl.INSTALL_COMMAND


def test_versions_that_do_not_work(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    versions = {"mujoco": "4.0.0", "pydantic": "1.10", "llvmlite": None}
    real = doctor._version
    monkeypatch.setattr(doctor, "_version", lambda name: versions.get(name, real(name)))
    findings = found(tmp_path)
    assert findings["mujoco"].state == BAD and "solver" in findings["mujoco"].found
    assert findings["packages"].state == BAD
    assert "pydantic is 1.10, needed is >=2" in findings["packages"].found
    assert "llvmlite is missing" in findings["packages"].found


def test_a_full_disk_and_a_locked_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(doctor.shutil, "disk_usage", lambda _: SimpleNamespace(free=1000))
    assert found(tmp_path / "a" / "b")["output"].state == WARNING
    monkeypatch.setattr(doctor.os, "access", lambda *_: False)
    assert found(tmp_path)["output"].state == BAD


def test_kernels_that_are_compiled_again_each_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert "ship as machine code" in found(tmp_path)["kernels"].found
    monkeypatch.setattr(shipped, "count", lambda: 0)
    monkeypatch.setattr(cache.kernels, "folder", tmp_path)
    assert found(tmp_path)["kernels"].state == WARNING


def test_no_machine_code_and_no_compiler(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    real = doctor._version
    monkeypatch.setattr(shipped, "count", lambda: 0)
    monkeypatch.setattr(doctor, "_version", lambda name: None if name == "numba" else real(name))
    finding = found(tmp_path)["kernels"]
    assert finding.state == BAD and "escort-mj[compile]" in finding.advice


def test_no_encoder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import imageio_ffmpeg

    def missing() -> str:
        raise RuntimeError("no ffmpeg exe could be found")

    monkeypatch.setattr(imageio_ffmpeg, "get_ffmpeg_exe", missing)
    assert found(tmp_path)["ffmpeg"].state == WARNING
