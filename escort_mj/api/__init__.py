"""The public functions: load a scenario, run it, read the results."""

from __future__ import annotations

import contextlib
import inspect
import math
import os
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence, Sized
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from escort_mj.api.runs import Run
from escort_mj.errors import RenderError, UsageError
from escort_mj.mission import Progress, fly
from escort_mj.recognize import scenarios_folder, scenarios_in
from escort_mj.record.folder import RunFolder, read_run
from escort_mj.scenario import Scenario
from escort_mj.scenario.arguments import Count, Finite, Overrides, Source, checked
from escort_mj.scenario.findings import did_you_mean
from escort_mj.scenario.notes import notes
from escort_mj.scenario.reader.shipped import load_scenario, scenario_path, study_path

if TYPE_CHECKING:
    from escort_mj.api.live import LiveMission
    from escort_mj.api.live_log import LiveLog
    from escort_mj.study.checked import Case

__all__ = [
    "cases",
    "fly",
    "judge",
    "load_scenario",
    "replay",
    "run",
    "run_many",
    "scenarios_folder",
    "study_path",
]


@checked
def cases(
    paths: Sequence[str | os.PathLike[str]],
    overrides: Sequence[str] = (),
    plugins: Sequence[str] = (),
    seeds: Count = 1,
    repeat: Count = 1,
) -> list[Case]:
    """Return the scenarios to check.

    Args:
        paths: Scenario files, folders, or names of shipped scenarios. One that is not there becomes a case
            that says so.
        overrides: Texts `key.path=value`, to set there.
        plugins: Additional plugins: Python files or names of installed plugins.
        seeds: Number of seeds per scenario, starting at the scenario's seed.
        repeat: Number of runs per seed; a run that is not identical to the first one fails.

    Returns:
        Each scenario once per seed, with a label that no other has.
    """
    from escort_mj.study.checked import Case, with_seeds

    found: dict[str, Case] = {}
    labels: set[str] = set()
    for given in (os.fspath(path) for path in paths):
        fault, files = "", [Path(given)]
        try:
            files = list(scenarios_in(Path(given))) if os.path.isdir(given) else [Path(scenario_path(given))]
            fault = "" if files else f"{given}: this folder holds no scenario"
        except UsageError as error:
            fault = str(error)
        for path in files or [Path(given)]:
            label = _label(path if os.path.exists(given) else Path(given))
            number = 2
            while label in labels:
                label, number = f"{_label(path)}-{number}", number + 1
            if (place := os.path.realpath(path)) not in found:
                labels.add(label)
                found[place] = Case(path, label, fault, tuple(overrides), tuple(plugins), repeat=repeat)
    return with_seeds(list(found.values()), seeds)


def _label(path: Path) -> str:
    """What to call a file or folder: its path from here, or its name where it lies elsewhere."""
    here = Path(os.path.relpath(path))
    if ".." in here.parts or not here.name:
        here = Path(os.path.basename(os.path.realpath(path)) or "root")
    return here.as_posix() if os.path.isdir(path) else here.with_suffix("").as_posix()


def loaded(
    function: Callable[..., Any],
    scenario: Scenario | Source,
    overrides: Overrides,
    plugins: Sequence[str],
    keys: Mapping[str, Any],
) -> Scenario:
    """Return the scenario of a call, with what the call sets in it.

    Args:
        function: What is called.
        scenario: As for `load_scenario`.
        overrides: As for `load_scenario`.
        plugins: As for `load_scenario`.
        keys: As for `load_scenario`.

    Raises:
        UsageError: If one of the keys is neither an argument of the function nor a key of scenarios.
        ScenarioError: With all faults of the scenario.
    """
    known = [*inspect.signature(function).parameters, *Scenario.model_fields]
    for key in keys:
        if key.partition(".")[0] not in Scenario.model_fields:
            name = function.__name__
            words = f"is neither an argument nor a key of a scenario{did_you_mean(key, known)}"
            raise UsageError(f"{name}: {key} {words}")
    return load_scenario(scenario, overrides, plugins, **keys)


@checked
def run(
    scenario: Scenario | Source,
    out: str | os.PathLike[str] | None = None,
    *,
    overwrite: bool = False,
    figures: bool = True,
    video: bool = True,
    report: bool = False,
    interpreted: bool = False,
    overrides: Overrides = (),
    plugins: Sequence[str] = (),
    progress: Progress | None = None,
    **keys: Any,
) -> Run:
    """Run a scenario.

    Args:
        scenario: A scenario, or any source that `load_scenario` accepts.
        out: Run folder; None keeps the run in memory.
        overwrite: Whether to replace an existing run in the folder.
        figures: Whether to write the figures to the run folder.
        video: Whether to render the video in the run folder. Without GL, no video is rendered.
        report: Whether to write `report.html`, one page with all results and a replay, to the run folder.
        interpreted: Whether the controller runs as plain Python, where a debugger can stop. It takes about a
            thousand times as long and agrees with the machine code to rounding.
        overrides: A mapping of key paths to values, or texts `key.path=value`, to set there.
        plugins: Additional plugins: Python files or names of installed plugins.
        progress: Called periodically with the simulated time and the duration [s].
        keys: Further keys of the scenario with their values, such as `duration=10, seed=3`.

    Returns:
        The run: outcome, trace, metrics, verdicts, and methods to draw it.

    Raises:
        UsageError: If the folder contains a run that must not be replaced, or other files.
        KeyboardInterrupt: On an interrupt; a run folder then contains the run up to that point.
    """
    scenario = loaded(run, scenario, overrides, plugins, keys)
    if out is None:
        return Run(fly(scenario, None, progress, interpret=interpreted))
    for note in notes(scenario):
        warnings.warn(note, stacklevel=3)
    with RunFolder.create(Path(out), overwrite=overwrite) as folder:
        flight = fly(scenario, folder, progress, interpret=interpreted)
    with _video_of(folder.path) if video else contextlib.nullcontext():
        if figures:  # while the video is rendered
            from escort_mj.report.figures.figures import draw_figures

            draw_figures(folder.path)
    if report:
        from escort_mj.report.pages.run_page import write_run_page

        write_run_page(folder.path)
    return Run(flight, folder.path)


@contextlib.contextmanager
def _video_of(folder: Path) -> Iterator[None]:
    """Render the video of a run folder while the context lasts; without GL it ends with a warning."""
    from escort_mj.report.video.video import started_video

    with contextlib.ExitStack() as stack:
        rendering, fault = None, None
        try:
            rendering = stack.enter_context(started_video(folder))
        except RenderError as error:
            fault = error
        yield
        try:
            if rendering is not None:
                rendering.finish()
        except RenderError as error:
            fault = error
        if fault is not None:
            warnings.warn(f"no video: {fault}", stacklevel=5)


@checked
def start(
    scenario: Scenario | Source,
    overrides: Overrides = (),
    plugins: Sequence[str] = (),
    *,
    command: Literal["velocity", "residual", "force"] | None = None,
    **keys: Any,
) -> LiveMission:
    """Start a mission that is stepped from Python, under the control of its law.

    Args:
        scenario: A scenario, or any source that `load_scenario` accepts.
        overrides: A mapping of key paths to values, or texts `key.path=value`, to set there.
        plugins: Additional plugins: Python files or names of installed plugins.
        command: What robots are commanded by `LiveMission.command`: reference velocities, which the law
            follows, or forces of motors, instead of what the scenario's behaviors lead to, or a `residual`,
            velocities that are added to it. None for nothing.
        keys: Further keys of the scenario with their values, such as `duration=10, seed=3`.

    Returns:
        The mission at time 0: `step`, look at `state`, `push` robots, `move_target`, `change` gains,
        `snapshot` and `restore`, and end with `run`.

    Raises:
        ScenarioError: With all faults of the scenario.
        UsageError: If there is no such file or shipped scenario.
    """
    from escort_mj.api.live import LiveMission

    return LiveMission(loaded(start, scenario, overrides, plugins, keys), command)


@checked
def open_run(path: str | os.PathLike[str]) -> Run:
    """Open a run folder.

    For a run in progress, the trace contains the samples so far. For a run whose process has died, the trace
    is recovered from the journal and the outcome is `killed`; both are written to the folder if possible.

    Raises:
        RunFolderError: If the path is not a run folder, or if the run has recorded nothing.
    """
    return Run(read_run(path))


@checked
def replay(
    log: str | os.PathLike[str],
    scenario: Scenario | Source,
    *,
    names: Mapping[str, str] | None = None,
    start: Finite | None = None,
    overrides: Overrides = (),
    plugins: Sequence[str] = (),
    **keys: Any,
) -> LiveLog:
    """Start a replay of a log of real robots, stepped from Python; `judge` is one that goes to the end.

    Args:
        log: A CSV, Parquet or MCAP file, or a ROS bag.
        scenario: A scenario against which the log is judged, or any source that `load_scenario` accepts.
        names: Names of bodies (`robot_1` ..., `target`) in the log: in its columns, or its topics.
        start: Time stamp of the mission's start [s]; None for the first at which all bodies are logged.
        overrides: A mapping of key paths to values, or texts `key.path=value`, to set there.
        plugins: Additional plugins: Python files or names of installed plugins.
        keys: Further keys of the scenario with their values, such as `duration=10, seed=3`.

    Returns:
        The log at the mission's time 0: `step`, look at `state`, `snapshot` and `restore`, end with `run`.

    Raises:
        LogError: With all faults of the log.
        UsageError: If there is no such log, or it cannot be read.
    """
    from escort_mj.api.live_log import LiveLog

    return LiveLog(Path(log), loaded(replay, scenario, overrides, plugins, keys), names, start)


@checked
def judge(
    log: str | os.PathLike[str],
    scenario: Scenario | Source,
    out: str | os.PathLike[str] | None = None,
    *,
    names: Mapping[str, str] | None = None,
    start: Finite | None = None,
    overwrite: bool = False,
    figures: bool = True,
    report: bool = False,
    overrides: Overrides = (),
    plugins: Sequence[str] = (),
    progress: Progress | None = None,
    **keys: Any,
) -> Run:
    """Judge a log of real robots against a scenario.

    Args:
        log: A CSV, Parquet or MCAP file, or a ROS bag.
        scenario: A scenario against which the log is judged, or any source that `load_scenario` accepts.
        out: Run folder; None keeps the run in memory.
        names: Names of bodies (`robot_1` ..., `target`) in the log: in its columns, or its topics.
        start: Time stamp of the mission's start [s]; None for the first at which all bodies are logged.
        overwrite: Whether to replace an existing run in the folder.
        figures: Whether to write the figures to the run folder.
        report: Whether to write `report.html` to the run folder.
        overrides: A mapping of key paths to values, or texts `key.path=value`, to set there.
        plugins: Additional plugins: Python files or names of installed plugins.
        progress: Called periodically with the judged time and the duration [s].
        keys: Further keys of the scenario with their values, such as `duration=10, seed=3`.

    Returns:
        The run. Verdicts on what the log does not contain give the reason in `skip`.

    Raises:
        LogError: With all faults of the log.
        UsageError: If there is no such log, if it cannot be read, or if the folder contains a run that must
            not be replaced.
    """
    from escort_mj.judging.judge import judge_log

    scenario = loaded(judge, scenario, overrides, plugins, keys)
    judged = Run(judge_log(Path(log), scenario, names, start, progress))
    if out is None:
        return judged
    judged = judged.save(out, overwrite)
    if figures:
        from escort_mj.report.figures.figures import draw_figures

        draw_figures(out)
    if report:
        from escort_mj.report.pages.run_page import write_run_page

        write_run_page(out)
    return judged


@checked
def run_many(
    scenarios: Iterable[Scenario | Source],
    threads: Count | None = None,
    *,
    traces: bool = False,
    progress: Progress | None = None,
) -> Iterator[Run]:
    """Run many scenarios in parallel, in threads of this process.

    Every run is identical, bit for bit, to a single run of its scenario. Memory does not grow with the number
    of scenarios: they are read as needed, and only outcome, metrics and verdicts of a run are kept.

    Args:
        scenarios: Scenarios, or any sources that `load_scenario` accepts; they can differ in every key.
        threads: Number of threads; None for one per available core.
        traces: Whether to keep the traces of the runs, `run.trace`.
        progress: Called with the number of finished runs and their total, infinite if unknown.

    Yields:
        One run per scenario, in the same order. A run with an error has the outcome `failed`; the others
        continue.

    Raises:
        ScenarioError: With all faults of an invalid file.
        UsageError: If there is no such file or scenario, or if `threads` is less than 1.
    """
    from escort_mj.mission.batch import fly_many
    from escort_mj.study.engine.parallel import cores

    total = len(scenarios) if isinstance(scenarios, Sized) else math.inf
    each = (load_scenario(one) for one in scenarios)

    def runs() -> Iterator[Run]:
        for done, ended in enumerate(fly_many(each, threads or cores(), traces), 1):
            if progress is not None:
                progress(done, total)
            yield Run(ended)

    return runs()
