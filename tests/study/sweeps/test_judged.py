"""What a study expects of its cells: rules, answers by level, and the paper's claims as such."""

import json
import math
from pathlib import Path
from typing import Any

import pytest

import escort_mj
from escort_mj.api import scenarios_folder
from escort_mj.scenario import load_file
from escort_mj.study.engine.store import Row
from escort_mj.study.sweeps.definition import load_study
from escort_mj.study.sweeps.design import Design, word
from escort_mj.study.sweeps.judged import Answer, Judged, judge_cells, judged_lines, rows_of
from escort_mj.study.sweeps.results import Results, record_of

PAPER = scenarios_folder() / "studies" / "paper.yaml"
FAST: dict[str, Any] = {"than": {"law": "b"}, "quantities": ["settling_time", "tracking_time"]}
STUDY: dict[str, Any] = {
    "study": "laws",
    "cases": {"plane": {"scenario": "main"}, "space": {"scenario": "main_3d", "duration": 20}},
    "vary": {
        "law": {"a": {"controller": "apd_smc"}, "b": {"controller": "asmc", "robots.mass": 2}},
        "limit": {"none": {"robots.force_limit": None}, "some": {"robots.force_limit": 40}},
    },
    "apart": "limit",
}


def design_of(**more: Any) -> Design:
    return Design(load_study(STUDY | more), scenarios_folder())


def judged(claim: dict[str, Any], values: Any, missing: int = 0, apart: str = "limit") -> Judged:
    """A claim judged on runs with these metrics, by case, law and limit; None for one that diverged."""
    design = design_of(expect=[{"claim": "it holds"} | claim], apart=apart)
    rows = {}
    for run in list(design.runs())[missing:]:
        cell = design.cells[run.cell]
        found = values(*cell.labels.values())
        outcome, told = ("diverged", {}) if found is None else ("completed", found)
        table = run.key, run.seed, cell.settings, outcome, "far away", found is not None
        rows[run.key] = Row(*table, 1.0, 1.0, [], "", {}, told)
    return judge_cells(Results(record_of(design), rows))[0]


def test_cases_name_their_own_scenarios_and_alternatives_what_they_set() -> None:
    design = design_of()
    assert len(design) == 8 and list(design.templates) == ["main", "main_3d"]
    last = design.scenario(design.cells[-1])
    assert (last.axes, last.duration, last.controller.law, last.robots.mass) == (3, 20.0, "asmc", 2.0)
    assert last.robots.force_limit == 40.0
    assert design.cells[-1].labels == {"case": "space", "law": "b", "limit": "some"}
    assert len({run.key for run in design.runs()}) == 8
    plane = load_file(scenarios_folder() / "main.yaml", {"controller": "apd_smc", "robots.force_limit": None})
    assert design.scenario(design.cells[0]) == plane


def test_better_is_one_better_and_none_worse() -> None:
    claim = {"where": {"case": "plane", "law": "a"}, "better": FAST}

    def law(ours: tuple[float, float], theirs: tuple[float, float] | None) -> bool | None:
        def of(case: str, law: str, limit: str) -> Any:
            pair = ours if law == "a" else theirs
            return None if pair is None else dict(zip(FAST["quantities"], pair, strict=True))

        return judged(claim, of).answers["some"].holds

    assert not law((5.0, 1.0), (5.0, 1.0))
    assert not law((4.9, 1.0), (5.0, 1.0))  # within 5 %
    assert law((4.0, 1.0), (5.0, 1.0))
    assert law((4.0, 1.04), (5.0, 1.0))
    assert not law((4.0, 1.06), (5.0, 1.0))
    assert law((5.0, 1.0), (math.inf, 1.0))
    assert not law((math.inf, 1.0), (math.inf, 1.0))
    assert law((5.0, 1.0), None)


def test_more_is_better_where_a_metric_says_so() -> None:
    better = {"than": {"law": "b"}, "quantities": ["obstacle_distance_min"], "by": 0.1}
    claim = {"where": {"law": "a"}, "better": better}
    found = judged(claim, lambda case, law, limit: {"obstacle_distance_min": 2.0 if law == "a" else 1.5})
    assert found.holds == "yes"
    found = judged(claim, lambda case, law, limit: {"obstacle_distance_min": 1.5 if law == "a" else 2.0})
    assert found.holds == "no"
    assert "obstacle distance, min in 0" in found.answers["some"].measured


def test_bounds_hold_in_every_cell_and_answers_are_told_apart() -> None:
    claim = {"bounds": [{"metric": "contacts", "at_most": 0}], "where": {"law": "a"}}
    touch = lambda case, law, limit: {"contacts": float(case == "space" and limit == "some")}  # noqa: E731
    found = judged(claim, touch)
    assert found.rule == "contacts at most 0"
    assert found.holds == "not in: some"
    assert found.answers["some"] == Answer(False, "in 1 of 2 cells; not in space")
    assert judged(claim, touch, apart="").holds == "no"
    assert judged_lines([found]) == ["  not in: some it holds"]
    head, rows = rows_of([found])
    assert head[-2:] == ["none", "some"] and rows[0][-1] == "no: in 1 of 2 cells; not in space"


def test_a_claim_without_a_bound_is_that_runs_complete() -> None:
    found = judged({"where": {"limit": "some"}}, lambda case, law, limit: {} if law == "a" else None)
    assert found.rule == "every run completes"
    assert found.answers["none"] == Answer(None, "says nothing of it")
    assert found.answers["some"] == Answer(False, "in 2 of 4 cells; not in plane, b; space, b")
    assert judged({}, lambda *_: {}, missing=8).holds == "undecided"
    part = judged({"where": {"law": "a"}}, lambda *_: {}, missing=1)
    assert part.answers["some"].holds and part.holds == "undecided"
    one = judged({"where": {"case": "plane", "law": "b"}}, lambda *_: None)
    assert one.answers["some"] == Answer(False, "plane, b diverged: far away")


@pytest.mark.slow
def test_kept_runs_are_drawn_side_by_side_and_claims_written(tmp_path: Path, compiled: None) -> None:
    study = STUDY | {
        "cases": {"plane": {"scenario": "paper/case1_2d", "duration": 1}},
        "set": {"expect": []},
        "traces": "all",
        "expect": [{"claim": "nothing touches", "bounds": [{"metric": "contacts", "at_most": 0}]}],
        "figures": [{"name": "side by side", "draw": "paths", "where": {"law": "a"}}],
    }
    swept = escort_mj.sweep(study, tmp_path, workers=1, progress=False)
    assert swept.passed and swept.lines[1:] == ["  yes       nothing touches"]
    swept.report()
    assert (tmp_path / "figures" / "side_by_side.svg").stat().st_size > 10_000
    claims = json.loads((tmp_path / "expect.json").read_text())["claims"]
    assert [one["holds"] for one in claims] == ["yes"]
    never = [{"claim": "it is heavy", "bounds": [{"metric": "force_rms", "at_least": 1e6}]}]
    failed = escort_mj.sweep(study | {"expect": never}, tmp_path, workers=1, progress=False)
    assert not failed.passed and failed.lines[1:] == ["  no        it is heavy"]
    page = (tmp_path / "report.html").read_text()
    assert "nothing touches" in page and "side_by_side" in page + str([*(tmp_path / "figures").iterdir()])


@pytest.fixture(scope="module")
def paper() -> Design:
    return Design(load_study(PAPER), scenarios_folder())


def test_the_paper_is_every_case_law_and_reading(paper: Design) -> None:
    assert len(paper) == 9 * 3 * 3
    shipped = {f"paper/{path.stem}" for path in (scenarios_folder() / "paper").glob("*.yaml")}
    assert set(paper.templates) == shipped
    assert [one.name for one in paper.study.figures] == [f"fig{number:02d}" for number in range(5, 18)]


def test_only_law_and_reading_differ_from_the_papers_scenarios(paper: Design) -> None:
    for cell in paper.cells:
        ours: Any = paper.scenario(cell)
        theirs: Any = load_file(scenarios_folder() / f"{cell.scenario}.yaml")
        _, law, reading = (word(label) for label in cell.labels.values())
        assert ours.controller.law == law.lower().replace("-", "_")
        assert ours.controller.anti_windup is (reading == "10 N limit, anti-windup")
        assert ours.robots.force_limit == (None if "no force limit" in reading else 10.0)
        assert ours.controller.slope == theirs.controller.slope == 20
        if law == "ASMC":
            assert ours.controller.switching_gain == 80
        else:
            assert ours.controller.switching_gain == 1
            for gain in ("proportional_gain", "derivative_gain"):
                assert getattr(ours.controller, gain) == getattr(theirs.controller, gain)
        changed = {"controller", "robots", "mission", "expect", "duration"}
        assert ours.model_dump(exclude=changed) == theirs.model_dump(exclude=changed)
        assert ours.duration == theirs.duration or "before" in str(cell.labels["case"])
        mine, others = ours.mission.behaviors, theirs.mission.behaviors
        assert mine[1:] == others[1:] and mine[0].gain == ("consistent" if "anti" in reading else "printed")
        assert mine[0].model_copy(update={"gain": None}) == others[0].model_copy(update={"gain": None})
        same = {"force_limit"}
        assert ours.robots.model_dump(exclude=same) == theirs.robots.model_dump(exclude=same)


def test_equal_negative_medians_are_not_better_than_each_other() -> None:
    found = judged(
        {
            "where": {"law": "a"},
            "better": {"than": {"law": "b"}, "quantities": ["settling_time", "hull_margin"]},
        },
        lambda case, law, limit: {"settling_time": 1.0 + (law == "b"), "hull_margin": -3.0},
    )
    assert all(answer.holds for answer in found.answers.values())
