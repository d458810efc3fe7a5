"""Laws and outer loops compared: the study that does it, the best that tests tell, tables."""

import json
import math
import re

import pytest

from escort_mj.api import load_scenario, scenarios_folder
from escort_mj.control.outer_loops import OUTER_LOOPS, BarrierFilter, Nsb, PotentialField
from escort_mj.errors import UsageError
from escort_mj.laws import LAWS as MODELS
from escort_mj.laws import ApdSmc, Asmc, ComputedTorque, Pd, PdSmc, SuperTwisting
from escort_mj.record.window import Span
from escort_mj.report.comparison import (
    comparison,
    document_of,
    latex_of,
    page_of,
    spread_text,
    summary_of,
)
from escort_mj.scenario import dump_scenario, parse_scenario
from escort_mj.study.compare import (
    COMPARED,
    LAW,
    LAWS,
    OUTERS,
    check_span,
    chosen_names,
    comparison_of,
    controller_of,
    outer_of,
)
from escort_mj.study.sweeps.definition import load_study
from escort_mj.study.sweeps.design import Design
from escort_mj.study.sweeps.results import Results, record_of
from escort_mj.study.sweeps.statistics import Summary
from tests.study.planted import rows


def design_of(tmp_path, base=None, laws=("pd,asmc",), outers=(), seeds=1, over=None):
    base = load_scenario("main") if base is None else base
    (path := tmp_path / "scenario.yaml").write_text(dump_scenario(base))
    return Design(load_study(comparison_of(base, path, laws, outers, seeds, over)), scenarios_folder())


def planted(tmp_path, planter, laws=("pd,asmc",), seeds=12, over=None):
    """Results of a comparison; the planter says what a law came to with a seed counted from 0."""
    design = design_of(tmp_path, None, laws, (), seeds, over)
    whole = dict.fromkeys(COMPARED, 1.0)

    def plant(cell, seed):
        found = planter(cell.labels[LAW]["law"], seed - design.seeds[0])
        return found if isinstance(found, str) else whole | found

    return Results(record_of(design), rows(design, plant))


def test_every_law_and_loop_has_a_name_for_people():
    assert len(set(LAWS.values())) == len(MODELS)
    assert list(OUTERS) == [model.model_fields["loop"].default for model in OUTER_LOOPS]


def test_all_teams_have_the_law_that_is_compared(tmp_path):
    design = design_of(tmp_path, load_scenario("pursuit/two_laws"), ("asmc,apd_smc",))
    assert [[law.law for law in design.scenario(cell).laws] for cell in design.cells] == [
        ["asmc"],
        ["apd_smc"],
    ]


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


def test_an_outer_loop_keeps_its_own_gains_and_others_have_their_defaults():
    base = parse_scenario("mission: {outer: {loop: barrier_filter, rate: 3}}")
    assert outer_of(base, "barrier_filter") == BarrierFilter(rate=3)
    assert outer_of(base, "nsb") == Nsb()
    assert outer_of(base, "potential_field") == PotentialField()


def test_names_are_chosen_in_the_order_given_and_once():
    assert chosen_names("--laws", [], LAWS, ["pd"]) == ["pd"]
    assert chosen_names("--laws", ["asmc,pd", "asmc"], LAWS, []) == ["asmc", "pd"]
    with pytest.raises(UsageError, match=r'--laws asmk: allowed are apd_smc, .*did you mean "asmc"\?'):
        chosen_names("--laws", ["pd,asmk"], LAWS, [])
    with pytest.raises(UsageError, match="--laws: found no name; allowed are apd_smc"):
        chosen_names("--laws", [""], LAWS, ["pd"])


def test_every_combination_differs_only_in_what_it_is_named_for(tmp_path):
    base = load_scenario("main")
    design = design_of(tmp_path, base, outers=["nsb", "barrier_filter"], seeds=3)
    assert len(design) == 12 and design.seeds == (base.seed, base.seed + 1, base.seed + 2)
    found = [design.scenario(cell, base.seed) for cell in design.cells]
    loops = [(one.controller.law, one.mission.outer.loop) for one in found]
    assert loops == [(law, loop) for law in ("pd", "asmc") for loop in ("nsb", "barrier_filter")]
    for ours in found:
        changed = {"controller": True, "expect": True, "mission": {"outer"}}
        assert ours.expect == () and ours.model_dump(exclude=changed) == base.model_dump(exclude=changed)
    assert len({design.folder_of(run) for run in design.runs()}) == 12
    assert next(iter(design.runs())).key[:8] in design.folder_of(next(iter(design.runs())))
    assert design.folder_of(next(iter(design.runs()))).startswith("pd-nsb-seed1-")


def test_spreads_are_written_for_people():
    assert spread_text(Summary([1.05, 3.05]), "s") == "2.05 ± 1.41 s"
    assert spread_text(Summary([math.inf, 4.0]), "s") == "4 s, never in 1 of 2"
    assert spread_text(Summary([math.inf]), "s") == "never"
    assert spread_text(Summary([math.nan]), "s") == "-"
    assert spread_text(Summary([0.001, 0.003]), "m") == "2 ± 1 mm"
    assert spread_text(Summary([0.25]), "1", share=True) == "25 %"
    assert spread_text(Summary([2.0]), "1") == "2"


def laws_of(found, told):
    return {name: found.labels(index)[LAW] for name, (index, _) in told.items()}


def test_bold_is_what_tests_tell_apart(tmp_path):
    def plant(law, k):
        if law == "apd_smc":
            return "lost"
        sign = (-1) ** k
        return {
            "pd": {"energy": 2.0 + 0.1 * k, "force_rms": 1.0 + sign},
            "asmc": {"energy": 1.0 + 0.1 * k, "force_rms": 0.99 + 0.5 * sign},
        }[law]

    found = planted(tmp_path, plant, ["pd,asmc,apd_smc"])
    told = found.told_best(COMPARED)
    assert laws_of(found, told) == {"energy": "asmc"}
    assert told["energy"][1] == pytest.approx(2 * 2.0 / 2**12)  # twelve seeds agree; two quantities differ
    texts = comparison(found).columns["energy"]
    assert texts[:2] == ["2.55 ± 0.36 J", "**1.55 ± 0.36 J**"]
    few = planted(tmp_path, lambda law, k: {"energy": 1.0 + (law == "asmc")}, seeds=3)
    assert few.told_best(COMPARED) == {}
    assert planted(tmp_path, lambda law, k: {}, ["pd"], 1).told_best(COMPARED) == {}


def test_bold_beats_every_other_one_not_the_worst_alone(tmp_path):
    laws = ["pd,asmc,apd_smc"]
    energy = {"pd": 1.0, "asmc": 1.0, "apd_smc": 9.0}
    found = planted(tmp_path, lambda law, k: {"energy": energy[law]}, laws)
    assert "energy" not in found.told_best(COMPARED)
    energy["pd"] = 0.9
    found = planted(tmp_path, lambda law, k: {"energy": energy[law]}, laws)
    assert found.told_best(COMPARED)["energy"] == (0, pytest.approx(2 * 2.0 / 2**12))


def test_more_clearance_is_better(tmp_path):
    def plant(law, k):
        return {"obstacle_clearance_min": 1.0 + (law == "asmc")}

    found = planted(tmp_path, plant)
    assert laws_of(found, found.told_best(COMPARED)) == {"obstacle_clearance_min": "asmc"}


def test_who_diverges_or_never_settles_is_never_best(tmp_path):
    def plant(law, k):
        if law == "pd":
            return {"energy": 0.1} if k else "lost"
        return {
            "energy": 3.0 if law == "asmc" else 4.0,
            "settling_time": math.inf if law == "asmc" and not k else 9.0,
        }

    found = planted(tmp_path, plant, ["pd,asmc,apd_smc"], 2)
    assert (found.best("energy"), found.best("settling_time")) == (1, 2)
    assert planted(tmp_path, lambda law, k: "lost").best("energy") is None
    found = planted(tmp_path, lambda law, k: {"settling_time": math.inf if law == "pd" else 10.0})
    assert laws_of(found, found.told_best(COMPARED)) == {"settling_time": "asmc"}


def test_windows_are_in_every_head(tmp_path):
    for over, words in ((Span("whole"), "whole run"), (Span(None, 5.0, 9.0), "after 5 s before 9 s")):
        found = comparison(planted(tmp_path, lambda law, k: {}, over=over))
        assert f"chattering, {words}" in page_of(found) and f"radius error, mean, {words}" in page_of(found)
        assert "settling time, whole run" in page_of(found) and "last fifth" not in page_of(found)
        assert f"chattering, {words}" in latex_of(found)
    text = page_of(comparison(planted(tmp_path, lambda law, k: {})))
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


def test_the_table_is_complete_in_every_form(tmp_path):
    def plant(law, k):
        return ("lost" if k == 0 else {"settling_time": math.inf}) if law == "asmc" else {}

    found = comparison(planted(tmp_path, plant, seeds=2))
    text = page_of(found)
    lines = [line.replace("\\|", "") for line in text.splitlines() if line.startswith("|")]
    assert len(lines) == 4 and {line.count("|") for line in lines} == {4 + len(COMPARED)}
    assert "diverged 1 of 2" in text and "seed 1: diverged: lost" in text
    assert text.startswith("# Laws compared: main\n")
    assert len(summary_of(found)) == 5
    document = json.loads(json.dumps(document_of(found)))
    assert len(document["runs"]) == 4 and document["combinations"][1]["completed"] == 1
