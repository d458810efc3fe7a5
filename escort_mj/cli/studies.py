"""Commands for many runs: reproduce, compare, sweep, report, tune, falsify; and rerun."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

from escort_mj import stopping
from escort_mj.cli.app import (
    BROKEN,
    GOOD,
    VERDICT_FAILED,
    Answer,
    command,
    progress_bar,
    say,
    shown_path,
)
from escort_mj.cli.options import (
    LOOK,
    Count,
    Either,
    Formats,
    NotNegative,
    Overrides,
    ResultsFolder,
    RunFolder,
    Source,
    Texts,
)
from escort_mj.cli.runs import wrote
from escort_mj.cli.streams import OUTPUT
from escort_mj.errors import UsageError

if TYPE_CHECKING:
    from escort_mj.api.studies import StudyResult
    from escort_mj.study.sweeps.rerun import Agreement


def _get_ready(workers: int | None) -> None:
    """Start the parent of the worker processes, if there are to be any, before anything slow is imported."""
    from escort_mj.study.engine.parallel import cores, parent_of_workers

    if (cores() if workers is None else workers) > 1:
        parent_of_workers()


@command("reproduce", like="api.studies.reproduce", flags={"only": "--only FIG"})
def reproduce_command(**given: Any) -> Answer:
    """Reproduce the paper's simulations and figures, and check its claims: the study studies/paper.

    The run folders of all figures take 0.5 GB, because each contains its trace; with --only, they take less.

    Example: escort-mj reproduce --only 5 --only 6

    Args:
        only: Figure to reproduce, 5 to 17; repeatable.
    """
    from escort_mj.api import studies

    with progress_bar("reproducing", " runs") as progress:
        result = studies.reproduce(**given, progress=progress)
    return _answer(result, "expect.json", GOOD if result.passed else BROKEN)


@command("compare", like="api.studies.compare")
def compare_command(**given: Any) -> Answer:
    """Run one scenario with several laws and outer loops, and compare the results in one table.

    Example: escort-mj compare main --laws apd_smc,pd --outer nsb,barrier_filter --seeds 5
    """
    from escort_mj.api import studies

    with progress_bar("comparing", " runs") as progress:
        result = studies.compare(**given, progress=progress)
    return _answer(result, "table.json", GOOD if result.passed else BROKEN)


@command("sweep", like="api.studies.sweep", flags={"confirmed": "--yes"})
def sweep_command(**given: Any) -> Answer:
    """Perform the missing runs of a study. An interrupted study resumes.

    Example: escort-mj sweep studies/minute --workers 2

    Example: escort-mj sweep heavier.yaml --backend dask --scheduler tcp://host:8786
    """
    if given["backend"] == "local":
        _get_ready(given["workers"])
    from escort_mj.api import studies

    with progress_bar("sweeping", " runs") as progress:
        result = studies.sweep(**given, progress=progress)
    done = result.found
    told = {"study": result.name, "folder": shown_path(result.folder), "written": result.written}
    code = BROKEN if done.broken else GOOD if result.passed else VERDICT_FAILED
    return Answer([*result.lines, wrote(result.folder, result.written)], told | done._asdict(), code)


@command("rerun")
def rerun_command(run_folder: RunFolder, out: Path | None = None, tolerance: NotNegative = 1e-3) -> Answer:
    """Repeat the run of a run folder and compare the results, first bit by bit, then by metrics and verdicts.

    Exit codes: 0 if the results agree, 1 if they differ, 2 if there is no run to repeat.

    Example: escort-mj rerun renders/main

    Args:
        out: Run folder for the repeated run; None for none.
        tolerance: Relative tolerance for metrics.
    """
    from escort_mj.study.sweeps.rerun import agreement_lines, rerun_folder

    with progress_bar("simulating", " s") as progress:
        found = rerun_folder(run_folder, out, tolerance, progress)
    return _compared(found, agreement_lines(found))


@command("diff")
def diff_command(first: RunFolder, second: RunFolder, tolerance: NotNegative = 1e-3) -> Answer:
    """Compare two run folders: scenario keys, versions, the first signal that differs, metrics and verdicts.

    Exit codes: 0 if the results agree, 1 if they differ, 2 if one is no run folder.

    Example: escort-mj diff renders/main renders/main-2

    Args:
        tolerance: Relative tolerance for metrics.
    """
    from escort_mj.study.sweeps.rerun import agreement_lines, diff_folders

    found = diff_folders(first, second, tolerance)
    return _compared(found, agreement_lines(found, "first", "second"))


def _compared(found: Agreement, lines: list[str]) -> Answer:
    """Return the answer of a command that compared two runs."""
    about = ("good", "same_bits", "until", "first", "differing", "missing", "apart", "metrics", "outcomes")
    told = {name: getattr(found, name) for name in (*about, "versions", "verdicts", "notes")}
    return Answer(lines, told, GOOD if found.good else VERDICT_FAILED)


@command("tune", like="api.studies.tune")
def tune_command(figures: Either = True, **given: Any) -> Answer:
    """Tune scenario values within the bounds of a study's tune section. An interrupted search resumes.

    Example: escort-mj tune studies/tune_apd_smc
    """
    _get_ready(given["workers"])
    from escort_mj.api import studies

    with progress_bar("tuning", " trials") as progress:
        result = studies.tune(**given, figures=figures, progress=progress)
    return _answer(result, "tune.json")


@command("falsify", like="api.studies.falsify")
def falsify_command(video: Either = True, **given: Any) -> Answer:
    """Search within the bounds of a study's falsify section for a mission that violates a verdict.

    The search simplifies each counterexample.

    Exit codes: 0 if no violation was found, 1 if one was found.

    Example: escort-mj falsify studies/falsify_main

    Args:
        video: Whether to render a clip of each counterexample.
    """
    _get_ready(given["workers"])
    from escort_mj.api import studies
    from escort_mj.errors import RenderError
    from escort_mj.report.video.video import render_clip

    with progress_bar("searching", " runs") as progress:
        result = studies.falsify(**given, progress=progress)
    for one in result.found.counterexamples if video else ():
        try:
            with stopping.keeping(lambda: studies.kept_words(result.folder)):
                result.lines.append(f"clip: {shown_path(render_clip(one.folder))}")
        except RenderError as error:
            say(f"no clip: {error}", err=True)
    return _answer(result, "falsify.json", GOOD if result.passed else VERDICT_FAILED)


@command("shrink")
def shrink_command(
    source: Source, overrides: Overrides = (), plugins: Texts = (), runs: Count = 200, out: Path | None = None
) -> Answer:
    """Make a failing scenario as small as possible, so that the same verdict still fails.

    Robots, obstacles and keys that are not needed are left out; the result is scenario.yaml of the run
    folder.

    Exit codes: 0 if the scenario fails (as small as it was found), 2 if it passes.

    Example: escort-mj shrink renders/check/depot-seed-3; escort-mj shrink depot.yaml --set seed=3

    Args:
        source: Run folder of a run that failed, or scenario that fails (a file or a shipped one).
        runs: Largest number of runs.
        out: Run folder of the smallest scenario; None for renders/shrink/NAME.
    """
    from escort_mj.api import load_scenario, open_run
    from escort_mj.study.search.smallest import shrink_scenario, shrunk_lines

    if os.path.isdir(folder := Path(source)):
        if overrides or plugins:
            raise UsageError("--set and --plugin change a scenario, not a run folder")
        scenario = open_run(folder).scenario
    else:
        scenario = load_scenario(source, overrides, plugins)
    place = Path("renders/shrink") / scenario.name if out is None else out
    with progress_bar("shrinking", " runs") as progress:
        found = shrink_scenario(scenario, place, runs, progress)
    lines = [*shrunk_lines(found), f"wrote {shown_path(found.folder)}: scenario.yaml and its run"]
    names = ("broken", "message", "robots", "obstacles", "duration", "keys", "runs", "finished")
    told = {name: getattr(found, name) for name in names}
    return Answer(lines, told | {"folder": shown_path(found.folder)})


@command("report", like=LOOK, flags={"quantities": "--quantity METRIC"})
def report_command(
    folder: ResultsFolder,
    out: Path | None = None,
    compare: str | None = None,
    quantities: Texts = (),
    formats: Formats = (),
    **look: Any,
) -> Answer:
    """Write a self-contained HTML page of a run (with a replay) or of a study (with its worst runs).

    Example: escort-mj report renders/main; escort-mj report renders/studies/minute

    Args:
        folder: Run folder, or folder of a study's results.
        out: HTML file; None for report.html in the folder.
        compare: In a study, factor whose levels are compared; None for laws or cases.
        quantities: In a study, metric that tables and figures show; repeatable [default: those of the study].
        formats: Also write the figures of a study in this format; repeatable [default: svg].
    """
    from escort_mj.record.folder import is_run
    from escort_mj.report.figures.drawing.look import USUAL, check_formats, look_of, looking

    wanted = look_of(**look)
    if is_run(folder):
        if compare is not None or quantities or formats or wanted != USUAL:
            words = "--compare, --quantity and how figures look are for studies; render draws those of runs"
            raise UsageError(f"{folder}: is a run; {words}")
        from escort_mj.report.pages.run_page import write_run_page

        page = write_run_page(folder, out)
        lines, written = [], [page.name]
    else:
        from escort_mj.report.pages.study_page import write_study_page

        with looking(wanted):
            page = write_study_page(folder, out, compare, check_formats(("svg", *formats)), quantities)
        written = ["cells.csv", "cells.md", "cells.tex", "figures/", "worst/"]
        lines = [wrote(folder, written)]
    told = {"page": shown_path(page), "folder": shown_path(folder), "written": written}
    return Answer([f"wrote {shown_path(page)}", *lines], told)


def _answer(result: StudyResult, summary: str, code: int = GOOD) -> Answer:
    """Return the answer of a command that wrote what it found into a JSON file of its folder."""
    from escort_mj.files import read_json

    found = read_json(result.folder / summary) if OUTPUT.json else None
    told = {"folder": shown_path(result.folder), "written": result.written, "result": found}
    return Answer([*result.lines, wrote(result.folder, result.written)], told, code)
