import csv
import json
import math
import re

import pytest

from escort_mj.api import load_scenario
from escort_mj.control.outer_loops import OUTER_LOOPS, BarrierFilter, Nsb, PotentialField
from escort_mj.errors import ScenarioError, UsageError
from escort_mj.laws import LAWS as MODELS
from escort_mj.laws import ApdSmc, Asmc, ComputedTorque, Pd, PdSmc, SuperTwisting
from escort_mj.record.window import Span
from escort_mj.scenario import Scenario, parse_scenario
from escort_mj.study.compare.compare import check_span, fly_trial, trial_scenario
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
    told_best,
    trials,
)
from escort_mj.study.compare.comparison_table import (
    cell,
    cells,
    comparison_document,
    comparison_latex,
    comparison_markdown,
    comparison_page,
    comparison_summary,
    into_page,
    runs_table,
)
from escort_mj.study.compare.laws import controller_of, outer_of
from escort_mj.study.compare.runs import RunJob
from escort_mj.study.sweeps.design import Clock


def test_every_law_has_a_name_for_people():
    assert len(set(LAWS.values())) == len(MODELS)


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


CLOCK = Clock(0.002, 0.02)


def of_seeds(law, seeds=12, outcome="completed", **values):
    """Results of a law; values are functions of the seed, or numbers."""
    return [
        result(law, seed=k, outcome=outcome, **{n: v(k) if callable(v) else v for n, v in values.items()})
        for k in range(seeds)
    ]


def test_bold_is_what_tests_tell_apart():
    table = rows(
        of_seeds("pd", energy=lambda k: 2.0 + 0.1 * k, force_rms=lambda k: 1.0 + (-1) ** k)
        + of_seeds("asmc", energy=lambda k: 1.0 + 0.1 * k, force_rms=lambda k: 0.99 + 0.5 * (-1) ** k)
        + of_seeds("apd_smc", outcome="diverged")
    )
    told = told_best(table, CLOCK)
    assert {name: row.law for name, (row, _) in told.items()} == {"energy": "asmc"}
    least = 2.0 / 2**12  # of twelve seeds that all agree; two quantities differ at all
    assert told["energy"][1] == pytest.approx(2 * least)
    assert cells(table, "energy", told["energy"][0])[:2] == ["2.55 ± 0.36 J", "**1.55 ± 0.36 J**"]
    assert told_best(rows(of_seeds("pd", 3, energy=1.0) + of_seeds("asmc", 3, energy=2.0)), CLOCK) == {}
    assert told_best(rows(of_seeds("pd", 1)), CLOCK) == {}


def test_bold_beats_every_other_one_not_the_worst_alone():
    table = rows(of_seeds("pd", energy=1.0) + of_seeds("asmc", energy=1.0) + of_seeds("apd_smc", energy=9.0))
    assert "energy" not in told_best(table, CLOCK)
    table = rows(of_seeds("pd", energy=0.9) + of_seeds("asmc", energy=1.0) + of_seeds("apd_smc", energy=9.0))
    assert told_best(table, CLOCK)["energy"] == (table[0], pytest.approx(2 * 2.0 / 2**12))


def test_more_clearance_is_better_and_a_sample_is_no_time():
    nearer = of_seeds("pd", obstacle_clearance_min=1.0, settling_time=10.0)
    farther = of_seeds("asmc", obstacle_clearance_min=2.0, settling_time=10.02)
    assert {name: row.law for name, (row, _) in told_best(rows(nearer + farther), CLOCK).items()} == {
        "obstacle_clearance_min": "asmc"
    }
    assert "settling_time" in told_best(rows(nearer + farther), Clock(0.002, 0.01))


def test_never_loses_in_the_table_too():
    mostly = of_seeds("pd", settling_time=lambda k: math.inf if k > 3 else 9.0)
    always = of_seeds("asmc", settling_time=10.0)
    told = told_best(rows(mostly + always), CLOCK)
    assert "settling_time" not in told or told["settling_time"][0].law == "asmc"
    assert (
        told_best(rows(of_seeds("pd", settling_time=math.inf) + always), CLOCK)["settling_time"][0].law
        == "asmc"
    )


def test_windows_are_in_every_head():
    scenario, results = parse_scenario("name: demo"), of_seeds("pd") + of_seeds("asmc")
    for over, words in ((Span("whole"), "whole run"), (Span(None, 5.0, 9.0), "after 5 s before 9 s")):
        text = comparison_page(scenario, results, over)
        assert f"chattering, {words}" in text and f"radius error, mean, {words}" in text
        assert "settling time, whole run" in text and "last fifth" not in text
        assert f"chattering [N/s], {words}" in runs_table(results, over)
        assert f"chattering, {words}" in comparison_latex(scenario, results, over)
    text = comparison_page(scenario, results)
    assert "chattering, whole run" in text and "radius error, mean, last fifth" in text


@pytest.mark.parametrize(
    ("span", "words"),
    [
        (Span("tail", 3.0), "found over and after; a window is given by over"),
        (Span(None, 5.0, 4.0), "its window is empty: after 5 s and before 4 s"),
        (Span(None, 60.0), "--after 60: the run ends at 60 s"),
        (Span(None, 0.0, 61.0), "--before 61: the run ends at 60 s"),
    ],
)
def test_parts_that_runs_do_not_have(span, words):
    with pytest.raises(UsageError, match=re.escape(words)):
        check_span(span, 60.0)
    for fine in (None, Span("whole"), Span("tail"), Span(None, 0.0, 60.0)):
        check_span(fine, 60.0)


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
    first, settled = best(table, "energy"), best(table, "settling_time")
    assert first is not None and settled is not None and (first.law, settled.law) == ("asmc", "apd_smc")
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
    assert len(comparison_summary(scenario, results)) == 5
    table = list(csv.DictReader(runs_table(results).splitlines()))
    assert (
        len(table) == 4
        and table[3]["settling_time [s], whole run"] == "inf"
        and table[2]["energy [J], whole run"] == ""
    )
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
    whole = fly_trial(assignment, Span("whole")).values
    assert whole["radius_error_mean"] > first.values["radius_error_mean"]
    assert whole["chattering"] == first.values["chattering"]


def test_every_outer_loop_has_a_name_for_people():
    assert list(OUTERS) == [model.model_fields["loop"].default for model in OUTER_LOOPS]


def test_an_outer_loop_keeps_its_own_gains_and_others_have_their_defaults():
    base = parse_scenario("mission: {outer: {loop: barrier_filter, rate: 3}}")
    assert outer_of(base, "barrier_filter") == BarrierFilter(rate=3)
    assert outer_of(base, "nsb") == Nsb()
    assert outer_of(base, "potential_field") == PotentialField()
    assert trial_scenario(base, Trial("pd", "nsb", 0)).mission.outer == Nsb()
