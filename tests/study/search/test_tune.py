"""Tuning: it betters what can be bettered, keeps constraints, and does the same again from its store."""

import csv
import math
from pathlib import Path

import pytest

from escort_mj.errors import ScenarioError, UsageError
from escort_mj.mission import fly
from escort_mj.report.figures.studies.tuning import draw_tuning
from escort_mj.scenario import load_file
from escort_mj.study.engine.backends import here
from escort_mj.study.engine.store import Row
from escort_mj.study.search.evaluate import base_of
from escort_mj.study.search.tune import _gain, tune_design
from escort_mj.study.search.tuned import tuning_lines
from escort_mj.study.sweeps.design import Design
from tests.study import planted

SCENARIO = """
name: one
duration: 1.5
robots: {positions: [[5, 0], [-5, 1]]}
sensing: {position: {noise: 0.01}}
controller: {law: pd, proportional_gain: 2, derivative_gain: 4}
expect: [{metric: tracking_error_rms, at_most: 5}]
"""
STUDY = """
study: gains
scenario: one.yaml
seeds: 2
tune:
  over:
    controller.proportional_gain: {low: 1, high: 200, scale: log}
    controller.derivative_gain: {low: 1, high: 200, scale: log}
  objectives: [{metric: tracking_error_rms}]
  trials: 12
  held_out: 6
"""


def design(folder: Path, text: str = STUDY) -> Design:
    return planted.design(folder, text, SCENARIO)


def trials(folder: Path) -> list[dict[str, str]]:
    with (folder / "trials.csv").open() as file:
        return list(csv.DictReader(file))


def test_one_objective(tmp_path, compiled):
    laid_out, out = design(tmp_path), tmp_path / "out"
    found = tune_design(laid_out, out, here)
    assert len(found.trials) == 12 and found.runs == 2 + 2 * 12 + 12
    assert found.trials[0].values == found.own.values
    assert found.best.values[0] == min(t.values[0] for t in found.trials if t.feasible) < found.own.values[0]
    gain = found.gains["tracking_error_rms"]
    assert gain.pairs == gain.better == 6 and gain.change < -0.3
    assert gain.low <= gain.change <= gain.high < 0.0
    run = fly(load_file(out / "best.yaml"))
    assert run.scenario.controller.proportional_gain == found.best.point["controller.proportional_gain"]
    assert run.passed and run.scenario.name == "best"
    table = trials(out)
    assert len(table) == 13 and table[0]["controller.proportional_gain [N/m]"] == ""
    assert table[1]["tracking_error_rms [m]"] == str(found.trials[0].values[0])
    assert [row["trial"] for row in table if row["front"] == "True"] == [str(found.front[0] + 1)]
    said = "\n".join(
        tuning_lines(found, laid_out.study.tune, {key: base_of(laid_out, key) for key in found.best.point})
    )
    assert (
        "12 trials, 38 runs; " in said and "(the scenario's own: 2)" in said and "smaller in 6 of 6" in said
    )

    again = tune_design(laid_out, out, here)
    assert again.made == 0 and again.trials == found.trials and again.gains == found.gains
    longer = tune_design(design(tmp_path, STUDY.replace("trials: 12", "trials: 16")), out, here)
    assert longer.trials[:12] == found.trials and longer.made > 0
    (picture,) = draw_tuning(out, laid_out.study.tune, found)
    assert picture.stat().st_size > 10_000


@pytest.mark.slow
def test_constraints_bind(tmp_path, compiled):
    bounds = "  bounds: [{metric: force_rms, at_most_own: 1}, {metric: chattering, at_most: 150}]\n"
    text = STUDY.replace("trials: 12", "trials: 20") + bounds
    found = tune_design(design(tmp_path, text), tmp_path / "out", here)
    free = [t for t in found.trials if t.values[0] < found.best.values[0]]
    assert free, "without the bounds there would be better ones"
    assert all(
        t.bounded["force_rms"] > found.own.bounded["force_rms"] or t.bounded["chattering"] > 150 for t in free
    )
    assert found.best.bounded["force_rms"] <= found.own.bounded["force_rms"]
    assert set(found.own.violations) == {
        "verdicts",
        "force_rms at most 1 times its own",
        "chattering at most 150",
    }


@pytest.mark.slow
def test_several_objectives_have_a_front(tmp_path, compiled):
    text = STUDY.replace("trials: 12", "trials: 20").replace("rms}]", "rms}, {metric: chattering}]")
    laid_out = design(tmp_path, text)
    found = tune_design(laid_out, tmp_path / "out", here)
    front = [found.trials[place].values for place in found.front]
    assert len(front) > 2 and front == sorted(front)
    assert [b for _, b in front] == sorted((b for _, b in front), reverse=True)
    for trial in found.trials:
        assert any(a <= trial.values[0] and b <= trial.values[1] for a, b in front)
    names = {path.name for path in draw_tuning(tmp_path / "out", laid_out.study.tune, found)}
    assert names == {"history.png", "front.png"}


def test_a_gain_with_its_interval():
    def rows(values):
        return [Row("", 0, {}, "completed", "", True, 1.0, 0.0, [], "", {}, {"x": v}) for v in values]

    own, tuned = [2.0, 4.0, math.inf, 3.0, None], [1.0, 2.0, 1.0, 1.5, 1.0]
    gain = _gain(rows(own), rows(tuned), "x")
    assert gain is not None
    assert gain[:5] == (3.0, 1.5, -0.5, -0.5, -0.5)  # half in every pair: nothing to be uncertain of
    assert gain[5:] == (4, 4, (1, 0))  # never is larger than 1
    assert _gain(rows([None]), rows([1.0]), "x") is None


def test_nothing_that_keeps_the_constraints_is_said(tmp_path, compiled):
    text = STUDY.replace("trials: 12", "trials: 4") + "  bounds: [{metric: force_rms, at_most: 1.0e-6}]\n"
    with pytest.raises(UsageError, match=r"none of 4 trials keeps every constraint; .*trials\.csv says"):
        tune_design(design(tmp_path, text), tmp_path / "out", here)
    assert len(trials(tmp_path / "out")) == 5


def test_without_a_section_there_is_nothing_to_tune(tmp_path):
    with pytest.raises(ScenarioError, match="2:8: study: has no section tune"):
        tune_design(design(tmp_path, STUDY[: STUDY.index("tune:")]), tmp_path / "out", here)
