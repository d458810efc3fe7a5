"""Commands around runs: new, export, gains, doctor."""

from __future__ import annotations

import json
import math
import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from escort_mj.cli.app import (
    GOOD,
    VERDICT_FAILED,
    JsonOption,
    PluginOption,
    ScenarioArgument,
    SetOption,
    app,
    complete,
    finish,
    say,
    shown_path,
)
from escort_mj.errors import UsageError

if TYPE_CHECKING:
    from escort_mj.scenario.schema.scenario import Scenario


@app.command("new")
def new_command(
    file: Annotated[Path, typer.Argument(help="Scenario file to write, such as mine.yaml.")],
    robots: Annotated[int, typer.Option(min=2, max=1000, help="Number of robots.")] = 6,
    axes: Annotated[int, typer.Option(min=2, max=3, help="2 for the plane, 3 for space.")] = 2,
    law: Annotated[str, typer.Option(help="Law of the inner loop.")] = "apd_smc",
    as_json: JsonOption = False,
) -> None:
    """Write a commented scenario as a starting point, and the schema for editors.

    Example: escort-mj new mine.yaml --robots 8
    """
    from escort_mj.record.files import write_text
    from escort_mj.scenario import json_schema
    from escort_mj.scenario.reader.load import parse_scenario
    from escort_mj.scenario.reader.starter import starter

    path = file if file.suffix in (".yaml", ".yml") else file.with_suffix(".yaml")
    if path.exists():
        raise UsageError(f"{path}: is there already")
    if not path.parent.is_dir():
        raise UsageError(f"{path}: there is no folder {path.parent}")
    text = starter(path.stem, robots, axes, law)
    parse_scenario(text, f"escort-mj new {path.name}")
    write_text(path, text)
    written = [path]
    if not (schema := path.parent / "schema.json").exists():
        write_text(schema, json.dumps(json_schema(), indent=2) + "\n")
        written.append(schema)
    line = f"wrote {' '.join(path.name for path in written)}; next: escort-mj run {shown_path(path)}"
    finish("new", as_json, [line], written=[shown_path(path) for path in written])


@app.command("export")
def export_command(
    source: Annotated[
        str,
        typer.Argument(
            help="Run folder, scenario file, or name of a shipped scenario.",
            autocompletion=complete.runs_or_scenarios,
        ),
    ],
    to: Annotated[
        Path,
        typer.Argument(
            help="FILE.xml: the world as MJCF. For a run, also FILE.csv or FILE.parquet: a table; "
            "FILE.npz: MuJoCo states."
        ),
    ],
    overrides: SetOption = None,
    plugins: PluginOption = None,
    as_json: JsonOption = False,
) -> None:
    """Export the world of a scenario or run as MJCF, or export a run for other programs.

    Example: escort-mj export main main.xml

    Example: escort-mj export renders/main main.csv

    Example: escort-mj export renders/main main.csv
    """
    from escort_mj import api
    from escort_mj.record.files import write_model
    from escort_mj.record.folder import read_run
    from escort_mj.report.exports.exports import MJCF, check_export, export_run

    is_run = os.path.isdir(source)
    check_export(to)
    if is_run and overrides:
        raise UsageError("--set changes a scenario; a run folder is what it is")
    if is_run:
        export_run(read_run(source), to)
    elif to.suffix != MJCF:
        raise UsageError(f"{source}: not a run folder; only runs can be exported as {to.suffix}")
    else:
        from escort_mj.world.model.build import build

        world = build(api.load_scenario(source, overrides or (), plugins or ()))
        write_model(to, world.xml, world.assets)
    finish("export", as_json, [f"wrote {shown_path(to)}"], written=[shown_path(to)])


@app.command("gains")
def gains_command(
    scenario: ScenarioArgument,
    overrides: SetOption = None,
    plugins: PluginOption = None,
    as_json: JsonOption = False,
) -> None:
    """Propose gains for the scenario's laws and robots, as `controller: {gains: auto}` computes them.

    Example: escort-mj gains robots/quadrotor

    Example: escort-mj gains main --set controller=asmc --set robots.actuators.lag=0.05
    """
    from escort_mj import api

    mission = api.load_scenario(scenario, overrides or (), plugins or ())
    own = [number for number, team in enumerate(mission.teams) if team.controller is not None]
    lines: list[str] = []
    told: dict[str, Any] = {}
    if not own or len(own) < len(mission.teams):
        lines, told = _proposed(scenario, mission)
    for number in own:
        name = mission.teams[number].name
        more, facts = _proposed(scenario, mission, number)
        lines += [f"team {name}", *(f"  {line}" for line in more)]
        told["teams"] = told.get("teams", {}) | {name: facts}
    finish("gains", as_json, lines, **told)


def _proposed(
    scenario: str, mission: Scenario, number: int | None = None
) -> tuple[list[str], dict[str, Any]]:
    """Return gains of a team's law, from 0, or of the mission's: lines for people, and numbers."""
    from escort_mj.laws.gains import LAWS_WITH_A_RULE
    from escort_mj.record.tables import aligned
    from escort_mj.scenario.geometry.team_gains import law_of, proposal

    law, found = law_of(mission, number), proposal(mission, number)
    if found is None:
        laws = ", ".join(LAWS_WITH_A_RULE)
        raise UsageError(f"{scenario}: no rule for law {law.law} and its robots; laws: {laws}")
    about, rate = found.about, found.rate
    limit = f"force limit {about.force_limit:.4g} N" if math.isfinite(about.force_limit) else "no force limit"
    rows = [("key", "scenario", "auto")]
    rows += [(key, f"{getattr(law, key):g}", f"{new:g}") for key, new in found.gains.items()]
    lines = [
        f"robot {found.robot}: effective mass {about.mass:.3g} kg, delay {about.delay:.3g} s, {limit}",
        f"{found.law}: velocity loop at {rate.value:.3g} /s, limited by {rate.reason}",
        *(f"  {line}" for line in aligned(rows)),
    ]
    told = {"law": found.law, "gains": found.gains, "robot": found.robot, "mass": about.mass}
    return lines, told | {"delay": about.delay, "rate": rate.value, "limited_by": rate.reason}


@app.command("check-plugin")
def check_plugin_command(
    plugin: Annotated[str, typer.Argument(help="Python file, or name of an installed plugin.")],
    as_json: JsonOption = False,
) -> None:
    """Test the components of a plugin: laws, behaviors, disturbances, robots, metrics and more.

    Exit codes: 0 if all tests pass, 1 if a test fails, 2 if the plugin cannot be loaded.

    Example: escort-mj check-plugin own_law.py
    """
    from escort_mj.conformance.apart import check_apart

    checks = []
    for found in check_apart(plugin):
        checks.append(found)
        if not as_json:  # at once: a mission takes its time to compile
            say(f"  {'ok' if found.held else 'NO'}  {found.member}  {found.name:20s} {found.words}")
    code = GOOD if all(found.held for found in checks) else VERDICT_FAILED
    finish("check-plugin", as_json, [], code, checks=[found._asdict() for found in checks])


@app.command("check-robot")
def check_robot_command(
    robot: Annotated[Path, typer.Argument(help="MJCF file of a robot.")],
    body: Annotated[
        str | None,
        typer.Option("--body", help="Body that the law moves; default: the only one that can move."),
    ] = None,
    drive: Annotated[
        str | None,
        typer.Option(
            "--drive",
            help="Drive: force, thrust, steer, wheels, omni or velocity; default: found from the model.",
        ),
    ] = None,
    root: Annotated[
        Path | None,
        typer.Option(
            "--root",
            help="Folder that all files of the robot lie in or below [default: that of the MJCF file].",
        ),
    ] = None,
    figure: Annotated[
        Path | None, typer.Option("--figure", help="File for the step response: .png, .pdf or .svg.")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Show what the program finds in a robot's MJCF, and its response to a velocity step along each axis.

    Exit codes: 0 if the robot comes within 5 % of each step and overshoots by less than 30 %, 1 if not, 2 if
    the robot cannot be read or driven.

    Example: escort-mj check-robot rover.xml --figure rover.png
    """
    from escort_mj.conformance.robot import answers, checked_model, model_page

    kind, model = checked_model(robot, body, drive, root)
    for line in () if as_json else model_page(kind, model):
        say(line)
    steps = []
    for answer in answers(kind, model):
        steps.append(answer)
        if not as_json:  # at once: a step takes its time
            say(f"{'ok' if answer.held else 'NO'}  {answer.words}")
    written = []
    if figure is not None:
        from escort_mj.report.figures.answer import Step, draw_steps

        draw_steps([Step(*answer[:4]) for answer in steps], f"{robot.name}: steps of velocity", figure)
        written = [shown_path(figure)]
    lines = [f"wrote {each}" for each in written]
    code = GOOD if all(answer.held for answer in steps) else VERDICT_FAILED
    numbers = {answer.axis: answer.numbers for answer in steps}
    finish("check-robot", as_json, lines, code, robot=model_page(kind, model), steps=numbers, written=written)


@app.command("doctor")
def doctor_command(
    folder: Annotated[Path, typer.Option("--out", help="Folder for the runs.")] = Path("renders"),
    as_json: JsonOption = False,
) -> None:
    """Check whether runs, figures and videos work on this machine, and suggest fixes.

    The exit code is 1 if runs do not work.

    Example: escort-mj doctor
    """
    from escort_mj.cli.doctor import BAD, examine_machine

    marks: dict[Literal["good", "warning", "bad"], str] = {"good": "ok", "warning": "--", "bad": "NO"}
    findings = list(examine_machine(folder))
    lines = []
    for finding in findings:
        lines.append(f"  {marks[finding.state]}  {finding.check:10s} {finding.found}")
        lines += [f"      {'':10s} {finding.advice}"] if finding.advice else []
    code = VERDICT_FAILED if any(finding.state == BAD for finding in findings) else GOOD
    finish("doctor", as_json, lines, code, findings=[finding._asdict() for finding in findings])
