import csv
import json
import math

import pytest

from escort_mj.api import load_scenario
from escort_mj.control.outer_loops import OUTER_LOOPS, BarrierFilter, Nsb, PotentialField
from escort_mj.errors import ScenarioError, UsageError
from escort_mj.laws import LAWS as MODELS
from escort_mj.laws import ApdSmc, Asmc, ComputedTorque, Pd, PdSmc, SuperTwisting
from escort_mj.scenario import Scenario, parse_scenario
from escort_mj.study.compare.compare import fly_trial, trial_scenario
from escort_mj.study.compare.comparison import (
    LAWS,
    OUTERS,
    QUANTITIES,
    Result,
    Trial,
    best,
    chosen_names,
    mean_and_deviation,
    rows,
    trials,
)
from escort_mj.study.compare.comparison_table import (
    HEADS,
    cell,
    cells,
    comparison_document,
    comparison_markdown,
    comparison_page,
    comparison_summary,
    into_page,
    runs_table,
)
from escort_mj.study.compare.laws import controller_of, outer_of
from escort_mj.study.compare.runs import RunJob


def test_every_law_has_a_name_for_people():
    assert len(set(LAWS.values())) == len(MODELS)
    assert set(HEADS) == set(QUANTITIES)


def test_all_teams_have_the_law_that_is_compared():
    base = load_scenario("pursuit/two_laws")
    for law in ("asmc", "apd_smc"):
        (own,) = trial_scenario(base, Trial(law, "nsb", 0)).laws
        assert own.law == law


def test_gains_go_to_laws_that_mean_the_same_by_them():
    base = parse_scenario(
        "controller: {proportional_gain: 11, derivative_gain: 22, switching_gain: 3, adaptation_rate: 7,"
        " slope: 9, smoothing: saturation, boundary_layer: 0.5, anti_windup: false}"
    )
    shared = {"slope": 9, "anti_windup": False}
    assert controller_of(base, "apd_smc") is base.controller
    assert controller_of(base, "asmc") == Asmc(
        adaptation_rate=7, smoothing="saturation", boundary_layer=0.5, **shared
    )
    assert controller_of(base, "pd_smc") == PdSmc(
        proportional_gain=11,
        derivative_gain=22,
        switching_gain=3,
        smoothing="saturation",
        boundary_layer=0.5,
        **shared,
    )
    assert controller_of(base, "pd") == Pd(proportional_gain=11, derivative_gain=22, **shared)
    assert controller_of(base, "computed_torque") == ComputedTorque(**shared)
    assert controller_of(base, "super_twisting") == SuperTwisting(anti_windup=False)
    other = base.model_copy(update={"controller": SuperTwisting(slope=1, smoothing="tanh", boundary_layer=3)})
    assert controller_of(other, "apd_smc") == ApdSmc()


def test_names_are_chosen_in_the_order_given_and_once():
    assert chosen_names("--laws", [], LAWS, ["pd"]) == ["pd"]
    assert chosen_names("--laws", ["asmc,pd", "asmc"], LAWS, []) == ["asmc", "pd"]
    with pytest.raises(UsageError, match=r'--laws asmk: allowed are apd_smc, .*did you mean "asmc"\?'):
        chosen_names("--laws", ["pd,asmk"], LAWS, [])


def test_every_combination_differs_only_in_what_it_is_named_for():
    base = load_scenario("main", {"mission.outer": "nsb"})
    wanted = trials(["pd", "asmc"], ["nsb"], [1, 2, 3])
    assert len(set(wanted)) == 6
    for trial in wanted:
        ours = trial_scenario(base, trial)
        assert (ours.controller.law, ours.seed, ours.name) == (trial.law, trial.seed, trial.name)
        changed = {"name", "seed", "controller", "expect"}
        assert ours.model_dump(exclude=changed) == base.model_dump(exclude=changed)


def test_a_seed_without_room_is_said():
    tight = Scenario.model_validate({"robots": {"count": 9, "placement": {"within": 1.0}}})  # not checked
    with pytest.raises(ScenarioError, match="placement"):
        trial_scenario(tight, Trial("pd", "nsb", 3))


def result(law="pd", outer="nsb", seed=0, outcome="completed", **values):
    found = dict.fromkeys(QUANTITIES, 1.0) | values
    found = found if outcome == "completed" else dict.fromkeys(QUANTITIES)
    return Result(Trial(law, outer, seed), outcome, "at 5 s", found)


def test_mean_and_spread_are_of_finite_values():
    assert mean_and_deviation([1.0, 3.0]) == (2.0, math.sqrt(2.0), 0, 2)
    assert mean_and_deviation([5.0]) == (5.0, 0.0, 0, 1)
    assert mean_and_deviation([math.inf, 4.0, None]) == (4.0, 0.0, 1, 2)
    assert mean_and_deviation([math.inf]) == (None, 0.0, 1, 1)
    assert mean_and_deviation([None]) == (None, 0.0, 0, 0)


def test_cells_are_written_for_people():
    assert cell("settling_time", mean_and_deviation([1.05, 3.05])) == "2.05 ± 1.41 s"
    assert cell("settling_time", mean_and_deviation([math.inf, 4.0])) == "4 s, never in 1 of 2"
    assert cell("settling_time", mean_and_deviation([math.inf])) == "never"
    assert cell("settling_time", mean_and_deviation([None])) == "-"
    assert cell("radius_error_mean", mean_and_deviation([0.001, 0.003])) == "2 ± 1 mm"
    assert cell("saturated_share", mean_and_deviation([0.25])) == "25 %"
    assert cell("contacts", mean_and_deviation([2.0])) == "2"


def test_the_best_is_marked_but_not_where_all_are_as_good():
    table = rows(
        [result("pd", energy=2.0), result("asmc", energy=1.0), result("apd_smc", outcome="diverged")]
    )
    assert cells(table, "energy") == ["2 J", "**1 J**", "-"]
    assert cells(table[:2], "chattering") == ["1 N/s", "1 N/s"]
    table = rows([result("pd", obstacle_clearance_min=2.0), result("asmc", obstacle_clearance_min=1.0)])
    assert cells(table, "obstacle_clearance_min") == ["**2 m**", "1 m"]


def test_who_diverges_or_never_settles_is_never_best():
    table = rows(
        [
            result("pd", seed=0, energy=0.1),
            result("pd", seed=1, outcome="diverged"),
            result("asmc", seed=0, energy=3.0, settling_time=math.inf),
            result("asmc", seed=1, energy=3.0, settling_time=1.0),
            result("apd_smc", seed=0, energy=4.0, settling_time=9.0),
            result("apd_smc", seed=1, energy=4.0, settling_time=9.0),
        ]
    )
    assert best(table, "energy") == 3.0
    assert best(table, "settling_time") == 9.0
    assert best(rows([result(outcome="diverged")]), "energy") is None


def test_the_table_is_complete_in_every_form(tmp_path):
    scenario = parse_scenario("name: demo")
    results = [result("pd", seed=0), result("pd", seed=1), result("asmc", seed=0, outcome="diverged")]
    results.append(result("asmc", seed=1, settling_time=math.inf))
    text = "\n".join(comparison_markdown(scenario, results))
    lines = [line.replace("\\|", "") for line in text.splitlines() if line.startswith("|")]
    assert len(lines) == 4 and {line.count("|") for line in lines} == {4 + len(QUANTITIES)}
    assert "diverged 1 of 2" in text and "asmc-nsb-seed0: diverged: at 5 s" in text
    assert comparison_page(scenario, results).startswith("# Laws compared: demo\n")
    assert len(comparison_summary(results)) == 3
    table = list(csv.DictReader(runs_table(results).splitlines()))
    assert len(table) == 4 and table[3]["settling_time [s]"] == "inf" and table[2]["energy [J]"] == ""
    assert len(json.loads(json.dumps(comparison_document(scenario, results)))["runs"]) == 4

    docs = tmp_path / "page.md"
    docs.write_text("before\n<!-- compare demo -->\nformer\n<!-- /compare -->\nafter\n<!-- /compare -->\n")
    found = into_page(docs, scenario, results)
    assert found.startswith("before\n") and found.endswith("after\n<!-- /compare -->\n")
    assert "former" not in found and text in found
    docs.write_text(found)
    assert into_page(docs, scenario, results) == found
    for missing in (tmp_path / "none.md", tmp_path):
        with pytest.raises(UsageError, match="cannot be read"):
            into_page(missing, scenario, results)
    docs.write_text("<!-- compare other --><!-- /compare -->")
    with pytest.raises(UsageError, match="compare demo"):
        into_page(docs, scenario, results)


def test_a_trial_is_measured_and_not_run_again(tmp_path, compiled):
    base = load_scenario("paper/case1_2d", {"duration": 2.0, "expect": []})
    trial = Trial("computed_torque", "nsb", 5)
    assignment = RunJob(trial, trial_scenario(base, trial), tmp_path / trial.name)
    first = fly_trial(assignment)
    assert first.ran and first.completed and first.stated
    assert first.values["settling_time"] == math.inf
    assert first.values["obstacle_clearance_min"] is None
    assert 0.0 < first.values["true_error_rms"] < first.values["tracking_error_rms"]
    assert first.values["true_error_max"] > first.values["true_error_rms"]
    second = fly_trial(assignment)
    assert not second.ran and second.values == first.values
    assert fly_trial(assignment._replace(again=True)).ran


def test_every_outer_loop_has_a_name_for_people():
    assert list(OUTERS) == [model.model_fields["loop"].default for model in OUTER_LOOPS]


def test_an_outer_loop_keeps_its_own_gains_and_others_have_their_defaults():
    base = parse_scenario("mission: {outer: {loop: barrier_filter, rate: 3}}")
    assert outer_of(base, "barrier_filter") == BarrierFilter(rate=3)
    assert outer_of(base, "nsb") == Nsb()
    assert outer_of(base, "potential_field") == PotentialField()
    assert trial_scenario(base, Trial("pd", "nsb", 0)).mission.outer == Nsb()
