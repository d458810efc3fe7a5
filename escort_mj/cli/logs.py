"""The command for logs of real robots: judge."""

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path
from typing import Any

from escort_mj.cli.app import (
    GOOD,
    VERDICT_FAILED,
    Answer,
    command,
    drawing_figures,
    progress_bar,
)
from escort_mj.cli.options import Either, ScenarioName, Texts
from escort_mj.cli.runs import draw, exit_code, judged, run_folder_of, wrote
from escort_mj.errors import UsageError


@command("judge", like="api.judge", flags={"scenario": "--scenario", "names": "--map BODY=NAME"})
def judge_command(
    log: Path,
    scenario: ScenarioName,
    names: Texts = (),
    out: Path | None = None,
    video: Either = False,
    report: Either = False,
    strict: Either = False,
    **given: Any,
) -> Answer:
    """Judge a log of real robots against a scenario, and write the result as a run folder.

    Verdicts on quantities that the log does not contain neither pass nor fail; if nothing that the scenario
    expects besides `outcome` can be judged, the log fails.

    Example: escort-mj judge flight.csv --scenario mission.yaml

    Example: escort-mj judge bag_folder --scenario mission.yaml --map robot_1=/uav3/odom --report

    Args:
        log: Log of real robots: FILE.csv, FILE.parquet, FILE.mcap, or a ROS bag.
        scenario: Scenario file, or name of a shipped scenario, against which the log is judged.
        names: Name of a body in the log, such as robot_1=/uav3/odom or robot_1=uav3; repeatable.
        out: Run folder; None for renders/LOG.
        video: Whether to render the video.
        report: Whether to write report.html with a replay.
        strict: Fail unless every expectation is judged.
    """
    from escort_mj import api
    from escort_mj.expect.verdicts import verdict_lines
    from escort_mj.judging.judge import judge_log
    from escort_mj.mission import save
    from escort_mj.record.recording import gaps_of

    mission = api.load_scenario(scenario, given["overrides"], given["plugins"])
    with progress_bar("judging", " s") as progress:
        result = judge_log(log, mission, _names(names), given["start"], progress)
    with run_folder_of(Path("renders") / log.stem, out, given["overwrite"]) as folder:
        save(folder, result)
    with drawing_figures() if given["figures"] else nullcontext() as draw_figures:
        written = draw(folder.path, draw_figures, video, report)
    known = [verdict for verdict in result.verdicts if not verdict.skip]
    missing = len(result.verdicts) - len(known)
    unasked = {place for place, one in enumerate(mission.expect) if one.skip is not None}
    unknown = [verdict for verdict in result.verdicts if verdict.skip and verdict.expectation not in unasked]
    held = sum(verdict.passed for verdict in known)
    words = f"; {missing} not judged" if missing else ""
    lines = [
        f"{result.scenario.name}: {result.message}",
        *verdict_lines(result.verdicts),
        f"{held} of {len(known)} verdicts passed{words}",
        wrote(folder.path, written),
    ]
    told = {"not_judged": missing, "gaps": gaps_of(result.trace).tolist()}
    code = exit_code(result) or (VERDICT_FAILED if strict and unknown else GOOD)
    return Answer(lines, judged(result, folder.path, written) | told, code)


def _names(pairs: Texts) -> dict[str, str]:
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
