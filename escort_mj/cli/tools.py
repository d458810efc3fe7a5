"""Commands around runs: new, export, gains, doctor."""

from __future__ import annotations

import json
import math
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from escort_mj.cli.app import GOOD, VERDICT_FAILED, Answer, command, shown_path
from escort_mj.cli.options import Axes, Overrides, Robots, ScenarioName, Source, Texts
from escort_mj.cli.streams import OUTPUT, tell
from escort_mj.errors import UsageError

if TYPE_CHECKING:
    from escort_mj.scenario.schema.scenario import Scenario


@command("new")
def new_command(file: Path, robots: Robots = 6, axes: Axes = 2, law: str = "apd_smc") -> Answer:
    """Write a commented scenario as a starting point, and the schema for editors.

    Example: escort-mj new mine.yaml --robots 8

    Args:
        file: Scenario file to write, such as mine.yaml.
        robots: Number of robots.
        axes: 2 for the plane, 3 for space.
        law: Law of the inner loop.
    """
    from escort_mj.files import check_place, write_text
    from escort_mj.scenario import json_schema
    from escort_mj.scenario.reader.load import parse_scenario
    from escort_mj.scenario.reader.starter import starter

    path = file if file.suffix in (".yaml", ".yml") or file.is_dir() else file.with_suffix(".yaml")
    check_place(path)
    if path.exists():
        raise UsageError(f"{path}: is there already")
    text = starter(path.stem, robots, axes, law)
    parse_scenario(text, f"escort-mj new {path.name}")
    write_text(path, text)
    written = [path]
    if not (schema := path.parent / "schema.json").exists():
        write_text(schema, json.dumps(json_schema(), indent=2) + "\n")
        written.append(schema)
    line = f"wrote {' '.join(path.name for path in written)}; next: escort-mj run {shown_path(path)}"
    return Answer([line], {"written": [shown_path(path) for path in written]})


@command("export")
def export_command(source: Source, to: Path, overrides: Overrides = (), plugins: Texts = ()) -> Answer:
    """Export the world of a scenario or run as MJCF, or export a run for other programs.

    Example: escort-mj export main main.xml

    Example: escort-mj export renders/main main.csv

    Args:
        source: Run folder, scenario file, or name of a shipped scenario.
        to: FILE.xml: the world as MJCF. For a run, also FILE.csv or FILE.parquet: a table; FILE.npz: MuJoCo
            states.
    """
    from escort_mj import api
    from escort_mj.files import write_model
    from escort_mj.record.folder import read_run
    from escort_mj.report.exports import MJCF, check_export, export_run

    check_export(to)
    if os.path.isdir(source):
        if overrides:
            raise UsageError("--set changes a scenario; a run folder is what it is")
        export_run(read_run(source), to)
    elif to.suffix != MJCF:
        raise UsageError(f"{source}: not a run folder; only runs can be exported as {to.suffix}")
    else:
        from escort_mj.world.model.build import build

        world = build(api.load_scenario(source, overrides, plugins))
        write_model(to, world.xml, world.assets)
    return Answer([f"wrote {shown_path(to)}"], {"written": [shown_path(to)]})


@command("gains")
def gains_command(scenario: ScenarioName, overrides: Overrides = (), plugins: Texts = ()) -> Answer:
    """Propose gains for the scenario's laws and robots, as `controller: {gains: auto}` computes them.

    Example: escort-mj gains robots/quadrotor

    Example: escort-mj gains main --set controller=asmc --set robots.actuators.lag=0.05
    """
    from escort_mj import api
    from escort_mj.scenario.geometry.team_gains import owners

    mission = api.load_scenario(scenario, overrides, plugins)
    lines: list[str] = []
    told: dict[str, Any] = {}
    for owner in owners(mission):
        more, facts = _proposed(scenario, mission, owner)
        if not owner:
            lines, told = more, facts
            continue
        key, number = str(owner[0]), int(owner[-1])
        if key == "teams":
            what, name = "team", mission.teams[number].name
        else:
            what, name = "robot", str(mission.robots.overrides[number].robot)
        lines += [f"{what} {name}", *(f"  {line}" for line in more)]
        told[key] = told.get(key, {}) | {name: facts}
    return Answer(lines, told)


def _proposed(
    scenario: str, mission: Scenario, owner: tuple[str | int, ...]
) -> tuple[list[str], dict[str, Any]]:
    """Return gains of an owner's law: lines for people, and numbers."""
    from escort_mj.laws.gains import LAWS_WITH_A_RULE
    from escort_mj.record.tables import aligned
    from escort_mj.scenario.geometry.team_gains import law_of, proposal

    law, found = law_of(mission, owner), proposal(mission, owner)
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


@command("check-plugin")
def check_plugin_command(plugin: str) -> Answer:
    """Test the components of a plugin: laws, behaviors, disturbances, robots, metrics and more.

    Exit codes: 0 if all tests pass, 1 if a test fails or the plugin crashes the process, 2 if the plugin
    cannot be loaded.

    Example: escort-mj check-plugin own_law.py

    Args:
        plugin: Python file, or name of an installed plugin.
    """
    from escort_mj.conformance.apart import check_apart

    checks = []
    for found in check_apart(plugin):
        checks.append(found)  # told at once: a mission takes its time to compile
        if found.held and OUTPUT.quiet:
            continue
        tell(f"  {'ok' if found.held else 'NO'}  {found.member}  {found.name:20s} {found.words}")
    code = GOOD if all(found.held for found in checks) else VERDICT_FAILED
    return Answer([], {"checks": [found._asdict() for found in checks]}, code)


@command("check-robot")
def check_robot_command(
    robot: Path,
    body: str | None = None,
    drive: str | None = None,
    root: Path | None = None,
    figure: Path | None = None,
) -> Answer:
    """Show what the program finds in a robot's MJCF, and its response to a velocity step along each axis.

    Exit codes: 0 if the robot comes within 5 % of each step and overshoots by less than 30 %, 1 if not, 2 if
    the robot cannot be read or driven.

    Example: escort-mj check-robot rover.xml --figure rover.png

    Args:
        robot: MJCF file of a robot.
        body: Body that the law moves; None for the only one that can move.
        drive: Drive: force, thrust, steer, wheels, omni or velocity; None for what is found from the model.
        root: Folder that all files of the robot lie in or below; None for that of the MJCF file.
        figure: File for the step response: .png, .pdf or .svg.
    """
    from escort_mj.conformance.robot import answers, checked_model, model_page
    from escort_mj.files import check_place
    from escort_mj.report.figures.drawing.look import FORMATS

    if figure is not None:
        check_place(figure, [f".{name}" for name in FORMATS])
    kind, model = checked_model(robot, body, drive, root)
    for line in model_page(kind, model):
        tell(line)
    steps = []
    for answer in answers(kind, model):
        steps.append(answer)  # told at once: a step takes its time
        tell(f"{'ok' if answer.held else 'NO'}  {answer.words}")
    written = []
    if figure is not None:
        from escort_mj.report.figures.answer import Step, draw_steps

        draw_steps([Step(*answer[:4]) for answer in steps], f"{robot.name}: steps of velocity", figure)
        written = [shown_path(figure)]
    lines = [f"wrote {each}" for each in written]
    code = GOOD if all(answer.held for answer in steps) else VERDICT_FAILED
    numbers = {answer.axis: answer.numbers for answer in steps}
    return Answer(lines, {"robot": model_page(kind, model), "steps": numbers, "written": written}, code)


@command("doctor", flags={"folder": "--out"})
def doctor_command(folder: Path = Path("renders")) -> Answer:
    """Check whether runs, figures and videos work on this machine, and suggest fixes.

    The exit code is 1 if runs do not work.

    Example: escort-mj doctor

    Args:
        folder: Folder for the runs.
    """
    from escort_mj.cli.doctor import BAD, examine_machine

    marks: dict[Literal["good", "warning", "bad"], str] = {"good": "ok", "warning": "--", "bad": "NO"}
    findings = list(examine_machine(folder))
    lines = []
    for finding in findings:
        lines.append(f"  {marks[finding.state]}  {finding.check:10s} {finding.found}")
        lines += [f"      {'':10s} {finding.advice}"] if finding.advice else []
    code = VERDICT_FAILED if any(finding.state == BAD for finding in findings) else GOOD
    return Answer(lines, {"findings": [finding._asdict() for finding in findings]}, code)
