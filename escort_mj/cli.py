"""The command line: thin; each command calls one function of the package and prints what came of it."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from escort_mj.errors import EscortError, ScenarioError, UsageError

if TYPE_CHECKING:
    from escort_mj.mission import Run

app = typer.Typer(
    name="escort-mj",
    help="Multi-robot escort missions on real physics: one YAML in, verdicts, figures and a video out.",
    epilog="Exit codes: 0 good, 1 a verdict failed, 2 bad input, 3 the run diverged or broke.",
    no_args_is_help=True,
    add_completion=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)

GOOD, VERDICT_FAILED, BAD_INPUT, BROKEN = 0, 1, 2, 3

ScenarioArgument = Annotated[
    str, typer.Argument(help="A scenario file, or the name of a shipped one, such as main.")
]
SetOption = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY.PATH=VALUE", help="Overrides one value; may be given many times."),
]


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
        _progress("simulating", " s") as progress,
    ):
        result = api.fly(mission, folder, progress)
    _report(result)
    written = ["scenario.yaml", "model.xml", "trace.nc", "metrics.json", "verdicts.json"]
    if figures:
        from escort_mj.report.figures import draw_figures

        written.append(f"figures/ ({len(draw_figures(folder.path))})")
    if video and _draw_video(folder.path):
        written.append("video.mp4")
    typer.echo(f"wrote {_shown(folder.path)}: {' '.join(written)}")
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
    with _progress("checking", " scenarios") as progress:
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
        typer.echo(_shown(path))
    if _draw_video(run_folder):
        typer.echo(_shown(run_folder / "video.mp4"))


@app.command()
def show(
    run_folder: Annotated[Path, typer.Argument(help="A run folder.", exists=True, file_okay=False)],
) -> None:
    """Say what a run folder holds; recovers the trace of a run that was killed."""
    from escort_mj.expect.verdicts import Verdict, verdict_lines
    from escort_mj.record.folder import open_run

    stored = open_run(run_folder)
    typer.echo(f"{_shown(run_folder)}: {stored.outcome['outcome']}: {stored.outcome['message']}")
    typer.echo(f"trace: {stored.trace.sizes['time']} samples of {stored.trace.sizes['robot']} robots")
    for line in verdict_lines([Verdict(**verdict) for verdict in stored.verdicts]):
        typer.echo(line)


@app.command()
def schema() -> None:
    """Print the JSON Schema of scenarios, for editors that complete and check them."""
    from escort_mj.scenario import json_schema

    typer.echo(json.dumps(json_schema(), indent=2))


@app.command()
def reproduce(
    only: Annotated[
        list[str] | None,
        typer.Option(metavar="FIG", help="A figure: 5 to 17, or laws; may be given many times."),
    ] = None,
    out: Annotated[Path, typer.Option(help="Where runs, figures and table go.")] = Path(
        "renders/reproduction"
    ),
    workers: Annotated[int | None, typer.Option(min=1, help="Processes [default: as many as cores].")] = None,
    docs: Annotated[Path | None, typer.Option(help="Also write the table to this file of the docs.")] = None,
    again: Annotated[bool, typer.Option("--again", help="Run what has been run before, too.")] = False,
) -> None:
    """Run the paper's simulations, draw its figures, and say what of its claims holds.

    Example: escort-mj reproduce --only 5 --only 6
    """
    from escort_mj import api
    from escort_mj.report.reproduction import reproduce as reproduce_paper

    with _progress("reproducing", " steps") as progress:
        result = reproduce_paper(api.scenarios_folder(), out, only or (), workers, docs, again, progress)
    for line in result.lines:
        typer.echo(line)
    typer.echo(f"wrote {_shown(out)}: {' '.join(result.written)}")
    raise typer.Exit(GOOD if result.stated else BROKEN)


@app.command()
def compare(
    scenario: ScenarioArgument,
    laws: Annotated[
        list[str] | None,
        typer.Option(metavar="LAW,...", help="Laws of the inner loop, such as apd_smc,pd [default: all]."),
    ] = None,
    outer: Annotated[
        list[str] | None,
        typer.Option(metavar="LOOP,...", help="Outer loops, such as nsb,barrier_filter [default: its own]."),
    ] = None,
    seeds: Annotated[int, typer.Option(min=1, help="Seeds, from the scenario's own upward.")] = 1,
    overrides: SetOption = None,
    out: Annotated[
        Path | None, typer.Option(help="Where runs, figures and table go [default: renders/compare/NAME].")
    ] = None,
    workers: Annotated[int | None, typer.Option(min=1, help="Processes [default: as many as cores].")] = None,
    docs: Annotated[
        Path | None, typer.Option(help="Also put the table into this page, between its marks.")
    ] = None,
    again: Annotated[bool, typer.Option("--again", help="Run what has been run before, too.")] = False,
) -> None:
    """Run one scenario under several laws and outer loops, and compare them in one table.

    Example: escort-mj compare main --laws apd_smc,pd --outer nsb,barrier_filter --seeds 5
    """
    from escort_mj import api
    from escort_mj.report.comparison import compare as compare_laws

    mission = api.load_scenario(scenario, overrides or ())
    folder = out if out is not None else Path("renders") / "compare" / mission.name
    with _progress("comparing", " runs") as progress:
        result = compare_laws(mission, folder, laws or (), outer or (), seeds, workers, docs, again, progress)
    for line in result.lines:
        typer.echo(line)
    typer.echo(f"wrote {_shown(folder)}: {' '.join(result.written)}")
    raise typer.Exit(GOOD if result.stated else BROKEN)


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


def _draw_video(folder: Path) -> bool:
    """Draws the video; without GL it says what is missing and leaves the rest of the run as it is."""
    from escort_mj.errors import RenderError
    from escort_mj.report.video import render_video

    try:
        with _progress("drawing the video", " frames") as progress:
            render_video(folder, progress=progress)
    except RenderError as error:
        typer.echo(f"no video: {error}", err=True)
        return False
    return True


@contextmanager
def _progress(label: str, unit: str) -> Iterator[Callable[[float, float], None] | None]:
    """A progress bar with rate and time left on a terminal; nothing in a pipe."""
    if not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.completed:.0f}/{task.total:.0f}" + unit),
        TextColumn("{task.fields[rate]}"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(label, total=1.0, rate="")

        def update(done: float, total: float) -> None:
            speed = bar.tasks[0].speed
            bar.update(task, completed=done, total=total, rate=f"{speed:.1f}{unit}/s" if speed else "")

        yield update


def _shown(path: Path) -> str:
    """A path as short as it can be typed from here."""
    relative = os.path.relpath(path)
    return str(path) if relative.startswith("..") else relative


def main() -> None:
    """Entry point: runs a command; errors become one message and an exit code, never a traceback."""
    try:
        app()
    except ScenarioError as error:
        typer.echo(str(error), err=True)
        sys.exit(error.exit_code)
    except EscortError as error:
        typer.echo(f"escort-mj: {error}", err=True)
        sys.exit(error.exit_code)
    except Exception as error:
        if os.environ.get("ESCORT_MJ_TRACEBACK"):
            raise
        typer.echo(
            f"escort-mj: the program broke: {type(error).__name__}: {error}\n"
            "ESCORT_MJ_TRACEBACK=1 shows where; please report it.",
            err=True,
        )
        sys.exit(BROKEN)


if __name__ == "__main__":
    main()
