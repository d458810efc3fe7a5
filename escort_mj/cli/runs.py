"""Commands for one run, or for several scenarios: run, check, render, show, schema."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from escort_mj.cli.app import (
    BROKEN,
    GOOD,
    VERDICT_FAILED,
    ScenarioArgument,
    SetOption,
    app,
    draw_video,
    progress_bar,
    shown,
)
from escort_mj.errors import UsageError

if TYPE_CHECKING:
    from escort_mj.mission import Run


@app.command()
def run(
    scenario: ScenarioArgument,
    overrides: SetOption = None,
    out: Annotated[Path | None, typer.Option(help="Run folder to write [default: renders/NAME].")] = None,
    video: Annotated[bool, typer.Option("--video/--no-video", help="Whether to draw the video.")] = True,
    figures: Annotated[
        bool, typer.Option("--figures/--no-figures", help="Whether to draw the figures.")
    ] = True,
) -> None:
    """Run one scenario and write its run folder.

    Example: escort-mj run main --set controller=asmc --set mission.max_speed=1 --no-video
    """
    from escort_mj import api
    from escort_mj.record.folder import RunFolder

    mission = api.load_scenario(scenario, overrides or ())
    with (
        RunFolder.create(out if out is not None else Path("renders") / mission.name) as folder,
        progress_bar("simulating", " s") as progress,
    ):
        result = api.fly(mission, folder, progress)
    _report(result)
    written = ["scenario.yaml", "model.xml", "trace.nc", "metrics.json", "verdicts.json"]
    if figures:
        from escort_mj.report.figures import draw_figures

        written.append(f"figures/ ({len(draw_figures(folder.path))})")
    if video and draw_video(folder.path):
        written.append("video.mp4")
    typer.echo(f"wrote {shown(folder.path)}: {' '.join(written)}")
    raise typer.Exit(_exit_code(result))


@app.command()
def check(
    paths: Annotated[
        list[str], typer.Argument(help="Scenario files, folders of them, or names of shipped ones.")
    ],
    out: Annotated[Path, typer.Option(help="Where run folders of those that fail go.")] = Path(
        "renders/check"
    ),
    workers: Annotated[int | None, typer.Option(min=1, help="Processes [default: as many as cores].")] = None,
    junit: Annotated[Path | None, typer.Option(help="Also write JUnit XML to this file.")] = None,
    json_file: Annotated[Path | None, typer.Option("--json", help="Also write JSON to this file.")] = None,
    github: Annotated[bool, typer.Option("--github", help="Also print GitHub annotations.")] = False,
    keep: Annotated[bool, typer.Option("--keep", help="Keep run folders of those that pass, too.")] = False,
    video: Annotated[
        bool, typer.Option("--video/--no-video", help="Whether to draw a clip of those that fail.")
    ] = True,
) -> None:
    """Run scenarios side by side and judge them: exit code 1 if a verdict fails, 2 bad input, 3 a run broke.

    Example: escort-mj check scenarios/ --junit report.xml
    """
    from escort_mj import api
    from escort_mj.record.files import write_json, write_text
    from escort_mj.report import checked
    from escort_mj.report.check import check as check_all

    for file in (junit, json_file):
        if file is not None and not file.parent.is_dir():
            raise UsageError(f"{file}: there is no folder {file.parent}")
    with progress_bar("checking", " scenarios") as progress:
        results = check_all(api.cases(paths), out, workers, keep, video, progress)
    for line in checked.table(results):
        typer.echo(line)
    if junit is not None:
        write_text(junit, checked.junit(results))
    if json_file is not None:
        write_json(json_file, checked.as_json(results))
    for line in checked.github(results) if github else ():
        typer.echo(line)
    raise typer.Exit(checked.exit_code(results))


@app.command()
def render(
    run_folder: Annotated[Path, typer.Argument(help="A run folder.", exists=True, file_okay=False)],
) -> None:
    """Draw the figures and the video of a run folder anew."""
    from escort_mj.report.figures import draw_figures

    for path in draw_figures(run_folder):
        typer.echo(shown(path))
    if draw_video(run_folder):
        typer.echo(shown(run_folder / "video.mp4"))


@app.command()
def show(
    run_folder: Annotated[Path, typer.Argument(help="A run folder.", exists=True, file_okay=False)],
) -> None:
    """Say what a run folder holds; recovers the trace of a run that was killed."""
    from escort_mj.expect.verdicts import Verdict, verdict_lines
    from escort_mj.record.folder import open_run

    stored = open_run(run_folder)
    typer.echo(f"{shown(run_folder)}: {stored.outcome['outcome']}: {stored.outcome['message']}")
    typer.echo(f"trace: {stored.trace.sizes['time']} samples of {stored.trace.sizes['robot']} robots")
    if physics := stored.trace.attrs.get("contact_physics"):
        typer.echo(f"physics: {physics}")
    for line in verdict_lines([Verdict(**verdict) for verdict in stored.verdicts]):
        typer.echo(line)


@app.command()
def schema(
    markdown: Annotated[bool, typer.Option("--markdown", help="Print every key as a page instead.")] = False,
) -> None:
    """Print the JSON Schema of scenarios, for editors that complete and check them.

    Example: escort-mj schema > schema.json
    """
    from escort_mj.scenario import json_schema
    from escort_mj.scenario.handbook import handbook

    typer.echo(handbook() if markdown else json.dumps(json_schema(), indent=2))


def _report(result: Run) -> None:
    """Prints the outcome and the verdicts."""
    from escort_mj.expect.verdicts import verdict_lines

    summary = result.metrics["run"]
    speed = summary["real_time_factor"]
    typer.echo(
        f"{result.scenario.name}: {result.outcome.value}: {result.message}"
        f" ({summary['wall_time']:.2f} s of wall time{f', {speed:.0f} times real time' if speed else ''})"
    )
    for line in verdict_lines(result.verdicts):
        typer.echo(line)


def _exit_code(result: Run) -> int:
    """What a run means to a shell or a CI job."""
    if not result.verdicts[0].passed:  # how it ended
        return BROKEN
    return GOOD if result.passed else VERDICT_FAILED
