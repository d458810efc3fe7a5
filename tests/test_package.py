"""The package as users get it: what wheel and sdist carry, and that the wheel works far from any checkout."""

import importlib.metadata
import json
import os
import re
import subprocess
import sys
import tarfile
import urllib.request
import zipfile
from pathlib import Path

import pytest

from escort_mj.version import __version__

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the wheel and the sdist."""
    folder = tmp_path_factory.mktemp("dist")
    command = [sys.executable, "-m", "hatchling", "build", "--directory", str(folder)]
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
    return folder


def the(folder: Path, pattern: str) -> Path:
    (found,) = folder.glob(pattern)
    return found


def shipped(*folders: str) -> set[str]:
    return {
        path.relative_to(ROOT).as_posix()
        for folder in folders
        for path in (ROOT / folder).rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }


def test_the_wheel_carries_code_models_and_scenarios(built: Path) -> None:
    names = {name for name in zipfile.ZipFile(the(built, "*.whl")).namelist() if ".dist-info/" not in name}
    data = {f"escort_mj/{name}" for name in shipped("models", "scenarios")}
    assert names == shipped("escort_mj") | data
    assert "escort_mj/py.typed" in names


def test_the_sdist_carries_what_its_tests_and_docs_need(built: Path) -> None:
    with tarfile.open(the(built, "*.tar.gz")) as sdist:
        names = {name.split("/", 1)[1] for name in sdist.getnames()}
    sources = shipped("escort_mj", "models", "scenarios", "tests", "examples", "requirements")
    assert {name for name in sources if "/machine_code/" not in name} <= names
    assert not any("/machine_code/" in name for name in names), "that is for wheels"
    assert {"Makefile", "pyproject.toml", "CITATION.cff", "CHANGELOG.md"} <= names
    assert not any(name.startswith(("renders", ".github")) for name in names)


def test_one_version_everywhere() -> None:
    released = re.findall(r"^## \[(\d[^]]*)\]", (ROOT / "CHANGELOG.md").read_text(), re.MULTILINE)
    assert released[0] == __version__ == importlib.metadata.version("escort-mj")


def ask_uv(*arguments: str) -> str:
    """What uv answers; nothing where it has no answer."""
    return subprocess.run(["uv", *arguments], capture_output=True, text=True).stdout.strip()


@pytest.mark.slow
@pytest.mark.timeout(1800)  # each installs a gigabyte
@pytest.mark.parametrize("version", ["3.11", "3.12", "3.13", "3.14"])
def test_the_wheel_works_in_an_empty_environment(
    built: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, version: str
) -> None:
    monkeypatch.setenv("PATH", str(Path(sys.executable).parent), prepend=os.pathsep)
    if not (python := ask_uv("python", "find", "--no-python-downloads", "--no-project", "--system", version)):
        pytest.skip(f"no Python {version} here")
    environment = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
    environment |= {"XDG_CACHE_HOME": str(tmp_path / "cache"), "UV_CACHE_DIR": ask_uv("cache", "dir")}

    def sh(*command: str) -> str:
        done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True)
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    sh("uv", "venv", "--python", python, "venv")
    wheel = f"escort-mj[video,view] @ {the(built, '*.whl').as_uri()}"
    sh("uv", "pip", "install", "--python", "venv/bin/python", wheel)
    escort = str(tmp_path / "venv" / "bin" / "escort-mj")
    place = sh("venv/bin/python", "-c", "import escort_mj; print(escort_mj.__file__)")
    assert Path(place.strip()).is_relative_to(tmp_path)
    assert not list((tmp_path / "venv").glob("lib/*/site-packages/numba")), "machine code ships"
    assert "main: completed" in sh(escort, "run", "main", "--no-video")
    sh(escort, "report", "renders/main")
    assert (tmp_path / "renders" / "main" / "report.html").stat().st_size > 100_000
    assert "2 passed" in sh(escort, "check", "main", "robots/slung", "--workers", "1")
    findings = {
        finding["check"]: finding for finding in json.loads(sh(escort, "doctor", "--json"))["findings"]
    }
    assert all(finding["state"] != "bad" for finding in findings.values())
    assert findings["ffmpeg"]["state"] == "good"
    command = [escort, "view", "main", "--port", "0"]
    with subprocess.Popen(
        command, cwd=tmp_path, env=environment | {"PYTHONUNBUFFERED": "1"}, stdout=subprocess.PIPE, text=True
    ) as viewer:
        url = re.search(r"http://127\.0\.0\.1:\d+", viewer.stdout.readline())[0]
        assert b"<html" in urllib.request.urlopen(url, timeout=60).read()
        viewer.terminate()
