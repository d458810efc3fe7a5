"""Plugins that end, hold up or change the process: one error that names them, never exit code 0."""

import json
import os
import subprocess
import sys
import time
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest

from tests.corpus import read

pytestmark = pytest.mark.usefixtures("compiled")

NASTY = read(Path(__file__).with_name("nasty.yaml"))
BODIES, CHANGES = NASTY["bodies"], NASTY["changes"]
SCENARIO = """\
name: nasty
duration: 0.5
target: {position: [0, 0]}
robots: {positions: [[3, 0], [-3, 0.5]]}
mission: {radius: 3}
plugins: [KIND.py]
"""
HARMLESS = "name: good\nduration: 0.5\ntarget: {position: [0, 0]}\n"


def run(folder, kind, body, *command, timeout="1"):
    (folder / f"{kind}.py").write_text(NASTY["head"] + NASTY["kinds"][kind].replace("BODY", body))
    (folder / f"{kind}.yaml").write_text(SCENARIO.replace("KIND", kind) + NASTY["uses"][kind] + "\n")
    command = command or ("run", f"{kind}.yaml", "--no-video", "--no-figures", "--json")
    environment = os.environ | {"ESCORT_MJ_PLUGIN_TIMEOUT": timeout}
    return subprocess.run(
        [sys.executable, "-m", "escort_mj", *command],
        cwd=folder, env=environment, capture_output=True, text=True, timeout=240, check=False,
    )  # fmt: skip


def check(found, folder, kind, words, code):
    assert found.returncode == code, found.stderr
    told = json.loads(found.stdout)["message"] if found.stdout else found.stderr
    assert words in told
    assert f"{kind}.py:" in told
    assert "Traceback" not in found.stderr


def test_what_machine_code_ends_is_told(tmp_path):
    found = run(tmp_path, "metric", BODIES["exits below Python"][0])
    check(found, tmp_path, "metric", "exit code 0", 3)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["metric", "expectation"])
def test_what_loops_without_end_is_waited_for_once(tmp_path, kind):
    """A minute by default, though a metric is measured and judged, and a failed run is judged again."""
    begun = time.monotonic()
    found = run(tmp_path, kind, "while True: pass", timeout="60")
    check(found, tmp_path, kind, "takes longer than 60 s", 3)
    assert 60.0 < time.monotonic() - begun < 100.0


@pytest.mark.slow
@pytest.mark.parametrize("body", [*BODIES, *CHANGES])
@pytest.mark.parametrize("kind", ["metric", "expectation"])
def test_what_judges(tmp_path, kind, body):
    text, words = (BODIES | CHANGES)[body]
    check(run(tmp_path, kind, text), tmp_path, kind, words, 3)


@pytest.mark.parametrize(
    "body", ["seeds", *(pytest.param(each, marks=pytest.mark.slow) for each in [*BODIES, *CHANGES])]
)
def test_a_law(tmp_path, body):
    text, words = (BODIES | CHANGES)[body]
    again = {"closes a file": "Bad file descriptor"}  # in the next step, before anyone looks
    check(run(tmp_path, "law", text), tmp_path, "law", again.get(body, words), 3)


@pytest.mark.slow
@pytest.mark.parametrize("body", [*BODIES, *CHANGES])
def test_while_it_is_loaded(tmp_path, body):
    text, words = (BODIES | CHANGES)[body]
    hard = body in ("exits below Python", "crashes", "waits")
    found = run(tmp_path, "loading", text)
    assert found.returncode == (3 if hard else 2), found.stderr
    assert words in found.stderr and "loading.py" in found.stderr


@pytest.mark.slow
@pytest.mark.parametrize(
    "body", ["exits", "exits at once", "exits below Python", "crashes", "waits", "loops"]
)
def test_the_other_scenarios_of_a_check_are_judged(tmp_path, body):
    (tmp_path / "good.yaml").write_text(HARMLESS)
    command = ("check", "metric.yaml", "good.yaml", "--no-video", "--junit", "junit.xml")
    found = run(tmp_path, "metric", BODIES[body][0], *command)
    assert found.returncode == 3
    assert "metric.py:" in found.stdout and BODIES[body][1] in found.stdout
    assert "pass   good" in found.stdout
    report = ElementTree.parse(tmp_path / "junit.xml").getroot()
    assert {case.get("classname") for case in report.iter("testcase")} >= {"good"}


@pytest.mark.slow
@pytest.mark.parametrize("body", ["exits", "exits below Python", "waits"])
def test_pytest_goes_on(tmp_path, body):
    run(tmp_path, "metric", BODIES[body][0], "--version")
    (tmp_path / "good.yaml").write_text(HARMLESS)
    found = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "--escort", "-p", "no:cacheprovider", "."],
        cwd=tmp_path, env=os.environ | {"ESCORT_MJ_PLUGIN_TIMEOUT": "1"}, capture_output=True, text=True,
        timeout=240, check=False,
    )  # fmt: skip
    assert found.returncode == 1, found.stdout
    assert "metric.py:" in found.stdout and "1 passed" in found.stdout


def test_what_a_plugin_may_do(tmp_path):
    """Compute, draw from a generator of its own, and tell of it on standard error."""
    body = "print(np.random.default_rng(1).random(), file=sys.stderr)"
    found = run(tmp_path, "metric", body)
    assert found.returncode == 0, found.stdout
    assert json.loads(found.stdout)["metrics"]["bad"]["value"] == 1.0
    assert found.stderr.strip()
