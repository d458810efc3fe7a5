"""Plugins that end, hold up or change the process: one error that names them, never exit code 0."""

import json
import os
import subprocess
import sys
import time
import xml.etree.ElementTree as ElementTree

import pytest

pytestmark = pytest.mark.usefixtures("compiled")

HEAD = """\
import ctypes, math, os, random, signal, subprocess, sys, threading, time, warnings
from typing import Literal
import numpy as np
from pydantic import PositiveFloat
from escort_mj.plugins import *
"""
KINDS = {
    "metric": """\
@metric(unit="m")
def bad(trace):
    \"\"\"A metric.\"\"\"
    BODY
    return 1.0
""",
    "expectation": """\
class Bad(Expectation):
    \"\"\"An expectation.\"\"\"
    kind = "bad"
    bad: PositiveFloat
    \"\"\"Bound [m].\"\"\"
    def judge(self, trace):
        BODY
        return Judgment(held=True, words="w")
""",
    "law": """\
class Bad(Law):
    \"\"\"A law.\"\"\"
    law: Literal["bad"] = "bad"
    def force(self, r):
        if r.time > 0.2:
            BODY
        return 30.0 * r.e + 50.0 * r.e_dot
""",
    "loading": """\
BODY
@metric(unit="m")
def bad(trace):
    \"\"\"A metric.\"\"\"
    return 1.0
""",
}
USES = {
    "metric": "expect: [{metric: bad, at_most: 5}]",
    "expectation": "expect: [{bad: 1}]",
    "law": "controller: {law: bad}",
    "loading": "expect: [{metric: bad, at_most: 5}]",
}
SCENARIO = """\
name: nasty
duration: 0.5
target: {position: [0, 0]}
robots: {positions: [[3, 0], [-3, 0.5]]}
mission: {radius: 3}
plugins: [KIND.py]
"""
HARMLESS = "name: good\nduration: 0.5\ntarget: {position: [0, 0]}\n"
BODIES = {
    "exits": ("sys.exit(0)", "SystemExit: 0"),
    "exits at once": ("os._exit(0)", "ends the process"),
    "exits below Python": ("ctypes.CDLL(None)._exit(0)", "exit code 0"),
    "exits in __del__": ("type('D', (), {'__del__': lambda s: os._exit(0)})()", "ends the process"),
    "raises in __del__": ("type('D', (), {'__del__': lambda s: 1 / 0})()", "raises ZeroDivisionError"),
    "crashes": ("ctypes.string_at(0)", "SIGSEGV"),
    "kills": ("os.kill(os.getpid(), 9)", "sends a signal"),
    "interrupts": ("raise KeyboardInterrupt", "KeyboardInterrupt"),
    "raises an error of its own": ("raise type('Own', (BaseException,), {})('gone')", "Own: gone"),
    "prints": ("print('hello')", "prints to standard output"),
    "closes stdout": ("sys.stdout.close()", "standard output"),
    "warns": ("warnings.warn('careful')", "UserWarning: careful"),
    "divides by zero": ("np.log(np.zeros(1))", "RuntimeWarning"),
    "starts a thread": ("threading.Thread(target=time.sleep, args=(1,)).start()", "starts a thread"),
    "starts a process": ("subprocess.Popen(['true'])", "starts a process"),
    "changes the folder": ("os.chdir('/')", "working directory"),
    "changes the environment": ("os.environ['X'] = '1'", "environment"),
    "waits": ("time.sleep(1e6)", "takes longer than 1 s"),
    "loops": ("while True: pass", "takes longer than 1 s"),
}  # fmt: skip
CHANGES = {
    "replaces sys.exit": ("sys.exit = print", "sys.exit"),
    "seterr": ("np.seterr(all='raise')", "np.seterr"),
    "seeds": ("np.random.seed(1)", "random numbers"),
    "draws": ("random.random()", "random numbers"),
    "handles signals": ("signal.signal(signal.SIGUSR1, signal.SIG_IGN)", "handles signals"),
    "hides warnings": ("warnings.simplefilter('error')", "warnings"),
    "replaces stdout": ("sys.stdout = None", "standard stream"),
    "closes a file": ("os.close(1)", "standard stream"),
    "replaces a metric": (
        "import escort_mj.metrics.metric as m; m.Metric.of = lambda *_: m.Measure(0.0)",
        "replaces Metric.of",
    ),
}
"""What is found after the call."""


def run(folder, kind, body, *command, timeout="1"):
    (folder / f"{kind}.py").write_text(HEAD + KINDS[kind].replace("BODY", body))
    (folder / f"{kind}.yaml").write_text(SCENARIO.replace("KIND", kind) + USES[kind] + "\n")
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
