"""Commands for many runs: reproduce, compare, sweep, report, tune, falsify; and rerun."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import chain
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
    from escort_mj.study.sweeps.design import Design

OutOption = Annotated[
    Path | None, typer.Option(help="Folder for the results [default: renders/studies/NAME].")
]
AgainOption = Annotated[bool, typer.Option("--again", help="Repeat runs that already exist.")]
DocsOption = Annotated[
    Path | None,
    typer.Option(hidden=True, help="Page of the docs that also gets the table, between its marks."),
]

StudyArgument = Annotated[
    str,
    typer.Argument(
        help="Study file, or name of a shipped study such as studies/minute.",
        autocompletion=complete.studies,
    ),
]


def _laid_out(
    study: str,
    out: Path | None,
    workers: int | None,
    overrides: list[str] | None,
    processes: bool = True,
    confirmed: bool = True,
) -> tuple[Design, Path, int]:
    """A study's design, the folder of its results, and how many work on it.

    Commands call it before they import anything slow: processes get ready meanwhile, if there are to be any.
    A study that is larger than it says it may be is refused here unless that was confirmed.
    """
    from escort_mj.study.engine.parallel import cores, parent_of_workers

    count = cores() if workers is None else workers
    if processes and count > 1:
        parent_of_workers()
    from escort_mj.api.studies import lay_out

    return lay_out(study, out, count, confirmed, overrides or ())


@app.command("reproduce")
def reproduce_command(
    only: Annotated[
        list[str] | None,
        typer.Option(metavar="FIG", help="Figure to reproduce, 5 to 17 or laws; repeatable."),
    ] = None,
    out: Annotated[Path, typer.Option(help="Folder for runs, figures and table.")] = Path(
        "renders/reproduction"
    ),
    workers: WorkersOption = None,
    docs: Annotated[
        Path | None, typer.Option(hidden=True, help="Also write the table to this Markdown file.")
    ] = None,
    again: AgainOption = False,
    as_json: JsonOption = False,
) -> None:
    """Reproduce the paper's simulations and figures, and check its claims.

    Example: escort-mj reproduce --only 5 --only 6
    """
    from escort_mj import api
    from escort_mj.report.reproduction import draw_reproduction
    from escort_mj.study.compare.reproduce import reproduce as reproduce_paper

    with stopping.keeping(lambda: _kept(out)), progress_bar("reproducing", " steps") as progress:
        result = reproduce_paper(
            api.scenarios_folder(), out, draw_reproduction, only or (), workers, docs, again, progress
        )
    _finish(
        "reproduce",
        as_json,
        result.lines,
        out,
        result.written,
        "table.json",
        GOOD if result.stated else BROKEN,
    )


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
    overrides: SetOption = None,
    plugins: PluginOption = None,
    out: Annotated[
        Path | None, typer.Option(help="Folder for runs, figures and table [default: renders/compare/NAME].")
    ] = None,
    workers: WorkersOption = None,
    docs: Annotated[
        Path | None,
        typer.Option(hidden=True, help="Also write the table into this Markdown page, between its marks."),
    ] = None,
    again: AgainOption = False,
    as_json: JsonOption = False,
) -> None:
    """Run one scenario with several laws and outer loops, and compare the results in one table.

    Example: escort-mj compare main --laws apd_smc,pd --outer nsb,barrier_filter --seeds 5
    """
    from escort_mj import api
    from escort_mj.report.comparison import draw_comparison
    from escort_mj.study.compare.compare import compare as compare_laws

    mission = api.load_scenario(scenario, overrides or (), plugins or ())
    folder = out if out is not None else Path("renders") / "compare" / mission.name
    with stopping.keeping(lambda: _kept(folder)), progress_bar("comparing", " runs") as progress:
        result = compare_laws(
            mission, folder, draw_comparison, laws or (), outer or (), seeds, workers, docs, again, progress
        )
    _finish(
        "compare",
        as_json,
        result.lines,
        folder,
        result.written,
        "table.json",
        GOOD if result.stated else BROKEN,
    )


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
    """Make the missing runs of a study. Resumes if interrupted.

    Example: escort-mj sweep studies/minute --workers 2

    Example: escort-mj sweep mine.yaml --backend dask --scheduler tcp://host:8786
    """
    design, folder, count = _laid_out(study, out, workers, overrides, backend == "local", yes)
    from escort_mj.study.engine import backends
    from escort_mj.study.sweeps.sweep import sweep as make_runs
    from escort_mj.study.sweeps.sweep import sweep_line

    make = {"local": backends.local, "threads": backends.threads}.get(backend)
    at = backends.dask(count, scheduler) if make is None else make(count)
    with at as where, progress_bar("sweeping", " runs") as progress:
        done = make_runs(design, folder, where, count, yes, progress)
    written = ["results.sqlite", "runs.csv", "study.yaml"]
    lines = [sweep_line(design, done), f"wrote {shown_path(folder)}: {' '.join(written)}"]
    told = {"study": design.study.study, "cells": len(design.cells)} | done._asdict()
    code = BROKEN if done.broken else VERDICT_FAILED if done.failed else GOOD
    finish("sweep", as_json, lines, code, folder=shown_path(folder), written=written, **told)


@app.command("rerun")
def rerun_command(
    run_folder: RunArgument,
    out: Annotated[Path | None, typer.Option(help="Run folder for the repeated run [default: none].")] = None,
    tolerance: Annotated[float, typer.Option(min=0.0, help="Relative tolerance for metrics.")] = 1e-3,
    as_json: JsonOption = False,
) -> None:
    """Repeat the run of a run folder and compare the results: bits first, then metrics and verdicts.

    Exit codes: 0 if they agree, 1 if they differ, 2 if there is no run to repeat.

    Example: escort-mj rerun renders/main
    """
    from escort_mj.study.sweeps.rerun import rerun_folder, rerun_lines

    with progress_bar("simulating", " s") as progress:
        found = rerun_folder(run_folder, out, tolerance, progress)
    told = {
        name: getattr(found, name) for name in ("good", "same_bits", "until", "differing", "missing", "apart")
    }
    told |= {"outcomes": found.outcomes, "versions": found.versions, "verdicts": found.verdicts}
    finish("rerun", as_json, rerun_lines(found), GOOD if found.good else VERDICT_FAILED, **told)


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
    """Tune scenario values within the bounds of a study's section tune. Resumes if interrupted.

    Example: escort-mj tune studies/tune_apd_smc
    """
    design, folder, count = _laid_out(study, out, workers, overrides)
    from escort_mj.study.engine import backends
    from escort_mj.study.search.evaluate import base_of
    from escort_mj.study.search.tune import tune as search
    from escort_mj.study.search.tune_table import tuning_lines

    with backends.local(count) as where, progress_bar("tuning", " trials") as progress:
        found = search(design, folder, where, progress)
    section = design.study.tune
    assert section is not None, "tune has refused studies without it"
    said = tuning_lines(found, section, {key: base_of(design, key) for key in section.over})
    written = ["results.sqlite", "trials.csv", "tune.json", "best.yaml"]
    if figures:
        from escort_mj.report.figures.tuning import draw_tuning

        with stopping.keeping(lambda: _kept(folder)):
            written += [path.name for path in draw_tuning(folder, section, found)]
    _finish("tune", as_json, said, folder, written, "tune.json")


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
    """Search within the bounds of a study's section falsify for a mission that violates a verdict.

    The search simplifies each counterexample.

    Exit codes: 0 if no violation was found, 1 if one was found.

    Example: escort-mj falsify studies/falsify_main
    """
    design, folder, count = _laid_out(study, out, workers, overrides)
    from escort_mj.errors import RenderError
    from escort_mj.report.video.video import render_clip
    from escort_mj.study.engine import backends
    from escort_mj.study.search.falsify import falsification_lines
    from escort_mj.study.search.falsify import falsify as search

    with backends.local(count) as where, progress_bar("searching", " runs") as progress:
        found = search(design, folder, where, progress)
    said = list(falsification_lines(found))
    for one in found.counterexamples if video else ():
        try:
            with stopping.keeping(lambda: _kept(folder)):
                said.append(f"clip: {shown_path(render_clip(one.folder))}")
        except RenderError as error:
            say(f"no clip: {error}", err=True)
    written = ["results.sqlite", "falsify.json", "counterexamples/"]
    code = VERDICT_FAILED if found.counterexamples else GOOD
    _finish("falsify", as_json, said, folder, written, "falsify.json", code)


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
    compare: Annotated[str | None, typer.Option(help="Factor to compare [default: laws or cases].")] = None,
    png: Annotated[bool, typer.Option("--png", help="Also write the figures of a study as PNG.")] = False,
    as_json: JsonOption = False,
) -> None:
    """Write a self-contained HTML page: of a run, with a replay, or of a study, with its worst runs.

    Example: escort-mj report renders/main; escort-mj report renders/studies/minute
    """
    from escort_mj.record.folder import is_run

    if is_run(folder):
        if compare is not None or png:
            raise UsageError(f"{folder}: is a run; --compare and --png are for studies")
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

    page = write_study_page(folder, out, compare, ("svg", "png") if png else ("svg",))
    lines = [f"wrote {shown_path(page)}", f"wrote {shown_path(folder)}: cells.csv figures/ worst/"]
    written = ["cells.csv", "figures/", "worst/"]
    finish("report", as_json, lines, page=shown_path(page), folder=shown_path(folder), written=written)


def _kept(folder: Path) -> str:
    """What an interrupted command that makes runs has left."""
    return f"runs that have ended are kept in {shown_path(folder)}; the same command goes on from there"


def _finish(
    command: str,
    as_json: bool,
    lines: Iterable[str],
    folder: Path,
    written: list[str],
    summary: str,
    code: int = GOOD,
) -> NoReturn:
    """End a command that wrote what it found into a JSON file of its folder."""
    from escort_mj.record.files import read_json

    said = chain(lines, [f"wrote {shown_path(folder)}: {' '.join(written)}"])
    found = read_json(folder / summary) if as_json else None
    finish(command, as_json, said, code, folder=shown_path(folder), written=written, result=found)
