"""`pytest scenarios/`: what is collected, what passes and fails, and how that reads."""

import os
import re
import shutil
import subprocess
import sys
from contextlib import redirect_stderr, redirect_stdout
from importlib.metadata import entry_points
from io import StringIO
from pathlib import Path

import pytest

from escort_mj import api
from escort_mj.recognize import is_scenario
from escort_mj.study.engine.store import Store

SCHEMA = Path(__file__).parents[1] / "scenarios" / "schema.json"
HEAD = f"# yaml-language-server: $schema={SCHEMA}\n"
BODY = """\
duration: 2
robots: {positions: [[5, 0], [-5, 0]]}
mission: {radius: 5, behaviors: [surface]}
expect:
"""
GOOD = BODY + "  - {contacts: none}\n  - {metric: radius_error_max, at_most: 0.5}\n"
FAILS = BODY + "  - {contacts: none}\n\n  - {metric: force_rms, at_least: 5}\n"
FILES = {
    "good": GOOD,
    "fails": FAILS,
    "known": BODY + "  - {metric: force_rms, at_least: 5, xfail: much too weak}\n",
    "strict": BODY + "  - {contacts: none, xfail: they touch}\n",
    "bad": BODY + "  - {contacts: nobody}\nrobotos: {}\n",
    "breaks": GOOD,
    "diverges": GOOD.replace("surface]}", "surface]}\nuncertainty: {disturbance: [0, 1000]}"),
}
# Notes every run of a scenario, and who draws; nothing is drawn.
SPY = """
import escort_mj.report.video.video as video, escort_mj.study.engine.work as work
fly = work.fly

def noted(scenario, *rest, **how):
    with open("runs.txt", "a") as file:
        file.write(scenario.name + "\\n")
    if scenario.name == "breaks":
        1 / 0
    return fly(scenario, *rest, **how)

work.fly = noted
video.render_clip = lambda folder: folder / "clip.mp4"
"""
PYTHON = """
import pytest
from escort_mj.errors import ScenarioError
from escort_mj.testing import assert_metric, assert_no_contacts, assert_passed, assert_settled

def test_good(escort_run):
    run = escort_run("flown.yaml")
    assert_passed(run)
    assert_no_contacts(run)
    assert_settled(run, within=0.5, by=1)
    assert escort_run("flown.yaml") is run

def test_bad(escort_run):
    assert_metric(escort_run("flown.yaml"), "force_rms", at_least=5)

def test_unknown(escort_run):
    with pytest.raises(ScenarioError, match="this scenario has none"):
        assert_no_contacts(escort_run("flown.yaml"), between=("robots", "walls"))
"""
INSTALLED = any(one.value == "escort_mj.pytest_plugin" for one in entry_points(group="pytest11"))
PLUGIN = [] if INSTALLED else ["-p", "escort_mj.pytest_plugin"]


class Session:
    """What one call of pytest printed."""

    def __init__(self, folder: Path, *arguments: str) -> None:
        # Asserts of the whole package would be rewritten first, which takes as long as the rest.
        options = ["-p", "no:cacheprovider", "--assert=plain", *PLUGIN]
        command = [sys.executable, "-m", "pytest", *options, *arguments]
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, env=_environment())
        self.out, self.code = done.stdout, done.returncode
        assert not done.stderr, done.stderr

    @property
    def outcomes(self) -> dict[str, int]:
        """The numbers of the last line."""
        return {
            word: int(number) for number, word in re.findall(r"(\d+) ([a-z]+)", self.out.splitlines()[-1])
        }

    def part(self, title: str) -> str:
        """What is printed of one failure."""
        return re.split(r"\n(?:_{3}|={3})", re.split(rf"_ {title} _+", self.out)[1])[0] + "\n"


def collected(*arguments: str) -> str:
    """What a session in this process collects in its folder."""
    without = ("-p", "no:cacheprovider", "-p", "no:xdist", "-p", "no:timeout")
    with redirect_stdout(StringIO()) as out:
        pytest.main(["--collect-only", "--capture=no", *without, *PLUGIN, *arguments])
    return out.getvalue()


def usage_error(*arguments: str) -> str:
    """What pytest says of wrong arguments, in this process."""
    with redirect_stderr(StringIO()) as err:
        pytest.main(["-p", "no:cacheprovider", *PLUGIN, *arguments])
    return err.getvalue()


def _environment() -> dict[str, str]:
    return {key: value for key, value in os.environ.items() if not key.startswith("PYTEST")}


def write(folder: Path, head: str = HEAD, suffix: str = ".yaml", **files: str) -> Path:
    for name, text in files.items():
        named = "" if "duration" not in text else f"name: {name}\n"
        (folder / f"{name}{suffix}").write_text(head + named + text)
    return folder


@pytest.fixture(scope="module")
def session(tmp_path_factory) -> Session:
    folder = write(tmp_path_factory.mktemp("all"), **FILES)
    write(folder, head="", flown=GOOD)
    (folder / "test_it.py").write_text(PYTHON)
    (folder / "conftest.py").write_text(SPY)
    session = Session(folder, "-v", "-rxX", "--escort-video", "--escort-out", "kept")
    session.folder = folder
    return session


def test_one_test_per_expectation_and_one_for_the_outcome(session):
    for name in ("outcome", "contacts", "radius_error_max"):
        assert re.search(rf"good\.yaml::{name} PASSED", session.out)
    outcomes = {word: session.outcomes[word] for word in ("failed", "passed", "xfailed")}
    assert outcomes == {"failed": 9, "passed": 10, "xfailed": 1}
    assert session.code == 1


def test_a_failure_reads_without_a_traceback(session):
    part = session.part("fails: force_rms")
    assert re.search(
        r"\nforce_rms at least 5 N: \S+ N\n  at fails.yaml:9\n  kept: kept/fails/clip.mp4\n", part
    )
    for word in ("Traceback", "runtest", "pytest_plugin.py", "\nE  "):
        assert word not in part


def test_known_failures_are_strict(session):
    assert re.search(r"XFAIL known\.yaml::force_rms - much too weak", session.out)
    assert re.search(r"\[XPASS\(strict\)\] they touch", session.out)


def test_a_wrong_scenario_is_one_failure_and_the_others_run(session):
    assert 'bad.yaml:7:16: expect[0].contacts: found "nobody"; expected none' in session.out
    assert "bad.yaml:8:1: robotos: is not a key" in session.out
    assert session.out.count("bad.yaml::") == 1


def test_a_run_that_breaks_off_says_why(session):
    part = session.out.partition("diverges: outcome")[2]
    assert re.search(r"outcome completed: diverged.*\n  robot \d is \d+ m from the target", part)


def test_each_scenario_runs_once_and_what_failed_is_kept(session):
    runs = (session.folder / "runs.txt").read_text().split()
    assert sorted(runs) == ["breaks", "diverges", "fails", "good", "known", "strict"]
    kept = {path.parent.name for path in (session.folder / "kept").rglob("trace.nc")}
    assert kept == {"fails", "strict", "diverges", "flown-seed-0"}


def test_a_program_error_shows_where(session):
    part = session.part("breaks: contacts")
    assert re.search(r"the program broke:\nTraceback(.|\n)*1 / 0\n(.|\n)*ZeroDivisionError", part)


class TestWhatIsCollected:
    def test_nothing_of_others_for_whom_nothing_is_loaded(self, tmp_path):
        write(
            tmp_path,
            head="",
            ci="on: push\n",
            study="vary: {}\nmission: x\n",
            plain=GOOD,
            broken="a: [",
            empty="",
        )
        (tmp_path / "test_x.py").write_text("def test_x(): pass\n")
        (tmp_path / "conftest.py").write_text(
            "import sys\n"
            "def pytest_unconfigure(config):\n"
            "    heavy = {'numba', 'numpy', 'mujoco', 'xarray', 'pydantic', 'matplotlib', 'ruamel'}\n"
            "    print('loaded:', sorted(heavy & set(sys.modules)))\n"
        )
        found = Session(tmp_path, "-p", "no:hypothesispytest")
        assert " 1 passed" in found.out and "loaded: []" in found.out

    def test_what_looks_like_one_if_asked(self, tmp_path, monkeypatch):
        write(tmp_path, head="", good=GOOD, study="vary: {}\n")
        monkeypatch.chdir(tmp_path)
        assert "3 tests collected" in collected("--escort")

    def test_seeds_in_the_ids(self, tmp_path, monkeypatch):
        write(tmp_path, head="", good="seed: 7\n" + GOOD, bad=FILES["bad"])
        monkeypatch.chdir(tmp_path)
        found = collected("--escort", "--escort-seeds", "2", "-q")
        expected = [
            f"good.yaml::{name}[seed-{seed}]"
            for seed in (7, 8)
            for name in ("outcome", "contacts", "radius_error_max")
        ]
        assert [line for line in found.splitlines() if "::" in line] == ["bad.yaml::scenario", *expected]
        assert "found 0; expected a whole number from 1" in usage_error("--escort-seeds", "0")

    def test_no_output_of_the_program(self, tmp_path, monkeypatch):
        write(tmp_path, good=GOOD)
        (tmp_path / "deep").mkdir()
        monkeypatch.chdir(tmp_path)
        api.run("good.yaml", "deep/mine", figures=False, video=False)
        written = ["deep/mine/scenario.yaml", "deep/mine/resolved.yaml"]
        (tmp_path / "kept").mkdir()
        Store(tmp_path / "kept").close()
        for name in ("best.yaml", "worst/cell0_seed3.yaml", "counterexamples/x_1.yaml"):
            file = tmp_path / "kept" / name
            file.parent.mkdir(exist_ok=True)
            shutil.copy("good.yaml", file)
            written.append(f"kept/{name}")
        found = collected(*written, "-q")
        assert all(f"{name}::contacts" in found for name in written), found  # each is one, by its name
        shutil.copy("good.yaml", "kept/mine.yaml")
        found = collected(".", "--escort", "-q")
        names = {line.partition("::")[0] for line in found.splitlines() if "::" in line}
        assert names == {"good.yaml", "kept/mine.yaml"}
        assert "--escort collects them" not in collected("deep/mine")

    def test_what_the_settings_name(self, tmp_path, monkeypatch):
        write(tmp_path, head="", good=GOOD, other=GOOD)
        (tmp_path / "pytest.ini").write_text("[pytest]\nescort_files = goo*.yaml missions/*\n")
        monkeypatch.chdir(tmp_path)
        found = collected()
        assert "3 tests collected" in found and "ScenarioFile good.yaml" in found

    def test_our_own_tests_collect_none(self, pytestconfig):
        assert pytestconfig.getini("testpaths") == ["tests"]
        folder = Path(__file__).parent
        files = [*folder.rglob("*.yaml"), *folder.rglob("*.yml")]
        assert files and not [path for path in files if is_scenario(path)]


@pytest.mark.slow
def test_what_the_commands_write_is_not_collected(tmp_path, monkeypatch, pytester_run):
    (tmp_path / "bare.yaml").write_text("name: bare\n" + FAILS)
    study = "study: s\nscenario: bare.yaml\nseeds: 2\n"
    (tmp_path / "s.yaml").write_text(study + "traces: failed\nvary: {robots.mass: [1, 2]}\n")
    (tmp_path / "f.yaml").write_text(study + "falsify: {over: {robots.mass: {low: 1, high: 2}}, runs: 4}\n")
    for words in (
        "check . --no-video",
        "run bare.yaml --no-video --no-figures",
        "sweep s.yaml --workers 1",
        "report renders/studies/s",
        "falsify f.yaml --workers 1 --no-video",
        "compare bare.yaml --laws pd,asmc --workers 1",
    ):
        subprocess.run([sys.executable, "-m", "escort_mj", *words.split()], cwd=tmp_path, capture_output=True)
    written = {path.parent.name for path in (tmp_path / "renders").rglob("*.yaml")}
    assert {"bare", "worst", "counterexamples"} <= written, written
    for _ in range(2):
        found = pytester_run(".", "--escort", "--escort-video", "--escort-out", "kept", "-q")
        assert "1 failed, 2 passed" in found, found


@pytest.mark.slow
def test_side_by_side_each_runs_once(tmp_path):
    files = {f"mission_{k}": GOOD for k in range(4)}
    (write(tmp_path, **files) / "conftest.py").write_text(SPY)
    found = Session(tmp_path, "-n", "2")
    assert found.outcomes["passed"] == 12
    assert sorted((tmp_path / "runs.txt").read_text().split()) == sorted(files)


def test_assertions_in_python(session):
    for name, word in (("good", "PASSED"), ("bad", "FAILED"), ("unknown", "PASSED")):
        assert re.search(rf"test_it\.py::test_{name} {word}", session.out)
    assert re.search(r"E +escort_mj\.testing\.VerdictError: force_rms at least 5 N: ", session.out)
    assert "testing.py" not in session.out
    assert "kept/runs/flown-seed-0/clip.mp4" in session.out


def test_a_file_without_a_schema_is_collected_by_its_name_and_a_folder_gets_a_hint(pytester_run) -> None:
    named = pytester_run("bare.yaml", "--collect-only", "-q")
    assert "bare.yaml::outcome" in named and "2 tests collected" in named
    hinted = pytester_run(".", "-q")
    assert "--escort collects them" in hinted and "passed" not in hinted


@pytest.fixture
def pytester_run(tmp_path, monkeypatch):
    """Runs pytest in this process, in a folder with a scenario that names no schema."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "bare.yaml").write_text("name: bare\n" + BODY + "  - {contacts: none}\n")

    def run(*arguments: str) -> str:
        said = StringIO()
        with redirect_stdout(said):
            pytest.main([*arguments, *PLUGIN, "-p", "no:cacheprovider", "--rootdir", str(tmp_path)])
        return said.getvalue()

    return run
