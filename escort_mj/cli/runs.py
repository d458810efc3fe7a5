"""Commands for one run, or for several scenarios: run, check, show, schema."""

from __future__ import annotations

import json
import os
from contextlib import nullcontext
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from escort_mj import stopping
from escort_mj.cli.app import (
    BROKEN,
    GOOD,
    VERDICT_FAILED,
    FiguresOption,
    JsonOption,
    OverwriteOption,
    PluginOption,
    ReportOption,
    RunArgument,
    ScenarioArgument,
    SetOption,
    VideoOption,
    WorkersOption,
    app,
    complete,
    drawing_figures,
    drawing_video,
    finish,
    progress_bar,
    say,
    shown_path,
)
from escort_mj.cli.streams import OUTPUT
from escort_mj.errors import UsageError

if TYPE_CHECKING:
    from escort_mj.mission import Flight
    from escort_mj.report.figures.ahead import Draw


@app.command("run")
def run_command(
    scenario: ScenarioArgument,
    overrides: SetOption = None,
    plugins: PluginOption = None,
    out: Annotated[Path | None, typer.Option(help="Run folder [default: renders/NAME].")] = None,
    overwrite: OverwriteOption = False,
    video: VideoOption = True,
    figures: FiguresOption = True,
    report: ReportOption = False,
    interpreted: Annotated[
        bool,
        typer.Option(
            "--interpreted",
            help="Run the controller as plain Python, where a debugger can stop. It takes about a thousand "
            "times as long and agrees with the machine code to rounding.",
        ),
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """Run one scenario and write its run folder.

    An earlier run in renders/NAME is kept; the new one is written to renders/NAME-2, renders/NAME-3 and so
    on.

    Example: escort-mj run main

    Example: escort-mj run mine.yaml --set controller=asmc --set mission.max_speed=1 --no-video
    """
    from escort_mj import api
    from escort_mj.record.folder import RunFolder
    from escort_mj.scenario.notes import notes

    mission = api.load_scenario(scenario, overrides or (), plugins or ())
    usual = Path("renders") / mission.name
    if out is None and not overwrite:
        created = RunFolder.create_beside(usual)
        if created.path != usual and not OUTPUT.quiet:
            words = f"{shown_path(usual)} holds an earlier run, which is kept; --overwrite replaces it"
            say(words, err=True)
    else:
        created = RunFolder.create(out if out is not None else usual, overwrite=overwrite)
    path = created.path
    for note in () if OUTPUT.quiet else notes(mission):
        say(note, err=True)
    with drawing_figures() if figures else nullcontext() as draw_figures:
        with (
            stopping.keeping(lambda: _interrupted(path)),
            created as folder,
            progress_bar("simulating", " s") as progress,
        ):
            result = api.fly(mission, folder, progress, interpret=interpreted)
        if not as_json:
            (_report_failures if OUTPUT.quiet else _report)(result)
        with stopping.keeping(lambda: f"the run is complete; escort-mj render {shown_path(path)} draws it"):
            written = draw(folder.path, draw_figures, video, report)
    finish(
        "run",
        as_json,
        [f"wrote {shown_path(folder.path)}: {' '.join(written)}"],
        exit_code(result),
        scenario=result.scenario.name,
        outcome=result.outcome.value,
        message=result.message,
        verdicts=[asdict(verdict) for verdict in result.verdicts],
        metrics=result.metrics,
        folder=shown_path(folder.path),
        written=[name.split(" ")[0] for name in written],
    )


@app.command("check")
def check_command(
    paths: Annotated[
        list[str],
        typer.Argument(
            help="Scenario files, folders, or names of shipped scenarios.",
            autocompletion=complete.scenarios,
        ),
    ],
    overrides: SetOption = None,
    plugins: PluginOption = None,
    seeds: Annotated[
        int, typer.Option(min=1, help="Number of seeds per scenario, starting at the scenario's seed.")
    ] = 1,
    repeat: Annotated[
        int,
        typer.Option(
            min=1, help="Number of runs per seed; a run that is not identical to the first one fails."
        ),
    ] = 1,
    out: Annotated[Path, typer.Option(help="Folder for the run folders of failed runs.")] = Path(
        "renders/check"
    ),
    workers: WorkersOption = None,
    junit: Annotated[Path | None, typer.Option(help="Also write JUnit XML to this file.")] = None,
    github: Annotated[bool, typer.Option("--github", help="Also print GitHub annotations.")] = False,
    keep: Annotated[
        bool, typer.Option("--keep", help="Also keep the run folders of runs that pass.")
    ] = False,
    video: Annotated[
        bool, typer.Option("--video/--no-video", help="Whether to render a clip of each failed run.")
    ] = True,
    as_json: JsonOption = False,
) -> None:
    """Run scenarios in parallel and evaluate their verdicts.

    Run folders that an earlier check left for the same scenarios are replaced, or removed if the runs now
    pass.

    Example: escort-mj check main paper/case1_2d

    Example: escort-mj check scenarios/ --junit report.xml --json > report.json

    Example: escort-mj check mine.yaml --seeds 20 --set controller=asmc
    """
    from escort_mj.study.engine.parallel import parent_of_workers

    parent_of_workers()  # which gets ready meanwhile
    from escort_mj import api
    from escort_mj.record.files import write_text
    from escort_mj.report.pages import checked
    from escort_mj.report.video.video import render_clip
    from escort_mj.study.check import check_scenarios
    from escort_mj.study.checked import with_seeds

    if junit is not None and not junit.parent.is_dir():
        raise UsageError(f"{junit}: there is no folder {junit.parent}")
    with progress_bar("checking", " runs") as progress:
        cases = [
            case._replace(overrides=tuple(overrides or ()), plugins=tuple(plugins or ()), repeat=repeat)
            for case in api.cases(paths)
        ]
        results = check_scenarios(
            with_seeds(cases, seeds), out, workers, keep, render_clip if video else None, progress
        )
    if junit is not None:
        write_text(junit, checked.junit(results))
    for line in checked.github(results) if github else ():
        typer.echo(line, err=as_json)  # GitHub reads both
    finish(
        "check",
        as_json,
        checked.checked_table(results),
        checked.exit_code(results),
        **checked.as_json(results),
    )


@app.command("show")
def show_command(
    run_folder: RunArgument,
    as_json: JsonOption = False,
) -> None:
    """Show the contents of a run folder, and recover the trace if the run was killed.

    Example: escort-mj show renders/main
    """
    from escort_mj.expect.verdicts import Verdict, verdict_lines
    from escort_mj.record.folder import read_run
    from escort_mj.record.outcome import Outcome

    stored = read_run(run_folder)
    samples, robots = stored.trace.sizes["time"], stored.trace.sizes["robot"]
    physics = stored.trace.attrs.get("contact_physics")
    lines = [
        f"{shown_path(run_folder)}: {Outcome(stored.outcome['outcome']).told(stored.outcome['message'])}",
        f"trace: {samples} samples of {robots} robots",
        *([f"physics: {physics}"] if physics else []),
        *verdict_lines([Verdict(**verdict) for verdict in stored.verdicts if "metric" in verdict]),
    ]
    told = {key: stored.outcome[key] for key in ("outcome", "message")} | {"physics": physics}
    told |= {"samples": samples, "robots": robots, "verdicts": stored.verdicts}
    finish("show", as_json, lines, folder=shown_path(run_folder), **told)


@app.command("schema")
def schema_command(
    markdown: Annotated[
        bool, typer.Option("--markdown", help="Print a Markdown page of all keys instead.")
    ] = False,
    plugins: PluginOption = None,
) -> None:
    """Print the JSON Schema of scenarios, for completion and validation in editors.

    Example: escort-mj schema > schema.json
    """
    from escort_mj.scenario import json_schema
    from escort_mj.scenario.reader.catalog import scenario_type_with
    from escort_mj.scenario.reader.handbook import handbook

    kind = scenario_type_with(plugins or ())
    typer.echo(handbook(kind) if markdown else json.dumps(json_schema(kind), indent=2))


def draw(folder: Path, draw_figures: Draw | None, video: bool, report: bool) -> list[str]:
    """Draw the requested files, figures by a function if at all, and return the contents of the folder."""
    written = ["scenario.yaml", "resolved.yaml", "model.xml", "trace.nc", "metrics.json", "verdicts.json"]
    with drawing_video(folder) if video else nullcontext(lambda: False) as rendered:
        if draw_figures is not None:
            with progress_bar("drawing the figures", "", announced=True):
                written.append(f"figures/ ({len(draw_figures(folder))})")
        if rendered():
            written.append("video.mp4")
    if report:
        from escort_mj.report.pages.run_page import write_run_page

        written.append(write_run_page(folder).name)
    return written


def _interrupted(folder: Path) -> str:
    """What an interrupted run has left."""
    from escort_mj.record.folder import is_run
    from escort_mj.record.stored import read_outcome

    said = read_outcome(folder) if is_run(folder) else {"pid": None}
    if said["pid"] != os.getpid() or not said.get("simulated_time"):
        return "the run had not taken its first step"
    end = "the whole run" if said["outcome"] == "completed" else f"the run up to then: {said['message']}"
    return f"{shown_path(folder)} holds {end}; the same command makes the run from its start, beside it"


def _report(result: Flight) -> None:
    """Print the outcome and the verdicts."""
    from escort_mj.expect.verdicts import verdict_lines

    summary = result.metrics["run"]
    speed = summary["real_time_factor"]
    say(
        f"{result.scenario.name}: {result.outcome.told(result.message)}"
        f" ({summary['wall_time']:.2f} s of wall time{f', {speed:.0f} times real time' if speed else ''})"
    )
    for line in verdict_lines(result.verdicts):
        say(line)


def _report_failures(result: Flight) -> None:
    """Print the verdicts that failed."""
    from escort_mj.expect.verdicts import verdict_lines

    for line in verdict_lines([verdict for verdict in result.verdicts if not verdict.passed]):
        say(line)


def exit_code(result: Flight) -> int:
    """What a run means to a shell or a CI job."""
    if not result.verdicts[0].passed:  # how it ended
        return BROKEN
    return GOOD if result.passed else VERDICT_FAILED
