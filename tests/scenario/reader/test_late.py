"""Runs that an override made shorter: what they do not reach is not judged, or left out."""

import pytest

from escort_mj.errors import ScenarioError
from escort_mj.expect.verdicts import judge_one, mark
from escort_mj.record.outcome import Outcome
from escort_mj.scenario import Scenario, dump_scenario, parse_scenario
from tests.synthetic import make_trace

TEXT = """\
duration: 60
robots: {count: 4, failures: [{robot: 1, at: 30}, {robot: 2, at: 2}]}
mission:
  supervisor: [{name: early, after: 1, behaviors: [surface]}, {name: late, after: 40, behaviors: [surface]}]
expect:
  - {contacts: none}
  - {metric: radius_error_mean, at_most: 0.1, after: 55}
  - {clearance: [robots, target], at_least: 0.1, before: 20}
  - {settled: 0.1, by: 50}
"""


def notes(scenario: Scenario) -> list[str | None]:
    return [one.skip for one in scenario.expect]


def shortened(*overrides: str) -> Scenario:
    return parse_scenario(TEXT, "file.yaml", overrides)


def test_windows_beyond_a_shortened_run_are_not_judged() -> None:
    end = "s, the run ends at 3 s"
    wanted = [
        None,
        f"its window begins at 55 {end}",
        f"its window ends at 20 {end}",
        f"its window begins at 50 {end}",
    ]
    scenario = shortened("duration=3")
    assert notes(scenario) == wanted
    assert parse_scenario(TEXT, "f", {"duration": 3}) == parse_scenario(TEXT).replace(duration=3) == scenario
    assert parse_scenario(dump_scenario(scenario)) == scenario, "as a run folder keeps it"


def test_phases_and_failures_beyond_it_are_left_out() -> None:
    scenario = shortened("duration=3")
    assert [phase.name for phase in scenario.mission.supervisor] == ["early"]
    assert [failure.robot for failure in scenario.robots.failures] == [2]


def test_demands_of_teams_and_the_start_of_the_video_are_left_out() -> None:
    demand, target = "{robots: 1}, {after: 9, robots: 2}", "{name: van, position: [0, 0]}"
    team = f"{{name: one, robots: [1, 2], demand: [{demand}], targets: [{target}]}}"
    text = f"duration: 60\ntarget: null\nrobots: {{count: 2}}\nteams: [{team}]\nvideo: {{start: 5}}\n"
    scenario = parse_scenario(text, "file.yaml", ("duration=3",))
    assert [demand.robots for demand in scenario.teams[0].demand] == [1]
    assert scenario.video.start is None


def test_a_longer_run_is_judged_again() -> None:
    scenario = shortened("duration=3").replace(duration=60)
    assert notes(scenario) == [None] * 4
    own = parse_scenario(TEXT.replace("contacts: none", "contacts: none, skip: of my own")).replace(
        duration=3
    )
    assert own.replace(duration=60).expect[0].skip == "of my own"


@pytest.mark.parametrize(
    ("text", "overrides"),
    [
        (TEXT.replace("duration: 60", "duration: 3"), ()),
        (TEXT, ("duration=3", "expect[1].after=30")),
        (TEXT, ("expect[1].after=70",)),
    ],
)
def test_where_both_are_written_or_both_are_set_it_is_an_error(text: str, overrides: tuple[str, ...]) -> None:
    with pytest.raises(ScenarioError, match=r"expect\[1\].after: found .* s; the run ends at"):
        parse_scenario(text, "file.yaml", overrides)


def test_other_faults_are_told_beside_it() -> None:
    with pytest.raises(ScenarioError) as caught:
        shortened("duration=3", "robots.mass=-1")
    assert [fault.key for fault in caught.value.faults] == ["robots.mass"]


def test_what_is_not_judged_passes_and_says_why() -> None:
    verdict = judge_one(shortened("duration=3").expect[1], make_trace([0.0, 3.0]), Outcome.COMPLETED, 1)
    assert verdict.passed and mark(verdict) == "skip" and verdict.value is None
    assert verdict.found == "not judged: its window begins at 55 s, the run ends at 3 s"
    assert verdict.message == f"radius_error_mean at most 0.1 m after 55 s: {verdict.found}"
