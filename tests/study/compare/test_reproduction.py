import json
import math
import os
import signal
from pathlib import Path

import pytest

from escort_mj.api import scenarios_folder
from escort_mj.errors import EscortError, UsageError
from escort_mj.record.outcome import Outcome
from escort_mj.scenario import dump_scenario, load_file
from escort_mj.study.compare import runs as study_runs
from escort_mj.study.compare.claims import CLAIMS, PRECISION, SPEED, Conclusion, better, verdict
from escort_mj.study.compare.measured import QUANTITIES, Approach, Measured, measured
from escort_mj.study.compare.reproduce import fly_simulation, measured_before
from escort_mj.study.compare.reproduction import (
    CASES,
    FIGURES,
    LAWS,
    READINGS,
    PaperRun,
    chosen_figures,
    needed,
    paper_scenario,
    simulations,
)
from escort_mj.study.compare.runs import RunJob
from escort_mj.study.compare.table import claims_document, claims_markdown
from escort_mj.study.engine.parallel import side_by_side
from escort_mj.study.sweeps.quantities import value_text


def test_every_case_law_and_reading_is_there_once():
    found = simulations()
    assert len(found) == len(set(found)) == 7 * 3 * 3
    shipped = {path.stem for path in (scenarios_folder() / "paper").glob("*.yaml")}
    assert {simulation.case for simulation in found} == shipped
    assert [figure.key for figure in FIGURES] == [str(number) for number in range(5, 18)] + ["laws"]


@pytest.mark.parametrize("simulation", simulations(), ids=lambda simulation: simulation.name)
def test_only_law_reading_and_name_differ_from_the_papers_scenario(simulation):
    ours = paper_scenario(simulation, scenarios_folder())
    paper = load_file(scenarios_folder() / "paper" / f"{simulation.case}.yaml")
    assert ours.controller.law == simulation.law
    assert ours.controller.anti_windup is (simulation.reading == "anti_windup")
    assert ours.robots.force_limit == (None if simulation.reading == "unlimited" else 10.0)
    assert ours.controller.slope == paper.controller.slope == 20
    if simulation.law == "asmc":
        assert ours.controller.switching_gain == 80
    else:
        assert ours.controller.switching_gain == 1
        assert ours.controller.proportional_gain == paper.controller.proportional_gain == 30
    if simulation.law != "pd_smc":
        assert ours.controller.initial_estimate == paper.controller.initial_estimate
    changed = {"name", "controller", "robots", "mission", "expect"}
    assert ours.model_dump(exclude=changed) == paper.model_dump(exclude=changed)
    assert ours.mission.model_dump(exclude={"behaviors"}) == paper.mission.model_dump(exclude={"behaviors"})
    for mine, theirs in zip(ours.mission.behaviors, paper.mission.behaviors, strict=True):
        assert mine.model_dump(exclude={"gain"}) == theirs.model_dump(exclude={"gain"})
    assert (ours.mission.behaviors[0].gain == "printed") is (simulation.reading != "anti_windup")
    assert [each.gain for each in ours.mission.behaviors[1:]] == [0.8, 0.8]
    same = {"force_limit"}
    assert ours.robots.model_dump(exclude=same) == paper.robots.model_dump(exclude=same)


def test_figures_are_chosen_by_number_and_say_what_they_need():
    assert [figure.key for figure in chosen_figures(["6,fig05", "17"])] == ["5", "6", "17"]
    assert len(chosen_figures([])) == len(FIGURES)
    assert needed(chosen_figures(["6"])) == [
        PaperRun("case1_2d", "asmc", "unlimited"),
        PaperRun("case1_2d", "asmc", "anti_windup"),
    ]
    assert needed(chosen_figures(["laws"])) == simulations()
    with pytest.raises(UsageError, match=r"--only 4, x: .* 5 to 17"):
        chosen_figures(["4", "5", "x"])


@pytest.fixture
def task(tmp_path, compiled):
    simulation = PaperRun("case1_2d", "apd_smc", "anti_windup")
    path = scenarios_folder() / "paper" / "case1_2d.yaml"
    return RunJob(simulation, load_file(path, {"duration": 2.0, "expect": []}), tmp_path / "run")


def test_what_has_run_is_not_run_again_unless_it_changed(task):
    first = fly_simulation(task)
    assert first.ran and first.measured.completed
    written = (task.folder / "trace.nc").stat().st_mtime_ns
    second = fly_simulation(task)
    assert not second.ran
    assert second.measured == first.measured
    assert (task.folder / "trace.nc").stat().st_mtime_ns == written
    changed = task._replace(scenario=task.scenario.model_copy(update={"seed": 1}))
    assert measured_before(changed) is None
    assert fly_simulation(changed).ran
    assert (task.folder / "resolved.yaml").read_text() == dump_scenario(changed.scenario)
    assert fly_simulation(changed._replace(again=True)).ran


def test_a_run_that_was_interrupted_is_run_again_and_one_that_diverged_is_not(task):
    fly_simulation(task)
    outcome = json.loads((task.folder / "outcome.json").read_text())
    for value, ran in ((Outcome.INTERRUPTED, True), (Outcome.DIVERGED, False)):
        (task.folder / "outcome.json").write_text(json.dumps(outcome | {"outcome": value.value}))
        assert fly_simulation(task).ran is ran


def test_a_program_that_breaks_is_an_outcome_that_is_not_final(task, monkeypatch):
    def broken(*args):
        raise ZeroDivisionError("by zero")

    monkeypatch.setattr(study_runs, "fly", broken)
    done = fly_simulation(task)
    assert done.measured.outcome == "failed"
    assert "by zero" in done.measured.message
    assert measured_before(task) is None


def double(number):
    return 2 * number


@pytest.mark.parametrize("workers", [1, 2])
def test_results_come_in_the_order_of_the_items(workers):
    seen = []
    assert side_by_side(double, [3, 1, 2], workers, lambda done, total: seen.append((done, total))) == [
        6,
        2,
        4,
    ]
    assert seen[-1] == (3, 3)
    assert side_by_side(double, [], workers) == []


def kill_itself(item):
    os.kill(os.getpid(), signal.SIGKILL)


def test_a_worker_that_is_killed_is_said_in_one_sentence():
    with pytest.raises(EscortError, match="killed 3 times .killed by SIGKILL; out of memory"):
        side_by_side(kill_itself, [1, 2], 2)


def kill_itself_unless_even(item):
    return kill_itself(item) if item % 2 else item


def test_an_item_that_kills_its_process_costs_its_own_result():
    for items in ([2, 1, 4, 6], [1]):
        found = side_by_side(
            kill_itself_unless_even, items, len(items), lost=lambda item, cause: (item, cause)
        )
        assert found == [item if item % 2 == 0 else (item, "killed by SIGKILL") for item in items]


VALUES = {
    "settling_time": 5.0,
    "tracking_time": 1.0,
    "error_peak": 0.1,
    "radius_error": 0.001,
    "radius_error_max": 0.003,
    "spacing_error": 0.001,
    "e_rms": 0.014,
    "e_dot_rms": 0.016,
    "true_e_rms": 0.0015,
    "true_e_dot_rms": 0.015,
    "chattering": 1000.0,
    "force_rms": 1.5,
    "obstacle_distance": 1.98,
    "robot_distance": 5.0,
    "contacts": 0.0,
}


def run(case="case1_2d", law="apd_smc", reading="unlimited", outcome="completed", approaches=(), **values):
    found = VALUES | values if outcome == "completed" else dict.fromkeys(QUANTITIES)
    return Measured(PaperRun(case, law, reading), outcome, "at 5 s", found, list(approaches))


def reading(reading="unlimited", ours=None, theirs=None, lost=()):
    """All runs of one reading, APD-SMC's and ASMC's with values of their own."""
    met = [Approach(1, 1.98, [1]), Approach(4, 1.98, [4])]
    return {
        (case, law): run(
            case,
            law,
            reading,
            "diverged" if (case, law) in lost else "completed",
            met if "obstacles" in case else met[:1] if "obstacle" in case else (),
            **(own or {}),
        )
        for case in CASES
        for law, own in zip(LAWS, (ours, theirs, None), strict=True)
    }


NOT_JUDGED = [claim for claim in CLAIMS if claim.rule.startswith("not judged")]
WORSE = {"settling_time": 6.0, "tracking_time": 2.0, "e_dot_rms": 0.08, "obstacle_distance": 1.9}


def test_values_measured_are_those_of_the_table():
    assert set(VALUES) == set(QUANTITIES)


def test_every_claim_holds_where_the_paper_is_right():
    findings = [claim(reading("limited", theirs=WORSE)) for claim in CLAIMS]
    expected = [None if claim in NOT_JUDGED else True for claim in CLAIMS]
    assert [finding.holds for finding in findings] == expected


@pytest.mark.parametrize("claim", CLAIMS, ids=lambda claim: f"{claim.section} {claim.words}")
def test_every_claim_fails_where_the_paper_is_wrong(claim):
    bad = WORSE | {"radius_error": 0.4, "contacts": 1.0}
    runs = reading("limited", ours=bad, lost=[("case3_2d", "apd_smc")])
    for key in [key for key in runs if "obstacles" in key[0]]:
        runs[key] = runs[key].__class__(*list(vars(runs[key]).values())[:-1], [Approach(2, 1.9, [2])] * 2)
    assert claim(runs).holds is (None if claim in NOT_JUDGED else False)
    assert claim(runs).measured


@pytest.mark.parametrize("claim", CLAIMS, ids=lambda claim: f"{claim.section} {claim.words}")
def test_a_claim_is_undecided_without_its_runs_and_false_where_all_diverge(claim):
    assert claim({}).holds is None
    assert "has not run" in claim({}).measured
    everything = [(case, law) for case in CASES for law in LAWS]
    assert claim(reading("limited", lost=everything)).holds is False


def test_equal_laws_are_no_better():
    assert not better(run(), run(law="asmc"), SPEED + PRECISION)
    assert not better(run(settling_time=4.9), run(law="asmc"), SPEED)  # within the margin
    assert better(run(settling_time=4.0), run(law="asmc"), SPEED)
    assert not better(run(settling_time=4.0, tracking_time=2.0), run(law="asmc"), SPEED)
    assert better(run(), run(law="asmc", settling_time=math.inf), SPEED)
    assert not better(run(settling_time=math.inf), run(law="asmc", settling_time=math.inf), SPEED)
    assert better(run(), run(law="asmc", outcome="diverged"), SPEED)
    assert not better(run(outcome="diverged"), run(law="asmc", outcome="diverged"), SPEED)


@pytest.mark.parametrize(
    ("holds", "expected"),
    [
        ((True, True, True), "yes"),
        ((None, True, True), "yes"),
        ((False, False, None), "no"),
        ((True, False, True), "not in: as printed, 10 N limit"),
        ((True, False, False), "only in: as printed, no force limit"),
        ((None, None, None), "undecided"),
    ],
)
def test_a_verdict_sums_up_the_readings(holds, expected):
    assert verdict({name: Conclusion(one, "") for name, one in zip(READINGS, holds, strict=True)}) == expected


def test_numbers_are_written_for_people():
    assert value_text(None) == value_text(math.nan, "m") == "-"
    assert value_text(math.inf, "s") == "never"
    assert value_text(0.00123, "m") == "1.23 mm"
    assert value_text(0.0869, "m/s") == "86.9 mm/s"
    assert value_text(19946.3, "N/s") == "19946 N/s"
    assert value_text(0.0, "1") == "0"


def test_the_table_is_complete_and_one_cell_stays_one_cell():
    runs = [found for name in READINGS for found in reading(name, theirs=WORSE).values()]
    facts = json.loads(json.dumps(claims_document(runs)))
    assert len(facts["claims"]) == len(CLAIMS)
    assert len(facts["runs"]) == 63
    assert all(row["faster"] and row["more_precise"] for row in facts["comparison"] if row["than"] == "asmc")
    text = claims_markdown(runs)
    rows = [line.replace("\\|", "") for line in text.splitlines() if line.startswith("|")]
    assert len(rows) == (2 + len(CLAIMS)) + 2 * (2 + 21) + 3 * (2 + 21)
    assert {line.count("|") for line in rows} == {9, 7, 19}
    assert "not run" in claims_markdown(runs[:3])


def test_a_run_is_measured_before_its_first_obstacle(tmp_path, compiled):
    path = Path(scenarios_folder() / "paper" / "case2_2d_obstacles.yaml")
    changes = {"duration": 20.0, "target.position": ["3+0.5*t", "0"], "obstacles[0].position": [10, 5.0]}
    simulation = PaperRun("case2_2d_obstacles", "apd_smc", "anti_windup")
    found = fly_simulation(
        RunJob(simulation, load_file(path, changes | {"expect": []}), tmp_path / "run")
    ).measured
    assert found.completed
    assert found.approaches[0].robot == 1
    assert found.approaches[0].avoided == [1]
    assert 1.9 < found.approaches[0].distance == found.values["obstacle_distance"] < 2.05
    assert found.values["tracking_time"] < 5.0
    empty = measured(simulation, "failed", "broke", None)
    assert set(empty.values.values()) == {None}
