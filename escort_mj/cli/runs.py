"""Commands for one run, or for several scenarios: run, check, show, metrics, schema."""

from __future__ import annotations

import json
import os
from contextlib import nullcontext
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from escort_mj import stopping
from escort_mj.cli.app import (
    BROKEN,
    GOOD,
    VERDICT_FAILED,
    Answer,
    command,
    drawing_figures,
    drawing_video,
    progress_bar,
    say,
    shown_path,
)
from escort_mj.cli.options import Count, Either, RunFolder, RunFolders, ScenarioName, Texts
from escort_mj.cli.streams import OUTPUT, tell
from escort_mj.record.revision import ask_for_revision

if TYPE_CHECKING:
    from escort_mj.mission import Flight
    from escort_mj.record import folder as record
    from escort_mj.report.figures.ahead import Draw


@command("run", like="api.run")
def run_command(
    scenario: ScenarioName,
    out: Path | None = None,
    overwrite: bool = False,
    video: Either = True,
    figures: Either = True,
    report: Either = False,
    **given: Any,
) -> Answer:
    """Run one scenario and write its run folder.

    An earlier run in renders/NAME is kept; the new one is written to renders/NAME-2, renders/NAME-3 and so
    on.

    Example: escort-mj run main

    Example: escort-mj run mine.yaml --set controller=asmc --set mission.max_speed=1 --no-video

    Args:
        out: Run folder; None for renders/NAME.
        overwrite: Replace an earlier run in the folder.
        video: Whether to render the video.
        figures: Whether to draw the figures.
        report: Whether to write report.html with a replay.
    """
    ask_for_revision()  # in time for the run folder
    from escort_mj import api
    from escort_mj.scenario.notes import notes

    mission = api.load_scenario(scenario, given["overrides"], given["plugins"])
    usual = Path("renders") / mission.name
    created = run_folder_of(usual, out, overwrite)
    path = created.path
    if out is None and path != usual and not OUTPUT.quiet:
        say(f"{shown_path(usual)} holds an earlier run, which is kept; --overwrite replaces it", err=True)
    for note in () if OUTPUT.quiet else notes(mission):
        say(note, err=True)
    with drawing_figures() if figures else nullcontext() as draw_figures:
        with (
            stopping.keeping(lambda: _interrupted(path, out, overwrite)),
            created as folder,
            progress_bar("simulating", " s") as progress,
        ):
            result = api.fly(mission, folder, progress, interpret=given["interpreted"])
        for line in _lines(result):
            tell(line)
        seen = result.recording is not None and result.recording["time"].values.size > 0  # something to draw
        written = draw(path, draw_figures if seen else None, video and seen, report and seen)
    told = judged(result, path, written) | {"outcome": result.outcome.value}
    return Answer([wrote(path, written)], told, exit_code(result))


@command("check", like="api.cases")
def check_command(
    paths: Texts,
    out: Path = Path("renders/check"),
    workers: Count | None = None,
    junit: Path | None = None,
    github: bool = False,
    keep: bool = False,
    video: Either = True,
    **given: Any,
) -> Answer:
    """Run scenarios in parallel and evaluate their verdicts.

    Run folders that an earlier check left for the same scenarios are replaced, or removed if the runs now
    pass.

    Example: escort-mj check main paper/case1_2d

    Example: escort-mj check scenarios/ --junit report.xml --json > report.json

    Example: escort-mj check mine.yaml --seeds 20 --set controller=asmc

    Args:
        paths: Scenario files, folders, or names of shipped scenarios.
        out: Folder for the run folders of failed runs.
        workers: Number of processes; None for one per core.
        junit: Also write JUnit XML to this file.
        github: Also print GitHub annotations.
        keep: Also keep the run folders of runs that pass.
        video: Whether to render a clip of each failed run.
    """
    from escort_mj.study.engine.parallel import parent_of_workers

    parent_of_workers()  # which gets ready meanwhile
    from escort_mj import api
    from escort_mj.files import check_place, write_text
    from escort_mj.report.pages import checked
    from escort_mj.report.video.video import render_clip
    from escort_mj.study.check import check_scenarios

    if junit is not None:
        check_place(junit)
    with progress_bar("checking", " runs") as progress:
        cases = api.cases(paths, **given)
        results = check_scenarios(cases, out, workers, keep, render_clip if video else None, progress)
    if junit is not None:
        write_text(junit, checked.junit(results))
    for line in checked.github(results) if github else ():
        typer.echo(line, err=OUTPUT.json)  # GitHub reads both
    return Answer(checked.checked_table(results), checked.as_json(results), checked.exit_code(results))


@command("show")
def show_command(run_folder: RunFolder) -> Answer:
    """Show the contents of a run folder, and recover the trace if the run was killed.

    Example: escort-mj show renders/main
    """
    from escort_mj.expect.verdicts import verdict_lines
    from escort_mj.record.folder import read_run
    from escort_mj.record.outcome import Outcome

    stored = read_run(run_folder)
    samples, robots = stored.trace.sizes["time"], stored.trace.sizes["robot"]
    physics = stored.trace.attrs.get("contact_physics")
    lines = [
        f"{shown_path(run_folder)}: {Outcome(stored.outcome['outcome']).told(stored.outcome['message'])}",
        f"trace: {samples} samples of {robots} robots",
        *([f"physics: {physics}"] if physics else []),
        *verdict_lines(stored.verdicts),
    ]
    told = {key: stored.outcome[key] for key in ("outcome", "message")} | {"physics": physics}
    told |= {"samples": samples, "robots": robots, "verdicts": [asdict(one) for one in stored.verdicts]}
    return Answer(lines, {"folder": shown_path(run_folder)} | told)


@command("metrics", like="api.runs.table", flags={"metrics": "--metric NAME"})
def metrics_command(runs: RunFolders, to: Path | None = None, **given: Any) -> Answer:
    """Tabulate metrics of runs, each over its own window or all over one.

    Example: escort-mj metrics renders/main --metric radius_error_mean --metric force_rms --after 20

    Example: escort-mj metrics renders/main renders/main-2 --over whole --to metrics.csv

    Args:
        runs: Run folders.
        to: Also write the table: FILE.csv or FILE.parquet with a row for each run, FILE.md or FILE.tex with a
            column for each.
    """
    from escort_mj.api import open_run
    from escort_mj.api.runs import table
    from escort_mj.files import check_place, write_text
    from escort_mj.record.export import CSV, PARQUET, write_frame
    from escort_mj.record.tables import aligned, latex, markdown
    from escort_mj.study.sweeps.quantities import value_text

    if to is not None:
        check_place(to, (CSV, PARQUET, ".md", ".tex"))
    found = table(map(open_run, runs), **given)
    units = found.attrs["units"]
    head = ["metric", *map(shown_path, runs)]
    rows = [["outcome", *found["outcome"]]]
    rows += [[name, *(value_text(value, unit) for value in found[name])] for name, unit in units.items()]
    written = [] if to is None else [shown_path(to)]
    if to is not None and to.suffix in (CSV, PARQUET):
        write_frame(found, to)
    elif to is not None:
        page = latex(head, rows, "Metrics of runs", "metrics")
        write_text(to, page if to.suffix == ".tex" else "\n".join([*markdown(head, rows), ""]))
    lines = [*aligned([head, *rows]), *(f"wrote {each}" for each in written)]
    numbers = [{"folder": head[k + 1]} | row for k, row in enumerate(found.to_dict("records"))]
    return Answer(lines, {"runs": numbers, "units": units, "written": written})


@command("schema", json=False)
def schema_command(markdown: bool = False, plugins: Texts = ()) -> None:
    """Print the JSON Schema of scenarios, for completion and validation in editors.

    Example: escort-mj schema > schema.json

    Args:
        markdown: Print a Markdown page of all keys instead.
    """
    from escort_mj.scenario import json_schema
    from escort_mj.scenario.reader.catalog import scenario_type_with
    from escort_mj.scenario.reader.handbook import handbook

    kind = scenario_type_with(plugins)
    typer.echo(handbook(kind) if markdown else json.dumps(json_schema(kind), indent=2))


def run_folder_of(usual: Path, out: Path | None, overwrite: bool) -> record.RunFolder:
    """Return a new run folder: what was asked for, or the usual one, or one beside it."""
    from escort_mj.record.folder import RunFolder

    if out is None and not overwrite:
        return RunFolder.create_beside(usual)
    return RunFolder.create(usual if out is None else out, overwrite=overwrite)


def judged(result: Flight, folder: Path, written: list[str]) -> dict[str, Any]:
    """Return what programs read of a run that was judged."""
    return {
        "scenario": result.scenario.name,
        "message": result.message,
        "verdicts": [asdict(verdict) for verdict in result.verdicts],
        "metrics": result.metrics,
        "folder": shown_path(folder),
        "written": [name.partition(" ")[0] for name in written],
    }


def wrote(folder: Path, written: list[str]) -> str:
    """Return the line that says what a folder holds."""
    return f"wrote {shown_path(folder)}: {' '.join(written)}"


def draw(folder: Path, draw_figures: Draw | None, video: bool, report: bool) -> list[str]:
    """Draw the requested files, figures by a function if at all, and return the contents of the folder."""
    written = ["scenario.yaml", "resolved.yaml", "model.xml", "trace.nc", "metrics.json", "verdicts.json"]
    complete = f"the run is complete; escort-mj render {shown_path(folder)} draws it"
    film = drawing_video(folder) if video else nullcontext(lambda: False)
    with stopping.keeping(lambda: complete), film as rendered:
        if draw_figures is not None:
            with progress_bar("drawing the figures", "", announced=True):
                written.append(f"figures/ ({len(draw_figures(folder))})")
        if rendered():
            written.append("video.mp4")
    if report:
        from escort_mj.report.pages.run_page import write_run_page

        written.append(write_run_page(folder).name)
    return written


def _interrupted(folder: Path, out: Path | None, overwrite: bool) -> str:
    """What an interrupted run has left."""
    from escort_mj.record.folder import is_run
    from escort_mj.record.stored import read_outcome

    said = read_outcome(folder) if is_run(folder) else {"pid": None}
    if said["pid"] != os.getpid() or not said.get("simulated_time"):
        return "the run had not taken its first step"
    end = "the whole run" if said["outcome"] == "completed" else f"the run up to then: {said['message']}"
    where = "" if overwrite else ", beside it" if out is None else ", in its place with --overwrite"
    return f"{shown_path(folder)} holds {end}; the same command makes the run from its start{where}"


def _lines(result: Flight) -> list[str]:
    """Return the outcome and the verdicts; of a quiet command, the verdicts that failed."""
    from escort_mj.expect.verdicts import verdict_lines

    if OUTPUT.quiet:
        return [*verdict_lines([verdict for verdict in result.verdicts if not verdict.passed])]
    summary = result.metrics["run"]
    speed = summary["real_time_factor"]
    times = f", {speed:.0f} times real time" if speed else ""
    ended = f"{result.scenario.name}: {result.outcome.told(result.message)}"
    return [f"{ended} ({summary['wall_time']:.2f} s of wall time{times})", *verdict_lines(result.verdicts)]


def exit_code(result: Flight) -> int:
    """What a run means to a shell or a CI job."""
    if not result.verdicts[0].passed:  # how it ended
        return BROKEN
    return GOOD if result.passed else VERDICT_FAILED
