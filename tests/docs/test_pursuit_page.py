"""docs/pursuit.md: robots stop straight dashes up to the ratio of theory, and so says the table."""

import math
import re

import pytest

from benchmarks import escape, stream
from benchmarks.dashes import COUNTS, TEAMS, is_caught
from benchmarks.perimeter import RATIOS, is_breached, lead
from escort_mj.api import scenarios_folder
from escort_mj.study.sweeps.definition import load_study
from escort_mj.study.sweeps.design import Design
from tests.docs.pages import ROOT

PAGE = (ROOT / "docs" / "pursuit.md").read_text(encoding="utf-8")


@pytest.mark.slow_cases("7")
@pytest.mark.parametrize("count", [4, 7, 12])
def test_points_stop_a_dash_up_to_the_ratio_of_theory(compiled: None, count: int) -> None:
    least = 1.0 / math.sin(math.pi / count)
    assert [is_caught(TEAMS["points"], count, share * least) for share in (0.98, 1.02)] == [True, False]


def test_bodies_catch_what_points_miss(compiled: None) -> None:
    ratio = TEAMS["0.3 m"].ratio(6)
    assert [is_caught(TEAMS["0.3 m"], 6, share * ratio) for share in (0.98, 1.02)] == [True, False]
    assert not is_caught(TEAMS["0.3 m, 4 kg, 2 N"], 6, 0.98 * ratio)


def test_the_table_is_within_three_percent_of_theory() -> None:
    rows = re.findall(r"^\| (\d+) \| ([\d.]+) \| ([\d.]+) \(.*$", PAGE, flags=re.MULTILINE)
    assert [int(count) for count, *_ in rows] == list(COUNTS)
    for count, theory, points in rows:
        assert float(theory) == pytest.approx(1.0 / math.sin(math.pi / int(count)), abs=1e-3)
        assert float(points) == pytest.approx(float(theory), rel=0.03)


@pytest.mark.parametrize(("distance", "angle"), [(10.8, 1.2), (9.0, -1.9), (7.0, 0.3)])
def test_the_lead_decides_who_wins_at_the_perimeter(compiled: None, distance: float, angle: float) -> None:
    assert is_breached(distance, angle, 0.7) == (lead(distance, abs(angle), 0.7) > 0.0)


def test_the_perimeter_table_agrees_with_theory() -> None:
    shares = re.findall(r"^\| 0\.\d \|(?: [\d.]+ \|){2} ([\d.]+) \|", PAGE, flags=re.MULTILINE)
    assert len(shares) == len(RATIOS) and min(map(float, shares)) >= 95.0


def test_the_stream_is_stopped_within_three_points_of_theory(compiled: None) -> None:
    rows = re.findall(r"^\| ([\d.]+) \| ([\d.]+) \| ([\d.]+) ± ([\d.]+) \|$", PAGE, flags=re.MULTILINE)
    assert [float(load) for load, *_ in rows] == list(stream.LOADS)
    for load, theory, measured, _ in rows:
        assert float(theory) == pytest.approx(100.0 * stream.closed_form(float(load)), abs=0.1)
        assert float(measured) == pytest.approx(float(theory), abs=3.0)
    assert 0.05 < stream.stopped(2.0, 0) < 0.95


def test_targets_with_a_will_stay_in_the_hull() -> None:
    assert f"| {' | '.join(escape.HEAD)} |" in PAGE
    shares = re.findall(
        r"^\| \d \| [\d.]+ \| (?:voronoi|burst) \| \d+ \(\d+ to (\d+)\) \| \d+ \(\d+ to (\d+)\)",
        PAGE,
        flags=re.MULTILINE,
    )
    assert len(shares) == len(escape.COUNTS) * len(escape.SCENARIOS)
    assert min(int(most) for row in shares for most in row) >= 95, "no interval lies below 95 %"


def test_teams_that_close_in_are_valid() -> None:
    design = Design(load_study(escape.study()), scenarios_folder())
    for cell in design.cells:
        scenario = design.scenario(cell)
        assert str(scenario.robots.count) == cell.labels["robots"]
        assert (scenario.knowledge is None) == (not escape.SEEN[cell.labels["seen"]])


def test_the_search_for_attacks_is_valid() -> None:
    study = load_study(scenarios_folder() / "studies" / "falsify_intruders.yaml")
    (cell,) = Design(study, scenarios_folder()).cells
    assert cell.settings["opponents"][1]["name"] == "second" and study.study.falsify is not None


def test_the_study_of_escapes_is_valid() -> None:
    study = scenarios_folder() / "studies" / "price_of_escape.yaml"
    assert len(Design(load_study(study), scenarios_folder()).cells) == 36
