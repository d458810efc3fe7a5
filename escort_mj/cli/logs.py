"""The command for logs of real robots: judge."""

from __future__ import annotations

from contextlib import nullcontext
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from escort_mj.cli.app import (
    GOOD,
    VERDICT_FAILED,
    FiguresOption,
    JsonOption,
    OverwriteOption,
    PluginOption,
    ReportOption,
    SetOption,
    VideoOption,
    app,
    complete,
    drawing_figures,
    finish,
    progress_bar,
    shown_path,
)
from escort_mj.cli.runs import draw, exit_code
from escort_mj.errors import UsageError


@app.command("judge")
def judge_command(
    log: Annotated[
        Path,
        typer.Argument(help="Log of real robots: FILE.csv, FILE.parquet, FILE.mcap, or a ROS bag."),
    ],
    scenario: Annotated[
        str,
        typer.Option(
            help="Scenario file, or name of a shipped scenario, against which the log is judged.",
            autocompletion=complete.scenarios,
        ),
    ],
    names: Annotated[
        list[str] | None,
        typer.Option(
            "--map",
            metavar="BODY=NAME",
            help="Name of a body in the log, such as robot_1=/uav3/odom or robot_1=uav3; repeatable.",
        ),
    ] = None,
    start: Annotated[
        float | None,
        typer.Option(
            help="Time stamp at which the mission starts [s] [default: the first with data on all bodies].",
        ),
    ] = None,
    overrides: SetOption = None,
    plugins: PluginOption = None,
    out: Annotated[Path | None, typer.Option(help="Run folder [default: renders/LOG].")] = None,
    overwrite: OverwriteOption = False,
    video: VideoOption = False,
    figures: FiguresOption = True,
    report: ReportOption = False,
    strict: Annotated[bool, typer.Option(help="Fail unless every expectation is judged.")] = False,
    as_json: JsonOption = False,
) -> None:
    """Judge a log of real robots against a scenario, and write the result as a run folder.

    Verdicts on quantities that the log does not contain neither pass nor fail; if nothing that the scenario
    expects can be judged, the log fails.

    Example: escort-mj judge flight.csv --scenario mission.yaml

    Example: escort-mj judge bag_folder --scenario mission.yaml --map robot_1=/uav3/odom --report
    """
    from escort_mj import api
    from escort_mj.expect.verdicts import verdict_lines
    from escort_mj.judging.judge import judge_log
    from escort_mj.mission import save
    from escort_mj.record.folder import RunFolder
    from escort_mj.record.recording import gaps_of

    mission = api.load_scenario(scenario, overrides or (), plugins or ())
    with progress_bar("judging", " s") as progress:
        result = judge_log(log, mission, _names(names or ()), start, progress)
    if out is None and not overwrite:
        created = RunFolder.create_beside(Path("renders") / log.stem)
    else:
        created = RunFolder.create(
            out if out is not None else Path("renders") / log.stem, overwrite=overwrite
        )
    with created as folder:
        save(folder, result)
    with drawing_figures() if figures else nullcontext() as draw_figures:
        written = draw(folder.path, draw_figures, video, report)
    judged = [verdict for verdict in result.verdicts if not verdict.skip]
    missing = len(result.verdicts) - len(judged)
    unasked = {place for place, one in enumerate(mission.expect) if one.skip is not None}
    unknown = [verdict for verdict in result.verdicts if verdict.skip and verdict.expectation not in unasked]
    held = sum(verdict.passed for verdict in judged)
    words = f"; {missing} not judged" if missing else ""
    lines = [
        f"{result.scenario.name}: {result.message}",
        *verdict_lines(result.verdicts),
        f"{held} of {len(judged)} verdicts passed{words}",
        f"wrote {shown_path(folder.path)}: {' '.join(written)}",
    ]
    finish(
        "judge",
        as_json,
        lines,
        exit_code(result) or (VERDICT_FAILED if strict and unknown else GOOD),
        scenario=result.scenario.name,
        message=result.message,
        verdicts=[asdict(verdict) for verdict in result.verdicts],
        not_judged=missing,
        gaps=gaps_of(result.trace).tolist(),
        metrics=result.metrics,
        folder=shown_path(folder.path),
        written=[name.split(" ")[0] for name in written],
    )


def _names(pairs: list[str] | tuple[str, ...]) -> dict[str, str]:
    """What `--map` says."""
    found: dict[str, str] = {}
    for pair in pairs:
        body, equals, name = pair.partition("=")
        if not (body and equals and name):
            raise UsageError(f"--map {pair}: expected BODY=NAME, such as robot_1=/uav3/odom")
        if body in found:
            raise UsageError(f"--map: {body} is named twice, {found[body]} and {name}")
        found[body] = name
    return found
