"""pytest collects scenarios: `pytest scenarios/` runs each of them once per seed, one test per expectation.

A YAML file is collected if its first lines name the JSON Schema of scenarios or `escort_files` in pytest's
settings names it. One that looks like a scenario is collected by its name on the command line or with
`--escort`. What runs and studies left is collected by its name only. Until then nothing is loaded that takes
time.
"""

from __future__ import annotations

import argparse
import os
import shutil
from collections.abc import Callable, Generator, Iterable
from dataclasses import asdict
from fnmatch import fnmatch
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from escort_mj.recognize import SUFFIXES, is_output, is_scenario

if TYPE_CHECKING:
    from escort_mj.api.runs import Run
    from escort_mj.study.checked import Case, Checked

FOLDERS = pytest.StashKey[dict[int, Path]]()
"""Run folders of the runs that tests in Python asked for, by the run's identity."""


def pytest_addoption(parser: pytest.Parser) -> None:
    """Adds options to the command line and to pytest's settings."""
    group = parser.getgroup("escort-mj", "escort missions")
    group.addoption(
        "--escort", action="store_true", help="collect every YAML file that looks like a scenario"
    )
    group.addoption(
        "--escort-seeds",
        type=_count,
        default=1,
        metavar="N",
        help="seeds per scenario, from the scenario's own upward [%(default)s]",
    )
    group.addoption("--escort-video", action="store_true", help="keep run folder and clip of what fails")
    group.addoption(
        "--escort-out", default="renders/pytest", metavar="DIR", help="where they go [%(default)s]"
    )
    parser.addini("escort_files", "YAML files that are scenarios, as patterns from the root", "args", [])


def _count(text: str) -> int:
    """A number of seeds.

    Raises:
        ArgumentTypeError: If it is none.
    """
    if not text.isdecimal() or not int(text):
        raise argparse.ArgumentTypeError(f"found {text}; expected a whole number from 1")
    return int(text)


def pytest_configure(config: pytest.Config) -> None:
    """Makes room for what is kept of a session."""
    config.stash[FOLDERS] = {}


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> ScenarioFile | None:
    """Collect a file if it is a scenario."""
    if file_path.suffix not in SUFFIXES:
        return None
    config = parent.config
    place = os.path.relpath(file_path, config.rootpath)
    named = any(fnmatch(place, pattern) for pattern in config.getini("escort_files"))
    by_name = file_path in _places(config)
    if not named and not is_scenario(file_path, asked=config.getoption("escort") or by_name):
        return None
    if not by_name and is_output(file_path):
        return None
    found: ScenarioFile = ScenarioFile.from_parent(parent, path=file_path)
    return found


def pytest_terminal_summary(
    terminalreporter: pytest.TerminalReporter, exitstatus: int, config: pytest.Config
) -> None:
    """Say which option collects the scenarios, if there are some and nothing was collected."""
    if exitstatus == pytest.ExitCode.NO_TESTS_COLLECTED and any(
        _holds_scenarios(place, asked=True) for place in _places(config)
    ):
        terminalreporter.write_line(
            "escort_mj: YAML files here look like scenarios; --escort collects them, or begin them with "
            "# yaml-language-server: $schema=schema.json (escort-mj new writes both)"
        )


def _places(config: pytest.Config) -> list[Path]:
    """Return the files and folders that the command line names."""
    return [config.invocation_params.dir / argument.partition("::")[0] for argument in config.args]


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """Keep the tests of one file in one process where scenarios are tested, so that each runs once."""
    asked = config.getoption("escort")
    if config.getoption("dist") != "load" or not any(
        _holds_scenarios(place, asked or place.is_file()) for place in _places(config)
    ):
        return None
    from xdist.scheduler import LoadFileScheduling

    return LoadFileScheduling(config, log)


def _holds_scenarios(path: Path, asked: bool) -> bool:
    """Whether a path is a scenario, or a folder with one in it."""
    files = path.iterdir() if path.is_dir() else [path] if path.is_file() else []
    return any(is_scenario(file, asked) and (file == path or not is_output(file)) for file in files)


class ScenarioFile(pytest.File):
    """A scenario: the run of each seed is made when the first of its tests needs it.

    Attributes:
        has_plugins: Whether it has plugins, which could end the process that runs it.
    """

    has_plugins = False

    def collect(self) -> Iterable[ScenarioTest]:
        """Per seed one test for the outcome and one per expectation, or one that says what is wrong."""
        from escort_mj.errors import EscortError
        from escort_mj.expect.verdicts import judges_outcome
        from escort_mj.scenario.reader.load import expectation_lines, load_file
        from escort_mj.study.checked import Case, with_seeds

        label = os.path.relpath(self.path.with_suffix(""), self.config.rootpath)
        case = Case(self.path, label.replace("..", "up"))
        try:
            scenario = load_file(self.path)
        except EscortError:
            yield self._test(case, "scenario", None, 1)
            return
        expected, self.has_plugins = scenario.expect, bool(scenario.plugins)
        lines = expectation_lines(self.path)
        for run in with_seeds([case], self.config.getoption("escort_seeds")):
            names: dict[str, int] = {}
            if not any(judges_outcome(one) for one in expected):
                names["outcome"] = 1
                yield self._test(run, "outcome", None, 1)
            for place, (one, line) in enumerate(zip(expected, lines, strict=True)):
                number = names[one.subject] = names.get(one.subject, 0) + 1
                name = one.subject if number == 1 else f"{one.subject} {number}"
                test = self._test(run, name, place, line)
                if one.skip is not None:
                    test.add_marker(pytest.mark.skip(reason=one.skip))
                elif one.xfail is not None:
                    test.add_marker(pytest.mark.xfail(reason=one.xfail, strict=True, raises=NotHeld))
                yield test

    def _test(self, case: Case, name: str, place: int | None, line: int) -> ScenarioTest:
        named = name if case.seed is None else f"{name}[seed-{case.seed}]"
        test: ScenarioTest = ScenarioTest.from_parent(self, name=named, case=case, place=place, line=line)
        return test

    @cache  # noqa: B019  a session's files live as long as the session
    def checked(self, case: Case) -> Checked:
        """What came of the scenario with one seed."""
        from escort_mj.report.video.video import render_clip
        from escort_mj.study.check import check_alone

        keeps = self.config.getoption("escort_video")
        folder = _out(self.config) / case.name if keeps else None
        return check_alone(case, folder, render_clip if keeps else None, apart=self.has_plugins)


class NotHeld(pytest.fail.Exception):  # type: ignore[name-defined]
    """A failure that the scenario expects."""


class ScenarioTest(pytest.Item):
    """One expectation of a scenario, with one seed."""

    parent: ScenarioFile

    def __init__(self, *, case: Case, place: int | None, line: int, **rest: Any) -> None:
        """Notes which expectation it is.

        Args:
            case: The scenario and the seed.
            place: In the scenario's list, from 0; None for the outcome that every run has.
            line: Where it stands in the file, from 1.
            rest: For pytest.
        """
        super().__init__(**rest)
        self._case, self._place, self._line = case, place, line

    def runtest(self) -> None:
        """Fails with a message, and no traceback, where what is expected does not hold."""
        checked = self.parent.checked(self._case)
        if checked.faults or checked.error:
            wrong = "\n".join(map(str, checked.faults)).replace(str(self.path), os.path.relpath(self.path))
            pytest.fail(wrong or f"the program broke:\n{checked.error}", pytrace=False)
        verdict = next(one for one in checked.verdicts if one.expectation == self._place)
        if verdict.held:
            return
        lines = [verdict.message, f"  at {os.path.relpath(self.path)}:{self._line}"]
        if verdict is checked.verdicts[0]:
            lines.insert(1, f"  {checked.message}")
        if kept := checked.clip or checked.folder:
            lines.append(f"  kept: {os.path.relpath(kept)}")
        if self._case.seed is not None:
            lines.append(f"  again: {self._case._replace(path=Path(os.path.relpath(self.path))).command}")
        if checked.note:
            lines.append(f"  {checked.note}")
        if verdict.xfail and verdict.passed:
            raise NotHeld("\n".join(lines), pytrace=False)
        pytest.fail("\n".join(lines), pytrace=False)

    def reportinfo(self) -> tuple[Path, int, str]:
        """Where it stands, for reports."""
        return self.path, self._line - 1, f"{self.path.stem}: {self.name}"


@pytest.fixture(scope="session")
def escort_run(pytestconfig: pytest.Config) -> Callable[..., Run]:
    """Run a scenario, once for all tests of a process that ask for the same.

    Called as `escort_run("main", {"duration": 20})`: a file or a shipped scenario's name, then overrides.
    """
    from escort_mj import api
    from escort_mj.scenario import dump_scenario

    known: dict[str, Run] = {}
    names: dict[str, int] = {}

    def run(path: str | os.PathLike[str], overrides: Any = ()) -> Run:
        scenario = api.load_scenario(path, overrides)
        key = dump_scenario(scenario)
        if key not in known:
            folder = None
            if pytestconfig.getoption("escort_video"):
                worker = os.environ.get("PYTEST_XDIST_WORKER", "")
                name = f"{scenario.name}-seed-{scenario.seed}"
                number = names[name] = names.get(name, 0) + 1
                place = name if number == 1 else f"{name} ({number})"
                folder = _out(pytestconfig) / "runs" / worker / place
            known[key] = api.run(scenario, folder, overwrite=True, figures=False, video=False)
            if folder is not None:
                pytestconfig.stash[FOLDERS][id(known[key])] = folder
        return known[key]

    return run


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item, call: pytest.CallInfo[None]
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Draw a clip for a test in Python whose assertion on a run failed."""
    report = yield
    if call.excinfo is not None and item.config.getoption("escort_video"):
        from escort_mj.testing import VerdictError

        error = call.excinfo.value
        if isinstance(error, VerdictError) and id(error.run) in item.config.stash[FOLDERS]:
            folder = item.config.stash[FOLDERS].pop(id(error.run))  # what is popped is kept
            report.sections.append(("escort clip", _clip(folder, error)))
    return report


def _clip(folder: Path, error: Any) -> str:
    """Draw the clip of verdicts that were found after a run; where it lies, or why there is none."""
    from escort_mj.errors import EscortError
    from escort_mj.files import write_json
    from escort_mj.report.video.video import render_clip

    write_json(folder / "verdicts.json", [asdict(verdict) for verdict in error.verdicts])
    try:
        return os.path.relpath(render_clip(folder))
    except EscortError as fault:
        return f"no clip: {fault}"


def pytest_unconfigure(config: pytest.Config) -> None:
    """Remove the folders of runs that nothing failed in."""
    for folder in config.stash.get(FOLDERS, {}).values():
        shutil.rmtree(folder, ignore_errors=True)


def _out(config: pytest.Config) -> Path:
    """Where run folders go."""
    return config.invocation_params.dir / config.getoption("escort_out")
