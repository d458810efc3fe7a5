"""Falsifying: it finds a planted failure, shrinks it to what matters, and finds it again from its store."""

from pathlib import Path

import pytest

from escort_mj.errors import ScenarioError
from escort_mj.mission import fly
from escort_mj.scenario import load_file
from escort_mj.study.engine.backends import here
from escort_mj.study.search.falsify import falsification_lines, falsify_design
from escort_mj.study.sweeps.design import Design
from tests.study import planted

STUDY = """
study: planted
scenario: one.yaml
parameters: {push: 0.5}
set: {uncertainty.disturbance: ["{push}", 0]}
falsify:
  over:
    push: {low: 0, high: 20}
    robots.mass: {low: 0.5, high: 2}
    sensing.position.noise: {low: 0, high: 0.01}
    robots.positions[0][1]: {low: -1, high: 1}
  runs: 60
"""
# A motor of 10 N cannot hold a robot against a push of more.
SCENARIO = """
name: one
duration: 2
robots: {positions: [[5, 0]], force_limit: 10}
expect: [{metric: radius_error_max, at_most: 1}]
"""


def design(folder: Path, text: str = STUDY) -> Design:
    return planted.design(folder, text, SCENARIO)


@pytest.mark.slow_cases("cmaes")
@pytest.mark.parametrize("method", ["cmaes", pytest.param("random", marks=pytest.mark.slow)])
def test_a_planted_failure_is_found_and_shrunk(tmp_path, compiled, method):
    laid_out = design(tmp_path, STUDY + f"  method: {method}\n")
    found = falsify_design(laid_out, tmp_path / "out", here)
    assert found.until_first is not None and found.until_first <= found.runs <= 60 + 8
    (one,) = found.counterexamples
    assert list(one.point) == ["push"] and 10.0 < one.point["push"] < 14.0
    assert one.base == {"push": 0.5} and set(one.found) == set(laid_out.study.falsify.over)
    run = fly(load_file(one.scenario))
    assert not run.passed and run.scenario.name == "planted_1"
    assert one.scenario.read_text().splitlines()[1] == (
        f"# push: {one.point['push']:g}; without the search 0.5"
    )
    assert (one.folder / "verdicts.json").is_file()
    assert "radius_error_max at most 1 m" in falsification_lines(found)[0]
    again = falsify_design(laid_out, tmp_path / "out", here)
    assert again.made == 0 and again.counterexamples == found.counterexamples
    assert (again.runs, again.until_first) == (found.runs, found.until_first)


def test_nothing_to_be_found_is_said_with_the_nearest_point(tmp_path, compiled):
    text = STUDY.replace("high: 20", "high: 1").replace("runs: 60", "runs: 16")
    found = falsify_design(design(tmp_path, text), tmp_path / "out", here)
    assert found.counterexamples == () and found.until_first is None and found.runs >= 16
    assert 0.0 < found.least[0] < 1.0
    assert falsification_lines(found)[0].startswith(
        f"nothing found in {found.points} points, {found.runs} runs; least"
    )


def test_a_scenario_that_fails_as_it_stands_needs_no_search(tmp_path, compiled):
    found = falsify_design(design(tmp_path, STUDY.replace("push: 0.5", "push: 30")), tmp_path / "out", here)
    assert found.until_first == 1 and found.points == 1
    assert found.counterexamples[0].point == {}
    assert falsification_lines(found)[1] == "  as the study stands, without anything moved"


def test_without_a_section_there_is_nothing_to_falsify(tmp_path):
    with pytest.raises(ScenarioError, match="2:8: study: has no section falsify"):
        falsify_design(design(tmp_path, STUDY[: STUDY.index("falsify:")]), tmp_path / "out", here)


def test_bounds_where_nothing_is_possible_are_said(tmp_path):
    text = STUDY.replace("[0][1]: {low: -1, high: 1}", "[0][0]: {low: -0.1, high: 0.1}")
    with pytest.raises(ScenarioError, match=r"points are impossible; narrow the bounds"):
        falsify_design(design(tmp_path, text), tmp_path / "out", here)
