"""Designs and rows side by side: factors, cells, pairs and the front, of planted results."""

import math
from pathlib import Path

import numpy as np
import pytest

from escort_mj.errors import UsageError
from escort_mj.study.engine.store import Store
from escort_mj.study.sweeps.quantities import COLLIDED, COMPLETED, EFFORT, PASSED, PRECISION, SAFETY
from escort_mj.study.sweeps.results import (
    Results,
    open_results,
    record_of,
    spreads_by_factors,
    unit_of,
    word,
)
from tests.study.planted import design, results, rows, study_folder


@pytest.fixture(scope="module")
def planted(tmp_path_factory: pytest.TempPathFactory) -> Results:
    return results(tmp_path_factory.mktemp("planted"))


def cell(found: Results, **levels: str) -> int:
    """The one cell with these levels."""
    wanted = [levels[name] for name in ("law", "mass", "limit")]
    return next(index for index in range(len(found.cells)) if list(found.labels(index).values()) == wanted)


def test_factors_know_their_levels_units_and_scale(planted: Results) -> None:
    law, mass, limit = planted.factors.values()
    assert law.levels == ("apd_smc", "pd", "asmc") and not law.numbers and law.title == "controller"
    assert mass.numbers == (0.2, 1.0, 5.0) and mass.log and mass.title == "robots.mass [kg]"
    assert limit.levels == ("5", "10", "20") and limit.log and limit.unit == "N"
    assert planted.compared() is law and planted.compared("robots.mass") is mass


def test_what_cannot_be_compared_is_said(planted: Results) -> None:
    with pytest.raises(UsageError, match=r"found robots\.radius.*controller, robots\.mass"):
        planted.compared("robots.radius")


def test_rates_count_what_was_planted(planted: Results) -> None:
    broken = cell(planted, law="asmc", mass="5", limit="10")
    assert planted.rate(COMPLETED, broken)[:2] == (3, 4)
    assert planted.rate(PASSED, broken)[:2] == (0, 4)
    assert planted.rate(COLLIDED, broken)[:2] == (1, 3)  # of the broken run it is not known
    good = cell(planted, law="pd", mass="1", limit="5")
    assert planted.rate(PASSED, good)[:2] == (4, 4)


def test_summaries_keep_never_and_count_what_is_missing(planted: Results) -> None:
    index = cell(planted, law="asmc", mass="5", limit="5")
    found = planted.summary("settling_time", index)
    assert (found.runs, found.known, found.never, found.median) == (4, 3, 3, math.inf)
    precision = planted.summary(PRECISION, cell(planted, law="pd", mass="1", limit="5"))
    assert precision.mean == pytest.approx(0.02 + 0.001 * 2.5)


def test_safety_is_the_least_clearance_of_all(planted: Results) -> None:
    index = cell(planted, law="apd_smc", mass="0.2", limit="5")
    assert planted.of_cell(SAFETY, index) == pytest.approx(0.48 + 0.01 * np.arange(1, 5))


def test_pairs_find_what_was_planted(planted: Results) -> None:
    law = planted.factors["controller"]
    pd, asmc = planted.comparisons(law, [EFFORT])
    assert (pd.first, pd.level, asmc.level) == ("apd_smc", "pd", "asmc")
    assert pd.paired.pairs == 36 and pd.paired.blocks == 4
    assert pd.paired.difference == pytest.approx(10.0 * (5 + 10 + 20) / 3)
    assert pd.paired.dominance == 1.0
    assert asmc.paired.unpaired == 3
    assert min(pd.p, asmc.p) == pytest.approx(2 * 2 / 2**4)  # two tests of four seeds


def test_drawn_points_are_the_blocks(tmp_path: Path) -> None:
    found = results(
        tmp_path,
        "study: drawn\nscenario: main\nset: {expect: []}\nvary: {controller: [apd_smc, pd]}\nseeds: 2\n"
        "sample: {count: 8, over: {robots.mass: {low: 0.5, high: 5, scale: log}}}\n",
    )
    (one,) = found.comparisons(found.factors["controller"], [EFFORT])
    assert (one.paired.pairs, one.paired.blocks, found.block) == (16, 8, "point")
    mass = found.factors["robots.mass"]
    assert mass.drawn and mass.log and len(mass.levels) == 8
    with pytest.raises(UsageError, match="robots.mass"):
        found.compared("robots.mass")


def test_the_front_is_what_no_cell_beats(planted: Results) -> None:
    on_front = [planted.labels(int(index)) for index in np.flatnonzero(planted.front())]
    least = {"controller": "apd_smc", "robots.mass": "0.2", "robots.force_limit": "5"}
    assert on_front == [least]


def test_a_folder_holds_all_that_is_needed(tmp_path: Path) -> None:
    folder, fresh = study_folder(tmp_path), results(tmp_path)
    found = open_results(folder)
    assert found.cells == fresh.cells and found.runs == fresh.runs
    np.testing.assert_array_equal(found.values(PRECISION), fresh.values(PRECISION))
    (folder / "design.json").unlink()
    with pytest.raises(UsageError, match="no design"):
        open_results(folder)
    with pytest.raises(UsageError, match="no results"):
        open_results(tmp_path)


def test_runs_that_are_not_made_yet_are_missing(tmp_path: Path) -> None:
    laid_out = design(tmp_path)
    some = dict(list(rows(laid_out).items())[:5])
    folder = tmp_path / "out"
    with Store(folder) as store:
        for row in some.values():
            store.put(row)
    record_of(laid_out).write(folder)
    found = open_results(folder)
    assert len(found.rows) == 5 and np.isnan(found.values(PASSED)).sum() == len(laid_out) - 5


def test_levels_in_words() -> None:
    assert word({"law": "pd", "kp": 3}) == "pd" and word(0.1 + 0.2) == "0.3" and word([1, 2]) == "[1, 2]"
    assert unit_of("sensing.position.noise") == "m" and unit_of("sensing.velocity.bias") == "m/s"
    assert unit_of("robots.mass") == "kg" and unit_of("controller") == "" == unit_of("no.such")
    assert spreads_by_factors([0.2, 0.5, 1, 2, 5]) and not spreads_by_factors([1, 2, 3, 4, 5])
    assert not spreads_by_factors([0, 1, 10]) and not spreads_by_factors([1, 1.1, 1.2])


def test_laws_with_tables_of_their_own_stay_apart(tmp_path: Path) -> None:
    text = (
        "study: tables\nscenario: main\nset: {expect: []}\n"
        "vary:\n  controller:\n    - {law: pd, proportional_gain: 3}\n    - {law: pd, proportional_gain: 5}\n"
        "    - {law: asmc}\n"
    )
    found = results(tmp_path, text)
    levels = found.factors["controller"].levels
    assert len(set(levels)) == 3 and levels[2] == "asmc" and "3" in levels[0]


def compared(folder: Path, planter, quantities=("settling_time",), rate: int = 50) -> list:
    """Levels of two laws over 20 seeds, of what a function plants."""
    text = (
        f"study: two\nscenario: main\nset: {{expect: [], recording.rate: {rate}}}\n"
        "vary: {controller: [apd_smc, pd]}\nseeds: 20\n"
    )
    found = results(folder, text, planter)
    return list(found.comparisons(found.factors["controller"], quantities))


def test_what_is_compared_together_is_corrected_together(tmp_path: Path) -> None:
    def planter(cell, seed):
        second = cell.labels["controller"] == "pd"
        return {"energy": seed + second, "force_rms": 1.0 + second * (-1) ** seed, "contacts": 2.0}

    names = ["energy", "force_rms", "contacts"]
    energy, force, contacts = compared(tmp_path, planter, names)
    assert energy.p == pytest.approx(2 * energy.paired.p) and energy.better == "apd_smc"
    assert force.p == 1.0 and force.better == ""
    assert contacts.p == 1.0 and contacts.paired.alike == 20  # counts for no test: nothing differs
    assert compared(tmp_path, planter, names[:1])[0].p == energy.paired.p


@pytest.mark.parametrize(("rate", "better"), [(50, ""), (250, "pd")])
def test_a_moment_is_better_only_by_more_than_a_sample(tmp_path: Path, rate: int, better: str) -> None:
    def planter(cell, seed):
        sooner = 0.02 * (seed % 5 > 0) if cell.labels["controller"] == "pd" else 0.0
        return {"settling_time": 10.0 + 0.02 * seed - sooner}

    (one,) = compared(tmp_path, planter, rate=rate)
    assert one.paired.difference == pytest.approx(-0.016) and one.better == better


def test_a_study_chooses_what_it_shows_and_over_which_part_of_runs(tmp_path: Path) -> None:
    text = (
        "study: chosen\nscenario: main\nset: {expect: []}\nseeds: 2\n"
        "quantities: [energy, {metric: chattering, over: tail},"
        " {metric: chattering, after: 2.5, before: 40}]\n"
    )
    keys = ["energy", "chattering_over_tail", "chattering_after_2.5_before_40"]
    found = results(tmp_path, text, lambda cell, seed: dict.fromkeys(keys, 1.0) | {"force_rms": 2.0})
    assert found.shown() == keys and found.drawn() == [PASSED, *keys]
    heads = [found.quantities[key].head for key in keys]
    assert heads == [
        "energy [J], whole run",
        "chattering [N/s], last fifth",
        "chattering [N/s], after 2.5 s before 40 s",
    ]
    plain = results(tmp_path, text.partition("quantities")[0])
    assert plain.runs[0].key != found.runs[0].key  # runs without these values are no runs of it
