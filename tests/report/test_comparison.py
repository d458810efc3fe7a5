import json
import math

import numpy as np
import pytest
from PIL import Image

from escort_mj.api import load_scenario
from escort_mj.errors import UsageError
from escort_mj.report.comparison import draw_bars, draw_comparison
from escort_mj.study.compare.compare import compare_controllers
from escort_mj.study.compare.comparison import QUANTITIES, Result, Trial

SHORT = {"duration": 1.0, "expect": []}


def undrawn(*given):
    """No figures, where others are looked at: drawing takes as long as all the rest."""
    return []


@pytest.fixture(scope="module")
def whole(compiled, tmp_path_factory):
    out, steps = tmp_path_factory.mktemp("comparison"), []
    scenario = load_scenario("main", SHORT)
    result = compare_controllers(
        scenario,
        out,
        draw_comparison,
        ["pd,super_twisting"],
        seeds=2,
        workers=1,
        progress=lambda *at: steps.append(at),
    )
    return out, scenario, result, steps


def test_runs_table_and_figures_are_there(whole):
    out, _, result, steps = whole
    assert result.stated and steps[-1] == (4, 4)
    assert {path.parent.name for path in out.glob("*/outcome.json")} == {
        f"{law}-set_based-seed{seed}" for law in ("pd", "super_twisting") for seed in (1, 2)
    }
    assert len(json.loads((out / "table.json").read_text())["runs"]) == 4
    assert len((out / "table.csv").read_text().splitlines()) == 5
    assert "PD, gravity compensated" in (out / "table.md").read_text()
    assert r" & PD, gravity compensated & " in (out / "table.tex").read_text()
    for name in ("comparison", "curves"):
        assert np.asarray(Image.open(out / "figures" / f"{name}.png").convert("L")).std() > 5


def test_a_second_time_nothing_runs(whole):
    out, scenario, _, _ = whole
    before = (out / "table.md").read_text()
    again = compare_controllers(scenario, out, undrawn, ["pd,super_twisting"], seeds=2, workers=1)
    assert again.lines[0] == "4 runs: 0 new, 4 from earlier"
    assert (out / "table.md").read_text() == before


def test_outer_loops_stand_beside_each_other(tmp_path, compiled):
    scenario = load_scenario("main", SHORT)
    result = compare_controllers(
        scenario, tmp_path, undrawn, ["pd"], ["nsb", "barrier_filter,potential_field"], workers=1
    )
    assert result.stated and len(result.lines) == 7
    table = (tmp_path / "table.md").read_text()
    assert table.startswith("# Outer loops compared: main") and "barrier filter" in table
    yaml = (tmp_path / "pd-potential_field-seed1" / "scenario.yaml").read_text()
    assert "potential_field" in yaml


def test_what_diverges_is_a_row_and_is_drawn(tmp_path, compiled):
    runaway = load_scenario("paper/case1_3d", {"controller.anti_windup": False, "expect": [], "duration": 20})
    result = compare_controllers(runaway, tmp_path, draw_comparison, ["apd_smc"], workers=1)
    assert result.stated and any("diverged" in line for line in result.lines)
    assert [path.name for path in (tmp_path / "figures").iterdir()] == ["comparison.png"]


def test_bars_of_what_never_settles(tmp_path):
    values = dict.fromkeys(QUANTITIES, 0.5) | {"obstacle_clearance_min": None}
    results = [
        Result(Trial("pd", "nsb", 0), "completed", "", values | {"settling_time": math.inf}),
        Result(Trial("pd", "nsb", 1), "completed", "", values),
        Result(Trial("asmc", "nsb", 0), "completed", "", values | {"settling_time": math.inf}),
        Result(Trial("apd_smc", "nsb", 0), "unstable", "", dict.fromkeys(QUANTITIES)),
    ]
    path = draw_bars(tmp_path, load_scenario("main"), results)
    assert np.asarray(Image.open(path).convert("L")).std() > 5


def test_what_cannot_be_done_is_said_before_anything_runs(tmp_path):
    scenario = load_scenario("main", SHORT)
    with pytest.raises(UsageError, match="--laws lqr"):
        compare_controllers(scenario, tmp_path / "out", draw_comparison, ["lqr"])
    with pytest.raises(UsageError, match='--outer nbs: .*did you mean "nsb"'):
        compare_controllers(scenario, tmp_path / "out", draw_comparison, ["pd"], ["nbs"])
    with pytest.raises(UsageError, match="--docs"):
        compare_controllers(scenario, tmp_path / "out", draw_comparison, docs=tmp_path / "missing.md")
    assert not (tmp_path / "out").exists()
