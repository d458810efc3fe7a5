"""Designs: every cell once, the same seeds for all, keys that tell runs apart and nothing else."""

from pathlib import Path

import numpy as np
import pytest

from escort_mj.api import scenarios_folder
from escort_mj.scenario.reader.document import read_document
from escort_mj.study.sweeps.definition import cells_of, load_study
from escort_mj.study.sweeps.design import Design


def design(
    folder: Path, text: str, head: str = "study: s\nscenario: main\nset: {duration: 2, expect: []}\n"
) -> Design:
    path = folder / "study.yaml"
    path.write_text(head + text)
    return Design(load_study(path), scenarios_folder())


def test_every_combination_once(tmp_path: Path) -> None:
    laid_out = design(
        tmp_path,
        "cases: {a: {robots.mass: 2}, b: {}}\n"
        "vary: {controller: [apd_smc, pd], robots.force_limit: {low: 5, high: 20, count: 3, scale: log}}\n"
        "seeds: 2\n",
    )
    assert laid_out.factors == ["case", "controller", "robots.force_limit"]
    labels = [tuple(cell.labels.values()) for cell in laid_out.cells]
    assert len(set(labels)) == len(labels) == 12
    assert sorted({limit for _, _, limit in labels}) == pytest.approx([5, 10, 20])
    scenario = laid_out.scenario(laid_out.cells[0], 7)
    assert (scenario.seed, scenario.robots.mass, scenario.duration) == (7, 2, 2)
    runs = list(laid_out.runs())
    assert len(runs) == len(laid_out) == 24
    assert [run.seed for run in runs] == [1] * 12 + [2] * 12  # the scenario's own seed is the first
    assert len({run.key for run in runs}) == 24


def test_a_study_without_anything_varied_has_one_cell(tmp_path: Path) -> None:
    laid_out = design(tmp_path, "seeds: 3\n")
    assert [cell.labels for cell in laid_out.cells] == [{}]
    assert len(laid_out) == 3


def test_keys_depend_on_what_a_run_depends_on(tmp_path: Path) -> None:
    one = design(tmp_path, "vary: {robots.mass: [1, 2]}\n")
    more = design(tmp_path, "vary: {robots.mass: [2, 3]}\nseeds: 2\ntraces: all\ndescription: other words\n")
    keys = {(one.cells[run.cell].settings["robots.mass"], run.seed): run.key for run in one.runs()}
    others = {(more.cells[run.cell].settings["robots.mass"], run.seed): run.key for run in more.runs()}
    assert keys[2, 1] == others[2, 1]  # a changed study makes only what is new
    assert len({*keys.values(), *others.values()}) == 5
    changed = design(
        tmp_path, "vary: {robots.mass: [2]}\n", "study: s\nscenario: main\nset: {duration: 3, expect: []}\n"
    )
    assert next(changed.runs()).key != keys[2, 1]


@pytest.mark.parametrize("method", ["sobol", "latin_hypercube", "random"])
def test_points_fill_their_box(tmp_path: Path, method: str) -> None:
    text = (
        f"sample: {{method: {method}, count: 32, seed: 3, over: {{"
        "robots.mass: {low: 0.1, high: 10, scale: log}, "
        "robots.count: {low: 3, high: 6, whole: true}, mission.radius: {low: 4, high: 6}}}\n"
    )
    points = [cell.settings for cell in design(tmp_path, text).cells]
    assert points == [cell.settings for cell in design(tmp_path, text).cells]
    keys = ("robots.mass", "robots.count", "mission.radius")
    mass, count, radius = (np.array([point[key] for point in points]) for key in keys)
    assert {*count} == {3, 4, 5, 6}
    assert all(isinstance(point["robots.count"], int) for point in points)
    assert (mass >= 0.1).all() and (mass <= 10).all() and (radius >= 4).all() and (radius <= 6).all()
    assert 0.3 < (mass < 1.0).mean() < 0.7  # half of a logarithmic range lies below its geometric mean
    if method == "latin_hypercube":  # one point in each part
        assert sorted(np.floor((radius - 4) / 2 * 32)) == list(range(32))


def test_points_that_are_not_paired_have_values_and_seeds_of_their_own(tmp_path: Path) -> None:
    """Lists are drawn like ranges, parameters fill drawn tables, and what a case sets is not drawn for it."""
    text = (
        "parameters: {away: 0}\n"
        "cases: {free: {}, pd: {controller: pd}}\n"
        "sample: {count: 20, paired: false, method: random, over: {away: [8, 9],\n"
        "  controller: [asmc, apd_smc], obstacles: [[], [{position: ['{away}', 0]}]],\n"
        "  robots.mass: {low: 1, high: 2}}}\n"
        "seeds: 2\n"
    )
    laid_out = design(tmp_path, text)
    free, fixed = laid_out.cells[:20], laid_out.cells[20:]
    assert len({cell.settings["robots.mass"] for cell in laid_out.cells}) == 40
    assert {cell.settings["controller"] for cell in free} == {"asmc", "apd_smc"}
    assert {(cell.labels["controller"], cell.settings["controller"]) for cell in fixed} == {("pd", "pd")}
    placed = {str(cell.settings["obstacles"]) for cell in laid_out.cells}
    assert placed == {"()", "({'position': (8, 0)},)", "({'position': (9, 0)},)"}
    assert len({run.seed for run in laid_out.runs()}) == len(laid_out) == 80
    paired = design(tmp_path, text.replace("paired: false, ", ""))
    assert len({cell.settings["robots.mass"] for cell in paired.cells}) == 20
    assert {run.seed for run in paired.runs()} == {1, 2}


@pytest.mark.slow
def test_the_safety_study_draws_what_it_says() -> None:
    """A mission of each case is possible; together they have 2 to 60 robots, plane and space, most kinds."""
    path = scenarios_folder() / "studies" / "safety.yaml"
    whole = load_study(path).study
    assert cells_of(whole) >= 2000 and not whole.sample.paired
    counts = whole.sample.over["robots.count"]
    assert (min(counts), max(counts)) == (2, 60)
    data = read_document(path.read_text(), str(path)).data
    data["sample"]["count"] = 1
    laid_out = Design(load_study(data), scenarios_folder())
    flown = [
        laid_out.scenario(cell, run.seed) for cell, run in zip(laid_out.cells, laid_out.runs(), strict=True)
    ]
    assert {scenario.axes for scenario in flown} == {2, 3}
    assert len({scenario.robots.kind.kind for scenario in flown}) == 7
    assert all(scenario.mission.outer.loop == "set_based" for scenario in flown)
    shapes = {obstacle.shape for scenario in flown for obstacle in scenario.obstacles}
    assert shapes == {"sphere", "box", "cylinder", "capsule", "ellipsoid", "mesh"}


def test_a_scenario_beside_the_study_comes_first(tmp_path: Path) -> None:
    (tmp_path / "own.yaml").write_text("name: own\nduration: 1\n")
    laid_out = design(tmp_path, "", "study: s\nscenario: own.yaml\n")
    assert laid_out.scenario(laid_out.cells[0]).name == "own"


def test_keys_depend_on_the_code(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In a checkout code changes without a new version: runs of other code are other runs."""
    laid_out = design(tmp_path, "")
    before = next(laid_out.runs()).key
    assert next(laid_out.runs()).key == before
    monkeypatch.setattr("escort_mj.study.sweeps.design.sources_digest", lambda: "another")
    assert next(laid_out.runs()).key != before
