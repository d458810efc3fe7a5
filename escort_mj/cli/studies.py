"""Commands for many runs: reproduce, compare, sweep, report, tune, falsify; and rerun."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, NoReturn

import typer

from escort_mj import stopping
from escort_mj.cli.app import (
    BROKEN,
    GOOD,
    VERDICT_FAILED,
    JsonOption,
    PluginOption,
    RunArgument,
    ScenarioArgument,
    SetOption,
    WorkersOption,
    app,
    complete,
    finish,
    progress_bar,
    say,
    shown_path,
)
from escort_mj.errors import UsageError

if TYPE_CHECKING:
    from escort_mj.api.studies import StudyResult
    from escort_mj.study.sweeps.rerun import Agreement

OutOption = Annotated[
    Path | None, typer.Option(help="Folder for the results [default: renders/studies/NAME].")
]
AgainOption = Annotated[bool, typer.Option("--again", help="Repeat runs that already exist.")]

StudyArgument = Annotated[
    str,
    typer.Argument(
        help="Study file, or name of a shipped study such as studies/minute.",
        autocompletion=complete.studies,
    ),
]


def _get_ready(workers: int | None) -> None:
    """Start the parent of the worker processes, if there are to be any, before anything slow is imported."""
    from escort_mj.study.engine.parallel import cores, parent_of_workers

    if (cores() if workers is None else workers) > 1:
        parent_of_workers()


@app.command("reproduce")
def reproduce_command(
    only: Annotated[
        list[str] | None,
        typer.Option(metavar="FIG", help="Figure to reproduce, 5 to 17; repeatable."),
    ] = None,
    out: Annotated[Path, typer.Option(help="Folder for runs, figures and table.")] = Path(
        "renders/reproduction"
    ),
    workers: WorkersOption = None,
    again: AgainOption = False,
    as_json: JsonOption = False,
) -> None:
    """Reproduce the paper's simulations and figures, and check its claims: the study studies/paper.

    The run folders of all figures take 0.5 GB, because each contains its trace; with --only, they take less.

    Example: escort-mj reproduce --only 5 --only 6
    """
    from escort_mj.api import studies

    with progress_bar("reproducing", " runs") as progress:
        result = studies.reproduce(only or (), out, workers=workers, again=again, progress=progress or False)
    _finish("reproduce", as_json, result, "expect.json", GOOD if result.passed else BROKEN)


@app.command("compare")
def compare_command(
    scenario: ScenarioArgument,
    laws: Annotated[
        list[str] | None,
        typer.Option(
            metavar="LAW,...",
            help="Laws of the inner loop, such as apd_smc,pd [default: all].",
            autocompletion=complete.laws,
        ),
    ] = None,
    outer: Annotated[
        list[str] | None,
        typer.Option(
            metavar="LOOP,...",
            help="Outer loops, such as nsb,barrier_filter [default: the scenario's].",
            autocompletion=complete.outer_loops,
        ),
    ] = None,
    seeds: Annotated[int, typer.Option(min=1, help="Number of seeds, starting at the scenario's seed.")] = 1,
    over: Annotated[
        Literal["whole", "tail"] | None,
        typer.Option(
            help="Part of each run that quantities look at: the whole run, or its tail, the last fifth "
            "[default: that of each quantity]."
        ),
    ] = None,
    after: Annotated[
        float | None, typer.Option(min=0.0, help="Start of a window instead of --over [s].")
    ] = None,
    before: Annotated[
        float | None, typer.Option(min=0.0, help="End of the window [s] [default: the end of the run].")
    ] = None,
    overrides: SetOption = None,
    plugins: PluginOption = None,
    out: Annotated[
        Path | None, typer.Option(help="Folder for runs, figures and table [default: renders/compare/NAME].")
    ] = None,
    workers: WorkersOption = None,
    again: AgainOption = False,
    as_json: JsonOption = False,
) -> None:
    """Run one scenario with several laws and outer loops, and compare the results in one table.

    Example: escort-mj compare main --laws apd_smc,pd --outer nsb,barrier_filter --seeds 5
    """
    from escort_mj.api import load_scenario, studies

    mission = load_scenario(scenario, overrides or (), plugins or ())
    with progress_bar("comparing", " runs") as progress:
        result = studies.compare(
            mission,
            laws or (),
            outer or (),
            seeds,
            out,
            over=over,
            after=after,
            before=before,
            workers=workers,
            again=again,
            progress=progress or False,
        )
    _finish("compare", as_json, result, "table.json", GOOD if result.passed else BROKEN)


@app.command("sweep")
def sweep_command(
    study: StudyArgument,
    overrides: SetOption = None,
    out: OutOption = None,
    workers: WorkersOption = None,
    backend: Annotated[
        Literal["local", "threads", "dask"],
        typer.Option(help="Backend: local processes, threads, or a Dask cluster."),
    ] = "local",
    scheduler: Annotated[
        str | None,
        typer.Option(
            help="Address of a Dask scheduler, such as tcp://host:8786 [default: start a local cluster]."
        ),
    ] = None,
    yes: Annotated[
        bool, typer.Option("--yes", help="Start without confirmation, however large the study is.")
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """Perform the missing runs of a study. An interrupted study resumes.

    Example: escort-mj sweep studies/minute --workers 2

    Example: escort-mj sweep heavier.yaml --backend dask --scheduler tcp://host:8786
    """
    if backend == "local":
        _get_ready(workers)
    from escort_mj.api import studies

    with progress_bar("sweeping", " runs") as progress:
        result = studies.sweep(
            study,
            out,
            workers=workers,
            backend=backend,
            scheduler=scheduler,
            confirmed=yes,
            overrides=overrides or (),
            progress=progress or False,
        )
    done = result.found
    told = {"study": result.name} | done._asdict()
    code = BROKEN if done.broken else VERDICT_FAILED if done.failed else GOOD
    lines = [*result.lines, _wrote(result)]
    finish("sweep", as_json, lines, code, folder=shown_path(result.folder), written=result.written, **told)


@app.command("rerun")
def rerun_command(
    run_folder: RunArgument,
    out: Annotated[Path | None, typer.Option(help="Run folder for the repeated run [default: none].")] = None,
    tolerance: Annotated[float, typer.Option(min=0.0, help="Relative tolerance for metrics.")] = 1e-3,
    as_json: JsonOption = False,
) -> None:
    """Repeat the run of a run folder and compare the results, first bit by bit, then by metrics and verdicts.

    Exit codes: 0 if the results agree, 1 if they differ, 2 if there is no run to repeat.

    Example: escort-mj rerun renders/main
    """
    from escort_mj.study.sweeps.rerun import rerun_folder, rerun_lines

    with progress_bar("simulating", " s") as progress:
        found = rerun_folder(run_folder, out, tolerance, progress)
    _compared("rerun", as_json, found, rerun_lines(found))


@app.command("diff")
def diff_command(
    first: RunArgument,
    second: RunArgument,
    tolerance: Annotated[float, typer.Option(min=0.0, help="Relative tolerance for metrics.")] = 1e-3,
    as_json: JsonOption = False,
) -> None:
    """Compare two run folders: scenario keys, versions, the first signal that differs, metrics and verdicts.

    Exit codes: 0 if the results agree, 1 if they differ, 2 if one is no run folder.

    Example: escort-mj diff renders/main renders/main-2
    """
    from escort_mj.study.sweeps.rerun import diff_folders, diff_lines

    found = diff_folders(first, second, tolerance)
    _compared("diff", as_json, found, diff_lines(found))


def _compared(command: str, as_json: bool, found: Agreement, lines: list[str]) -> NoReturn:
    """End a command that compared two runs."""
    about = ("good", "same_bits", "until", "first", "differing", "missing", "apart", "metrics", "outcomes")
    told = {name: getattr(found, name) for name in (*about, "versions", "verdicts", "notes")}
    finish(command, as_json, lines, GOOD if found.good else VERDICT_FAILED, **told)


@app.command("tune")
def tune_command(
    study: StudyArgument,
    overrides: SetOption = None,
    out: OutOption = None,
    workers: WorkersOption = None,
    figures: Annotated[
        bool, typer.Option("--figures/--no-figures", help="Whether to draw the progress of the search.")
    ] = True,
    as_json: JsonOption = False,
) -> None:
    """Tune scenario values within the bounds of a study's tune section. An interrupted search resumes.

    Example: escort-mj tune studies/tune_apd_smc
    """
    _get_ready(workers)
    from escort_mj.api import studies

    with progress_bar("tuning", " trials") as progress:
        result = studies.tune(
            study,
            out,
            workers=workers,
            overrides=overrides or (),
            figures=figures,
            progress=progress or False,
        )
    _finish("tune", as_json, result, "tune.json")


@app.command("falsify")
def falsify_command(
    study: StudyArgument,
    overrides: SetOption = None,
    out: OutOption = None,
    workers: WorkersOption = None,
    video: Annotated[
        bool, typer.Option("--video/--no-video", help="Whether to render a clip of each counterexample.")
    ] = True,
    as_json: JsonOption = False,
) -> None:
    """Search within the bounds of a study's falsify section for a mission that violates a verdict.

    The search simplifies each counterexample.

    Exit codes: 0 if no violation was found, 1 if one was found.

    Example: escort-mj falsify studies/falsify_main
    """
    _get_ready(workers)
    from escort_mj.api import studies
    from escort_mj.errors import RenderError
    from escort_mj.report.video.video import render_clip

    with progress_bar("searching", " runs") as progress:
        result = studies.falsify(
            study, out, workers=workers, overrides=overrides or (), progress=progress or False
        )
    for one in result.found.counterexamples if video else ():
        try:
            with stopping.keeping(lambda: studies.kept_words(result.folder)):
                result.lines.append(f"clip: {shown_path(render_clip(one.folder))}")
        except RenderError as error:
            say(f"no clip: {error}", err=True)
    _finish("falsify", as_json, result, "falsify.json", GOOD if result.passed else VERDICT_FAILED)


@app.command("shrink")
def shrink_command(
    source: Annotated[
        str,
        typer.Argument(
            help="Run folder of a run that failed, or scenario that fails (a file or a shipped one).",
            autocompletion=complete.runs_or_scenarios,
        ),
    ],
    overrides: SetOption = None,
    plugins: PluginOption = None,
    runs: Annotated[int, typer.Option(min=1, help="Largest number of runs.")] = 200,
    out: Annotated[
        Path | None, typer.Option(help="Run folder of the smallest scenario [default: renders/shrink/NAME].")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Make a failing scenario as small as possible, so that the same verdict still fails.

    Robots, obstacles and keys that are not needed are left out; the result is scenario.yaml of the run
    folder.

    Exit codes: 0 if the scenario fails (as small as it was found), 2 if it passes.

    Example: escort-mj shrink renders/check/depot-seed-3; escort-mj shrink depot.yaml --set seed=3
    """
    from escort_mj.api import load_scenario
    from escort_mj.record.folder import read_run
    from escort_mj.scenario.reader.load import stored_scenario
    from escort_mj.study.search.smallest import shrink_scenario, shrunk_lines

    if (folder := Path(source)).is_dir():
        if overrides or plugins:
            raise UsageError("--set and --plugin change a scenario, not a run folder")
        scenario = stored_scenario(read_run(folder).scenario_yaml, folder)
    else:
        scenario = load_scenario(source, overrides or (), plugins or ())
    place = Path("renders/shrink") / scenario.name if out is None else out
    with progress_bar("shrinking", " runs") as progress:
        found = shrink_scenario(scenario, place, runs, progress)
    lines = [*shrunk_lines(found), f"wrote {shown_path(found.folder)}: scenario.yaml and its run"]
    names = ("broken", "message", "robots", "obstacles", "duration", "keys", "runs", "finished")
    told = {name: getattr(found, name) for name in names}
    finish("shrink", as_json, lines, folder=shown_path(found.folder), **told)


@app.command("report")
def report_command(
    folder: Annotated[
        Path,
        typer.Argument(
            help="Run folder, or folder of a study's results.",
            exists=True,
            file_okay=False,
            autocompletion=complete.results,
        ),
    ],
    out: Annotated[Path | None, typer.Option(help="HTML file [default: report.html in the folder].")] = None,
    compare: Annotated[
        str | None,
        typer.Option(help="In a study, factor whose levels are compared [default: laws or cases]."),
    ] = None,
    png: Annotated[bool, typer.Option("--png", help="Also write the figures of a study as PNG.")] = False,
    pdf: Annotated[bool, typer.Option("--pdf", help="Also write the figures of a study as PDF.")] = False,
    as_json: JsonOption = False,
) -> None:
    """Write a self-contained HTML page of a run (with a replay) or of a study (with its worst runs).

    Example: escort-mj report renders/main; escort-mj report renders/studies/minute
    """
    from escort_mj.record.folder import is_run

    if is_run(folder):
        if compare is not None or png or pdf:
            raise UsageError(f"{folder}: is a run; --compare, --png and --pdf are for studies")
        from escort_mj.report.pages.run_page import write_run_page

        page = write_run_page(folder, out)
        written = [page.name]
        finish(
            "report",
            as_json,
            [f"wrote {shown_path(page)}"],
            page=shown_path(page),
            folder=shown_path(folder),
            written=written,
        )
    from escort_mj.report.pages.study_page import write_study_page

    page = write_study_page(folder, out, compare, ("svg", *["png"] * png, *["pdf"] * pdf))
    lines = [
        f"wrote {shown_path(page)}",
        f"wrote {shown_path(folder)}: cells.csv cells.md cells.tex figures/ worst/",
    ]
    written = ["cells.csv", "cells.md", "cells.tex", "figures/", "worst/"]
    finish("report", as_json, lines, page=shown_path(page), folder=shown_path(folder), written=written)


def _finish(command: str, as_json: bool, result: StudyResult, summary: str, code: int = GOOD) -> NoReturn:
    """End a command that wrote what it found into a JSON file of its folder."""
    from escort_mj.record.files import read_json

    found = read_json(result.folder / summary) if as_json else None
    folder = shown_path(result.folder)
    lines = [*result.lines, _wrote(result)]
    finish(command, as_json, lines, code, folder=folder, written=result.written, result=found)


def _wrote(result: StudyResult) -> str:
    return f"wrote {shown_path(result.folder)}: {' '.join(result.written)}"
